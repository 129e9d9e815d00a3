"""`data` as a cell uses it: names, cards, what a dataset lacks, and the catalogue behind it."""

import re
from dataclasses import fields

import pytest
from data_helpers import needs_mirror, remote

from course_lib.notebook import _catalog, _places, _real, data
from course_lib.notebook._errors import DataMissing, NotHere, Refusal
from course_lib.notebook._folder import from_folder
from course_lib.simulate.recipes.recipe import recipe

SYNTHETIC = [name for name in data.names() if _catalog.entry(name).kind == "synthetic"]
REAL = [name for name in data.names() if _catalog.entry(name).kind == "real"]


@pytest.fixture
def nothing_here(tmp_path, monkeypatch):
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)


def test_the_catalogue_holds_what_lies_in_its_folder_synthetic_first():
    assert {"living_room", "desk_outliers"} <= set(SYNTHETIC) and {"stanford_bunny", "lidar_pair"} <= set(REAL)
    assert data.names() == sorted(SYNTHETIC) + sorted(REAL)
    assert set(data.names()) == {path.stem for path in _places.DATASETS.glob("*.toml")}


@pytest.mark.parametrize("name", SYNTHETIC)
def test_synthetic_entries_fit_their_recipes(name):
    entry = _catalog.entry(name)
    found = recipe(entry.recipe)
    assert (found.version, found.seed) == (entry.version, entry.seed)


@pytest.mark.parametrize("name", REAL)
def test_real_entries_are_complete(name):
    entry = _catalog.entry(name)
    assert entry.reader in _real.READERS and entry.licence and entry.credit and entry.units == "metres"
    assert len({one.name for one in entry.files}) == len({one.path for one in entry.files}) == len(entry.files)
    for one in entry.files:
        assert re.fullmatch(r"https://raw\.githubusercontent\.com/[^/]+/[^/]+/[0-9a-f]{40}/\S+", one.url)
        assert re.fullmatch(r"[0-9a-f]{64}", one.sha256) and one.size > 0
    if entry.camera:
        assert entry.camera_source and ("preset" not in entry.camera or entry.camera_source.startswith("assumed"))


@pytest.mark.parametrize("name", SYNTHETIC + REAL)
def test_every_dataset_has_a_card(name):
    card = data.describe(name)
    for part in ("What it is.", "Good for.", "Watch out.", "Units and encoding.", "Licence"):
        assert f"**{part}" in card, part
    assert "**How it was captured.**" in card or "**How it is made.**" in card
    entry = _catalog.entry(name)
    if entry.camera_source.startswith("assumed"):
        assert "intrinsics are **assumed**" in re.sub(r"\s+", " ", card)
    if entry.citation:
        assert entry.citation.rstrip(".") in re.sub(r"\s+", " ", card)
    assert repr(card) == str(card) == card._repr_markdown_()
    assert f"[{name}]({name}.md)" in (_places.DATASETS / "README.md").read_text(encoding="utf-8")


def test_a_missing_card_is_one_sentence(monkeypatch, tmp_path):
    (tmp_path / "tum_pair.toml").write_bytes((_places.DATASETS / "tum_pair.toml").read_bytes())
    monkeypatch.setattr(_places, "DATASETS", tmp_path)
    with pytest.raises(Refusal, match=r"The card datasets/tum_pair.md is missing .* git checkout\."):
        data.describe("tum_pair")


@pytest.mark.parametrize(
    ("typo", "says"),
    [
        ("livingroom", "There is no dataset 'livingroom'. Did you mean living_room?"),
        ("Living Room", "There is no dataset 'Living Room'. Did you mean living_room?"),
        ("stanford-bunny", "There is no dataset 'stanford-bunny'. Did you mean stanford_bunny?"),
        ("xyz", "There is no dataset 'xyz'. Known: bunny_like, desk_outliers"),
    ],
)
@pytest.mark.parametrize("call", [data.load, data.available, data.describe, data.prepare])
def test_a_typo_suggests_the_nearest(call, typo, says):
    with pytest.raises(Refusal) as caught:
        call(typo)
    assert str(caught.value).startswith(says)


def test_a_name_that_is_no_text():
    with pytest.raises(Refusal, match="A dataset's name is a text such as 'living_room', and this is a int"):
        data.load(3)


def test_real_data_that_are_not_here(nothing_here):
    assert not data.available("tum_pair")
    with pytest.raises(DataMissing) as caught:
        data.load("tum_pair")
    assert str(caught.value) == (
        "The dataset tum_pair is real data and it is not on this machine: run `python3 course.py data get tum_pair`."
    )


def test_synthetic_data_are_always_available(nothing_here):
    assert all(data.available(name) for name in SYNTHETIC)


def test_real_data_that_are_here_in_part(nothing_here, tmp_path):
    entry = _catalog.entry("tum_pair")
    path = tmp_path / "cache" / "real" / entry.files[0].path
    path.parent.mkdir(parents=True)
    path.write_bytes(b"x")
    assert not data.available("tum_pair")
    with pytest.raises(DataMissing, match="1 of its 2 files are not on this machine"):
        data.load("tum_pair")


def test_a_real_dataset_has_no_seed(nothing_here):
    with pytest.raises(Refusal, match="tum_pair was captured, so it has no seed: leave seed out"):
        data.load("tum_pair", seed=1)


