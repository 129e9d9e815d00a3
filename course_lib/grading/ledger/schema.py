"""The tables of the ledger. Records and decisions are only ever added; a student is only ever forgotten as a whole."""

VERSION = 1

SCHEMA = """
CREATE TABLE about (version INTEGER NOT NULL, forgetting INTEGER NOT NULL DEFAULT 0);
INSERT INTO about (version) VALUES (1);

CREATE TABLE runs (
    id INTEGER PRIMARY KEY, lab TEXT NOT NULL, lab_version TEXT NOT NULL, environment TEXT NOT NULL,
    grader TEXT NOT NULL, seed INTEGER NOT NULL, per_student INTEGER NOT NULL, isolation TEXT NOT NULL,
    started TEXT NOT NULL
);

CREATE TABLE entries (
    id INTEGER PRIMARY KEY, student TEXT NOT NULL, named TEXT NOT NULL, lab TEXT NOT NULL, sha256 TEXT NOT NULL,
    path TEXT NOT NULL, received TEXT NOT NULL, late INTEGER NOT NULL, attempt INTEGER NOT NULL, layout TEXT NOT NULL,
    trouble TEXT NOT NULL, code TEXT NOT NULL, added TEXT NOT NULL,
    UNIQUE (lab, sha256, path)
);

CREATE TABLE records (
    id INTEGER PRIMARY KEY, entry INTEGER NOT NULL REFERENCES entries (id) ON DELETE CASCADE,
    lab_version TEXT NOT NULL, environment TEXT NOT NULL, grader TEXT NOT NULL, seed INTEGER NOT NULL,
    status TEXT NOT NULL, points REAL NOT NULL, record TEXT NOT NULL, added TEXT NOT NULL
);
CREATE UNIQUE INDEX once ON records (entry, lab_version, environment, grader, seed) WHERE status <> 'infrastructure';

CREATE TABLE decisions (
    id INTEGER PRIMARY KEY, student TEXT NOT NULL, lab TEXT NOT NULL, task TEXT NOT NULL, kind TEXT NOT NULL,
    points REAL, who TEXT NOT NULL, reason TEXT NOT NULL, added TEXT NOT NULL
);

CREATE TABLE settings (name TEXT PRIMARY KEY, value TEXT NOT NULL);

CREATE TRIGGER records_stay BEFORE UPDATE ON records BEGIN SELECT RAISE(ABORT, 'records are never changed'); END;
CREATE TRIGGER decisions_stay BEFORE UPDATE ON decisions BEGIN SELECT RAISE(ABORT, 'decisions are never changed'); END;
CREATE TRIGGER records_kept BEFORE DELETE ON records WHEN (SELECT forgetting FROM about) = 0
    BEGIN SELECT RAISE(ABORT, 'records are never deleted'); END;
CREATE TRIGGER decisions_kept BEFORE DELETE ON decisions WHEN (SELECT forgetting FROM about) = 0
    BEGIN SELECT RAISE(ABORT, 'decisions are never deleted'); END;
"""
