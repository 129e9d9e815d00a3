"""From downloads to submissions: layouts, names, attempts, and files that mean harm."""

from __future__ import annotations

import hashlib
import io
import os
import stat
import zipfile
from pathlib import Path

import pytest
from grading_helpers import submission

from course_lib.authoring.tree import CourseError
from course_lib.grading.intake.intake import IntakeLimits, Submission, original, read_class
from course_lib.grading.intake.roster import COLUMNS, Person, Roster, kept_of, read_roster

DATA = submission("00", solved=True)
NAME = "00_start_here.ipynb"
ROSTER = Roster(
    (
        Person("12345", "Jane Doe"),
        Person("12346", "José Pérez"),
        Person("12347", "Doe, John"),
        Person("12348", "Kim, Min"),
        Person("12349", "Min Kim"),
    )
)


def read(
    folder: Path, roster: Roster | None = None, lab: str | None = None, **limits: int
) -> tuple[list[Submission], list[str]]:
    store = folder.parent / "store"
    return read_class(folder, lab=lab, roster=roster, limits=IntakeLimits(**limits), store=store)


def taken(folder: Path, roster: Roster | None = None, lab: str | None = None, **limits: int) -> list[Submission]:
    return read(folder, roster, lab, **limits)[0]


def put(folder: Path, name: str, data: bytes = DATA) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return path