def test_a_mirror_that_is_not_there(nothing_here, monkeypatch, tmp_path):
    monkeypatch.setenv("COURSE_DATA_MIRROR", str(tmp_path / "stick"))
    with pytest.raises(Refusal, match="COURSE_DATA_MIRROR names .*stick, which is no folder: plug it in, or unset"):
        data.load("tum_pair")


def test_preparing_makes_synthetic_data_only(nothing_here, monkeypatch):
    made = []
    monkeypatch.setattr(data._cache, "make", lambda entry: made.append(entry.name))
    data.prepare(["living_room", "tum_pair", "bunny_like"])
    data.prepare("desk_pair")
    assert made == ["living_room", "bunny_like", "desk_pair"]


def test_a_recipe_of_another_version_is_refused():
    entry = _catalog.Entry("living_room", "synthetic", "", "", "", "metres", recipe="living_room", version=99)
    with pytest.raises(Refusal, match="wants version 99 of recipe 'living_room' and the library has version"):
        data._cache.recipe_of(entry)
    entry = _catalog.Entry("x", "synthetic", "", "", "", "metres", recipe="no_such", version=1)
    with pytest.raises(Refusal, match="wants version 1 of recipe 'no_such' and there is none: update"):
        data._cache.recipe_of(entry)


GOOD = {"kind": "real", "title": "", "licence": "", "credit": "", "units": "metres"}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ("", "needs either files or a recipe"),
        ("colour = 3", "cannot be read"),
        ("= 3", "cannot be read"),
        ('files = [{ name = "a", path = "../a", url = "u", sha256 = "%s", size = 1 }]' % ("0" * 64), "unsafe file"),
        ('files = [{ name = "a", path = "/a", url = "u", sha256 = "%s", size = 1 }]' % ("0" * 64), "unsafe file"),
        ('files = [{ name = "a", path = "a", url = "u", sha256 = "0", size = 1 }]', "unsafe file"),
    ],
)
def test_a_broken_catalogue_is_one_sentence(change, says):
    lines = [f'{name} = "{value}"' for name, value in GOOD.items()]
    with pytest.raises(Refusal, match=f"The dataset 'x' .*{says}.*: mend datasets/x.toml."):
        _catalog.parse("x", "\n".join([*lines, change]))


def test_a_lost_catalogue(monkeypatch, tmp_path):
    monkeypatch.setattr(_places, "DATASETS", tmp_path)
    with pytest.raises(Refusal, match="datasets/ holds no entry in this copy of the course"):
        data.names()


@needs_mirror
def test_what_a_dataset_lacks_is_said_in_one_sentence():
    bunny, pair = data.load("stanford_bunny"), data.load("tum_pair")
    with pytest.raises(NotHere, match="The dataset stanford_bunny has no frames; it has clouds, meshes, reference"):
        _ = bunny.frames
    with pytest.raises(NotHere, match="The dataset tum_pair was captured, so its truth is unknown"):
        _ = pair.truth
    with pytest.raises(NotHere, match="The dataset tum_pair has no poses; it has frames, encoding, camera"):
        _ = pair.poses
    for name in ("poses", "cloud", "clouds", "mesh", "truth", "reference", "parts"):
        assert not hasattr(pair, name)
    assert hasattr(pair, "camera") and hasattr(bunny, "reference")
    assert issubclass(NotHere, ValueError)


@needs_mirror
def test_wrong_items_are_one_sentence():
    bunny, planes = data.load("stanford_bunny"), data.load("realsense_planes")
    with pytest.raises(KeyError, match="stanford_bunny has no 'bun_ziper'. Did you mean bun_zipper?"):
        bunny.clouds["bun_ziper"]
    with pytest.raises(IndexError, match="There are 11 frames, numbered from 0: 11 is not one of them"):
        planes.frames[11]
    with pytest.raises(IndexError, match="realsense_planes has 11 frames, numbered from 0: 99"):
        planes.raw(99)
    with pytest.raises(Refusal, match="by a whole number or a slice, not by 'first'"):
        planes.frames["first"]
    assert [frame.name[-6:] for frame in planes.frames[:2]] == ["000000", "000001"]
    assert planes.frames[-1].name.endswith("test_img")


@needs_mirror
def test_the_text_of_a_dataset():
    text = repr(data.load("realsense_slam"))
    assert text.startswith("realsense_slam: Ten consecutive RealSense frames")
    for word in ("real (recorded by others)", "10 frames", "1000 units a metre", "assumed", "MIT", "aims-slam"):
        assert word in text, word
    assert "poses" not in text and "/" not in text  # no path of this machine


def test_a_refusal_shows_without_a_traceback():
    try:
        data.load("livingroom")
    except Refusal as refusal:
        shown = refusal._render_traceback_()
    assert shown == ["Refusal: There is no dataset 'livingroom'. Did you mean living_room?"]


def test_every_field_of_an_entry_is_explained():
    text = _catalog.Entry.__doc__ + _catalog.RemoteFile.__doc__
    assert all(one.name in text for one in [*fields(_catalog.Entry), *fields(_catalog.RemoteFile)])


def test_a_file_of_the_catalogue_is_plain():
    assert remote(b"x", "u").size == 1 and from_folder is data.from_folder
