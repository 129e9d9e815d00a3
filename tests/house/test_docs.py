"""The glossary is sorted and every link into it lands; the page of conventions says what the code does."""

from __future__ import annotations

import re
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest

from course_lib.camera import pinhole, rgbd

ROOT = Path(__file__).parents[2]
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
CONVENTIONS = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
ANCHORS = re.findall(r'<a id="([^"]+)"></a>', GLOSSARY)
ENTRIES = re.findall(r'^((?:<a id="[^"]+"></a>)+)\*\*([^*]+)\*\* — (.+) \*\(lesson (.+)\)\*$', GLOSSARY, flags=re.M)
PAGES = [
    *(ROOT / "docs").glob("*.md"),
    *(ROOT / "notebooks" / "source").glob("*.py"),
    *(ROOT / "solutions" / "source").glob("*.py"),
    ROOT / "README.md",
]


def test_the_glossary_is_alphabetical_and_every_entry_is_whole():
    words = [word for _, word, _, _ in ENTRIES]
    assert len(words) == GLOSSARY.count("** — ") >= 60
    assert words == sorted(words, key=str.lower)
    assert len(ANCHORS) == len(set(ANCHORS))
    for anchors, word, meaning, lesson in ENTRIES:
        assert f'"{re.sub("[^a-z0-9]+", "-", word.lower()).strip("-")}"' in anchors
        assert meaning.endswith((".", ".)")) and len(meaning) < 260, word
        assert re.search(r"\d\d", lesson), word


@pytest.mark.parametrize("page", [page for page in PAGES if page.is_file()], ids=lambda page: page.name)
def test_links_into_the_glossary_land(page):
    text = page.read_text(encoding="utf-8")
    wanted = re.findall(r"glossary\.md#([\w-]+)", text)
    if page.name == "glossary.md":
        wanted += re.findall(r"\]\(#([\w-]+)\)", text)
    assert set(wanted) <= set(ANCHORS), page.name


def test_words_of_the_first_lessons_are_there():
    needed = """
        depth-image no-data registered pinhole principal-point focal-length intrinsics extrinsics
        deprojection organised-cloud point-step fitness rmse icp voxel normal mesh flying-pixel
        baseline disparity half-pixel trajectory pose range encoding attribute padding point-type
        pointcloud2 field-of-view truth frame ply
    """
    assert set(needed.split()) <= set(ANCHORS)


def test_conventions_give_the_encodings_of_the_library():
    for name, units in (("TUM", 5000), ("SUN", 1000), ("Redwood", 1000), ("RealSense", 1000)):
        row = next(line for line in CONVENTIONS.splitlines() if line.startswith(f"| {name}"))
        assert f"/ {units}" in row and rgbd.ENCODINGS[name.lower()].units_per_metre == units
    first = rgbd.decode_depth(np.array([[1092, 1093]], np.uint16).byteswap(), "nyu")[0]
    assert first[0] > 0 and first[1] == 0 and "from 1093 up" in CONVENTIONS


def test_conventions_fit_one_page():
    assert len(CONVENTIONS.splitlines()) <= 80


def test_conventions_give_the_ideal_principal_point():
    camera = pinhole.camera_from_fov(1.0, 640, 480, axis="horizontal")
    assert "cx = (W − 1)/2" in CONVENTIONS and camera.cx == (640 - 1) / 2


def test_every_dependency_says_where_it_is_used_and_is_used_there():
    imported: dict[str, set[str]] = {}
    for module, distributions in packages_distributions().items():
        for name in distributions:
            imported.setdefault(name.lower(), set()).add(module)
    lines = re.findall(
        r'^ {4}"([\w-]+)[^"]*", *# (.+)$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), flags=re.M
    )
    assert len(lines) >= 35
    for name, said in lines:
        for file in re.findall(r"[\w/]+\.py\b", said):
            text = (ROOT / file).read_text(encoding="utf-8") if "/" in file else name
            words = imported.get(name, set()) | {name.replace("-", "_"), name}
            assert any(re.search(rf"\b{word}\b", text) for word in words), f"{file} does not use {name}"