def zipped(files: dict[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return out.getvalue()


@pytest.mark.parametrize(
    ("name", "student", "layout", "late"),
    [
        (f"12345/{NAME}", "12345", "folders", False),
        (f"Jane Doe/{NAME}", "12345", "folders", False),
        (f"doe, JANE/work/{NAME}", "12345", "folders", False),
        (f"Jane Doe_12345_assignsubmission_file_/{NAME}", "12345", "moodle", False),
        (f"Somebody Else_12346_assignsubmission_file_/{NAME}", "12346", "moodle", False),
        (f"Jane Doe_12345_assignsubmission_file_{NAME}", "12345", "moodle", False),
        (f"doejane_12345_67890_{NAME}", "12345", "canvas", False),
        (f"doejane_LATE_12345_67890_{NAME}", "12345", "canvas", True),
        (f"perezjose_99999_67890_{NAME}", "", "canvas", False),  # an id was given, and is nobody's
        (f"Jane Doe_99999_assignsubmission_file_/{NAME}", "", "moodle", False),
        (f"Jane Doe_12346_assignsubmission_file_/{NAME}", "", "moodle", False),  # one's name, another's id
        (f"12345_{NAME}", "12345", "loose", False),
        ("12345.ipynb", "12345", "loose", False),
        (f"jose perez {NAME}", "12346", "loose", False),
        (f"nobody_{NAME}", "", "loose", False),
        (f"Min Kim/{NAME}", "", "folders", False),  # two people have this name
    ],
)
def test_layouts_and_people(tmp_path, name, student, layout, late):
    put(tmp_path / "class", name)
    [one] = taken(tmp_path / "class", ROSTER)
    assert (one.student, one.lab, one.layout, one.late, one.trouble) == (student, "00", layout, late, "")
    assert one.sha256 == hashlib.sha256(DATA).hexdigest() and original(tmp_path / "store", one.sha256) == DATA


def test_without_a_roster_names_are_ids(tmp_path):
    for name in (f"ann/{NAME}", f"Zoë, O'Neil 🙂/{NAME}", f"مها/{NAME}"):
        put(tmp_path / "class", name)
    assert {one.student for one in taken(tmp_path / "class")} == {"ann", "Zoë, O'Neil 🙂", "مها"}


def test_names_that_are_no_utf8(tmp_path):
    folder = os.fsencode(tmp_path / "class") + b"/na\xefve"
    os.makedirs(folder)
    with open(folder + b"/00_start_here.ipynb", "wb") as file:
        file.write(DATA)
    [one] = taken(tmp_path / "class")
    assert one.student == "na\\xefve" and one.path.encode("utf-8")


def test_submissions_are_ordered_by_time_and_then_suffix(tmp_path):
    for suffix, second in (("-2", 2), ("", 1), ("-1", 2)):
        path = put(tmp_path / "class", f"doejane_12345_6789{second}_00_start_here{suffix}.ipynb", DATA + b" " * second)
        os.utime(path, (second, second))
    found = taken(tmp_path / "class", ROSTER)
    assert [one.suffix for one in found] == [0, 1, 2]
    assert [one.path[-9:] for one in found] == ["ere.ipynb", "e-1.ipynb", "e-2.ipynb"]


def test_the_lab_is_found_by_name_by_cells_or_told(tmp_path):
    put(tmp_path / "class", "ann/my lab.ipynb", submission("03"))
    put(tmp_path / "class", "bob/02_point_clouds-1.ipynb")
    put(tmp_path / "class", "cem/empty.ipynb", b'{"cells": [{"cell_type": "code", "source": "1"}]}')
    assert {one.student: one.lab for one in taken(tmp_path / "class")} == {"ann": "03", "bob": "02", "cem": ""}
    assert {one.lab for one in taken(tmp_path / "class", lab="01")} == {"01"}


def test_rubbish_is_passed_over_and_other_files_are_told_once(tmp_path):
    for name in (
        f"ann/{NAME}",
        "ann/notes.txt",
        f"ann/.ipynb_checkpoints/{NAME}",
        f"__MACOSX/ann/._{NAME}",
        ".DS_Store",
    ):
        put(tmp_path / "class", name)
    for name in ("bob/lab.py", "bob/lab.pdf"):
        put(tmp_path / "class", name, b"x")
    found = {one.student: one for one in taken(tmp_path / "class")}
    assert set(found) == {"ann", "bob"}
    assert found["ann"].code == "" and found["bob"].code == "not a notebook"


THREE = "03_depth_to_points"
FILES = {
    "two labs": ({NAME: DATA, f"{THREE}.ipynb": submission("03")}, {"00": "", "03": ""}, []),
    "two labs, one as a script": ({NAME: DATA, f"{THREE}.py": b"x"}, {"00": "", "03": "not a notebook"}, []),
    "a script and a notebook": ({NAME: DATA, "00_start_here.py": b"x"}, {"00": ""}, ["00_start_here.py"]),
    "a picture": ({NAME: DATA, "me.png": b"x"}, {"00": ""}, ["me.png"]),
    "only a picture": ({"me.png": b"x"}, {"": "not a notebook"}, []),
    "two scripts": ({f"{THREE}.py": b"x", f"{THREE}.txt": b"x"}, {"03": "not a notebook"}, [f"{THREE}.txt"]),
    "a large picture": ({NAME: DATA, "me.png": bytes(3_000_000)}, {"00": ""}, ["me.png"]),
    "Jupyter's copy": ({NAME: DATA, ".ipynb_checkpoints/00_start_here-checkpoint.ipynb": b"x"}, {"00": ""}, []),
    "only a copy": ({".ipynb_checkpoints/00_start_here-checkpoint.ipynb": DATA}, {"00": "checkpoint"}, []),
}


@pytest.mark.parametrize("zip_up", [False, True], ids=["folder", "zip"])
@pytest.mark.parametrize("name", FILES)
def test_every_file_of_every_lab_is_a_submission_or_named(tmp_path, name, zip_up):
    files, wanted, left = FILES[name]
    if zip_up:
        put(tmp_path / "class", "12345/my work.zip", zipped(files))
    else:
        for path, data in files.items():
            put(tmp_path / "class", f"12345/{path}", data)
    found, named = read(tmp_path / "class", ROSTER, notebook_bytes=2_000_000, archive_ratio=10**6)
    assert {one.lab: one.code for one in found} == wanted and len(found) == len(wanted)
    assert [path.removeprefix("12345/").removeprefix("my work.zip: ") for path in named] == left
    assert all(one.student == "12345" for one in found)


def test_links_pipes_and_closed_files(tmp_path):
    secret = put(tmp_path, "secret.ipynb", DATA + b" ")
    ann = tmp_path / "class" / "ann"
    ann.mkdir(parents=True)
    (ann / NAME).symlink_to(secret)
    (tmp_path / "class" / "bob").symlink_to(tmp_path)
    (tmp_path / "class" / "cem").mkdir()
    os.mkfifo(tmp_path / "class" / "cem" / NAME)
    found = {one.path.split("/")[0]: one for one in taken(tmp_path / "class")}
    assert {name: one.code for name, one in found.items()} == {"ann": "symlink", "bob": "symlink", "cem": "not a file"}
    assert all(one.sha256 == "" for one in found.values())
    assert (ann / NAME).read_bytes() == secret.read_bytes()  # the control: who follows links reads another's file


def _link() -> zipfile.ZipInfo:
    info = zipfile.ZipInfo("link.ipynb")
    info.external_attr = (stat.S_IFLNK | 0o777) << 16
    return info


def test_hostile_zips_hurt_nobody(tmp_path):
    folder = tmp_path / "class"
    put(folder, "ann/lab.zip", zipped({NAME: DATA, "readme.txt": b"hi"}))
    put(folder, "slip/lab.zip", zipped({"../../../outside.ipynb": DATA}))
    put(folder, "drive/lab.zip", zipped({"C:\\outside.ipynb": DATA}))
    put(folder, "bomb/lab.zip", zipped({NAME: bytes(15_000_000)}))
    put(folder, "many/lab.zip", zipped({f"{i}.ipynb": b"{}" for i in range(30)}))
    put(folder, "broken/lab.zip", zipped({NAME: DATA})[:-200])
    put(folder, "nested/lab.zip", zipped({"inner.zip": zipped({NAME: DATA})}))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr(_link(), "/etc/passwd")
    put(folder, "link/lab.zip", out.getvalue())
    encrypted = bytearray(zipped({NAME: DATA}))
    encrypted[6] |= 1
    encrypted[encrypted.index(b"PK\x01\x02") + 8] |= 1
    put(folder, "locked/lab.zip", bytes(encrypted))
    found = {one.student: one for one in taken(folder, archive_members=20)}
    assert {name: one.code for name, one in found.items()} == {
        "ann": "",
        "slip": "zip slip",
        "drive": "zip slip",
        "bomb": "zip bomb",
        "many": "zip bomb",
        "broken": "damaged zip",
        "nested": "not a notebook",
        "link": "symlink",
        "locked": "encrypted",
    }
    assert all(one.trouble.endswith(".") for name, one in found.items() if name != "ann")
    assert not (tmp_path / "outside.ipynb").exists() and not (tmp_path.parent / "outside.ipynb").exists()
    with zipfile.ZipFile(folder / "bomb" / "lab.zip") as archive:  # the control: it is one
        assert len(archive.read(NAME)) > 200 * (folder / "bomb" / "lab.zip").stat().st_size


def test_the_whole_download_may_be_a_zip(tmp_path):
    path = put(tmp_path, "download.zip", zipped({f"Jane Doe_12345_assignsubmission_file_/{NAME}": DATA}))
    [one] = taken(path, ROSTER)
    assert (one.student, one.layout, one.received[:4]) == ("12345", "moodle", "2026") or one.received


def test_a_folder_with_too_many_files_is_refused(tmp_path):
    for i in range(6):
        put(tmp_path / "class", f"s{i}/{NAME}")
    with pytest.raises(CourseError, match="more than 5 files"):
        taken(tmp_path / "class", files=5)


def test_a_notebook_that_is_too_big_is_told(tmp_path):
    put(tmp_path / "class", f"ann/{NAME}", b" " * 3_000_000)
    [one] = taken(tmp_path / "class", notebook_bytes=2_000_000)
    assert (one.code, one.sha256) == ("too big", "") and "2 MB" in one.trouble


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("name,group\nJane,Mo\n", "line 1: there is no column 'id'"),
        ("id,name\n1,Jane\n1,John\n", "line 3: the id '1' stands there twice"),
        ("id,name\n,Jane\n", "line 2: the id is missing"),
        ("id,name\n", "names nobody"),
    ],
)
def test_a_roster_that_is_wrong_says_where(tmp_path, text, sentence):
    path = tmp_path / "roster.csv"
    path.write_text(text)
    with pytest.raises(CourseError, match=sentence):
        read_roster(path)


def test_a_roster_as_excel_saves_it(tmp_path):
    path = tmp_path / "roster.csv"
    path.write_text('\ufeffID;Name;Group;Mail\nParticipant 12345;"Doe; Jane";Mo;x@y\n', encoding="utf-8")
    roster = read_roster(path)
    assert roster.people == (Person("12345", "Doe; Jane", "Mo"),)
    kept = kept_of(path, COLUMNS)
    assert read_roster(kept) == roster and "x@y" not in kept  # nothing else is kept
    assert read_roster(kept_of(kept, COLUMNS, without="12345")).people == ()
