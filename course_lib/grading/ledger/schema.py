"""The tables of the ledger. Records and decisions are only ever added; a student is only ever forgotten as a whole."""

VERSION = 2

NEWEST = "(SELECT id FROM records WHERE entry = {} ORDER BY status = 'infrastructure', id DESC LIMIT 1)"
"""The record of a submission that counts: the newest grade, or else the newest failure to grade."""

SCHEMA = f"""
CREATE TABLE about (version INTEGER NOT NULL, forgetting INTEGER NOT NULL DEFAULT 0);
INSERT INTO about (version) VALUES ({VERSION});

CREATE TABLE runs (
    id INTEGER PRIMARY KEY, lab TEXT NOT NULL, lab_version TEXT NOT NULL, environment TEXT NOT NULL,
    grader TEXT NOT NULL, seed INTEGER NOT NULL, per_student INTEGER NOT NULL, limits TEXT NOT NULL,
    isolation TEXT NOT NULL, started TEXT NOT NULL
);

CREATE TABLE entries (
    id INTEGER PRIMARY KEY, student TEXT NOT NULL, named TEXT NOT NULL, lab TEXT NOT NULL, sha256 TEXT NOT NULL,
    path TEXT NOT NULL, received TEXT NOT NULL, late INTEGER NOT NULL, suffix INTEGER NOT NULL, layout TEXT NOT NULL,
    trouble TEXT NOT NULL, code TEXT NOT NULL, download INTEGER NOT NULL, added TEXT NOT NULL,
    UNIQUE (lab, sha256, path)
);

CREATE TABLE records (
    id INTEGER PRIMARY KEY, entry INTEGER NOT NULL REFERENCES entries (id) ON DELETE CASCADE,
    run INTEGER NOT NULL REFERENCES runs (id), status TEXT NOT NULL, record TEXT NOT NULL, added TEXT NOT NULL
);
CREATE INDEX records_of ON records (entry);
CREATE UNIQUE INDEX once ON records (entry, run) WHERE status <> 'infrastructure';

CREATE TABLE decisions (
    id INTEGER PRIMARY KEY, entry INTEGER REFERENCES entries (id) ON DELETE CASCADE, student TEXT NOT NULL,
    lab TEXT NOT NULL, task TEXT NOT NULL, kind TEXT NOT NULL, points REAL, who TEXT NOT NULL, reason TEXT NOT NULL,
    added TEXT NOT NULL
);

CREATE INDEX decisions_of ON decisions (entry);

CREATE TABLE settings (name TEXT PRIMARY KEY, value TEXT NOT NULL);

-- Every submission as it stands now: whose it is, by the last that a person said; the record that counts; and the
-- number of the attempt over all downloads, by the time received, then the number in the file's name, then the order of
-- arrival. Files of one download that neither time nor name tells apart are tied, until a person gives one of them to
-- the student: that is the later one.
CREATE VIEW attempts AS
WITH told AS (
    SELECT id,
        (SELECT max(id) FROM decisions WHERE entry = entries.id AND kind = 'assign') AS assigned,
        {NEWEST.format("entries.id")} AS record
    FROM entries
), owned AS (
    SELECT e.*, coalesce(d.student, e.student) AS owner, coalesce(nullif(d.student, ''), nullif(e.student, ''),
        '?' || e.id) AS person, coalesce(nullif(e.received, ''), e.added) AS time, t.assigned, t.record, r.run,
        coalesce(r.status, '') AS status
    FROM entries e JOIN told t USING (id) LEFT JOIN decisions d ON d.id = t.assigned
        LEFT JOIN records r ON r.id = t.record
)
SELECT id, owner AS student, named, lab, sha256, path, received, late, suffix, layout, trouble, code, record, run,
    status, row_number() OVER (PARTITION BY person, lab ORDER BY time, suffix, download, assigned, id) AS attempt,
    min(sha256) OVER same <> max(sha256) OVER same AND max(assigned) OVER same IS NULL AS tied
FROM owned
WINDOW same AS (PARTITION BY person, lab, time, suffix, download);

CREATE TRIGGER records_stay BEFORE UPDATE ON records BEGIN SELECT RAISE(ABORT, 'records are never changed'); END;
CREATE TRIGGER decisions_stay BEFORE UPDATE ON decisions BEGIN SELECT RAISE(ABORT, 'decisions are never changed'); END;
CREATE TRIGGER records_kept BEFORE DELETE ON records WHEN (SELECT forgetting FROM about) = 0
    BEGIN SELECT RAISE(ABORT, 'records are never deleted'); END;
CREATE TRIGGER decisions_kept BEFORE DELETE ON decisions WHEN (SELECT forgetting FROM about) = 0
    BEGIN SELECT RAISE(ABORT, 'decisions are never deleted'); END;
"""
