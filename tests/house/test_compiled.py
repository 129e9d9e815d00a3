"""Compiled loops: kept for the user, found again, made again where spoiled, and the same numbers as plain Python."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from course_lib import compiled
from course_lib.compiled import FLOATS, in_threads

ROOT = Path(compiled.__file__).parents[1]
TINY = f"""
from course_lib.compiled import compiled, inlined
STEP = 2.0

@inlined
def doubled(x):
    return STEP * x

@compiled("float64({FLOATS})")
def total(numbers):
    "The sum of the doubles."
    s = 0.0
    for number in numbers:
        s += doubled(number)
    return s
"""


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    """As in a process of its own: nothing was said, and nothing is known of numba."""
    monkeypatch.setenv("COURSE_QUIET", "0")
    known = dict(compiled.states)
    forget = (compiled._said_once.cache_clear, compiled._numba.cache_clear)
    for each in forget:
        each()
    yield
    for each in forget:
        each()
    sys.modules.pop("tiny_loops", None)
    compiled.states.clear()
    compiled.states.update(known)


def use(folder: Path, text: str = TINY) -> tuple[str, float]:
    """What became of the loop of a module, and what it gives."""
    file = folder / "tiny_loops.py"
    file.write_text(text)
    spec = importlib.util.spec_from_file_location("tiny_loops", file)
    module = importlib.util.module_from_spec(spec)
    compiled.states.clear()
    sys.modules["tiny_loops"] = module
    spec.loader.exec_module(module)
    return compiled.states["tiny_loops.total"], module.total(np.arange(4.0))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder in which another process has kept the loop, and what it said."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "cache").mkdir()
    (folder / "tiny_loops.py").write_text(TINY)
    known = {"PYTHONPATH": f"{ROOT}{os.pathsep}{folder}", "COURSE_COMPILED": str(folder / "cache"), "COURSE_QUIET": "0"}
    words = [sys.executable, "-c", "import tiny_loops"]
    done = subprocess.run(words, env={**os.environ, **known}, capture_output=True, text=True, check=True)
    return folder / "cache", done.stderr


@pytest.fixture
def cache(made, tmp_path, monkeypatch):
    """A copy of that folder, to be used here."""
    folder = shutil.copytree(made[0], tmp_path / "cache")
    monkeypatch.setenv("COURSE_COMPILED", str(folder))
    return folder


def test_the_first_use_says_once_that_it_compiles(made):
    assert made[1].count("\n") == 1 and "compiled, once on this machine" in made[1]


def test_what_another_process_kept_is_found_wherever_the_course_lies(cache, tmp_path, capsys):
    assert use(tmp_path) == ("cached", 12.0)
    assert capsys.readouterr().err == ""


def test_a_comment_compiles_nothing_again_but_a_number_does(cache, tmp_path):
    assert use(tmp_path, "# a line more\n" + TINY) == ("cached", 12.0)
    assert use(tmp_path, TINY.replace("STEP = 2.0", "STEP = 3.0")) == ("compiled", 18.0)
    assert use(tmp_path, TINY.replace("STEP * x", "STEP * x * x")) == ("compiled", 28.0)


def test_a_folder_that_can_only_be_read_is_enough(cache, tmp_path):
    before = {path.name: path.stat().st_mtime_ns for path in cache.iterdir()}
    cache.chmod(0o500)
    try:
        assert use(tmp_path) == ("cached", 12.0)
    finally:
        cache.chmod(0o700)
    assert before == {path.name: path.stat().st_mtime_ns for path in cache.iterdir()}


@pytest.mark.parametrize("spoil", [b"", b"no pickle", None], ids=["empty", "other bytes", "cut short"])
@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_what_is_spoiled_is_compiled_again(cache, tmp_path, kind, spoil):
    (file,) = cache.glob(f"*.{kind}")
    file.write_bytes(file.read_bytes()[:100] if spoil is None else spoil)
    assert use(tmp_path) == ("compiled", 12.0)
    assert use(tmp_path) == ("cached", 12.0)


def test_without_any_folder_it_is_compiled_and_one_sentence_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(compiled, "folder", lambda: None)
    assert use(tmp_path) == ("compiled", 12.0)
    said = capsys.readouterr().err
    assert said.count("No folder for compiled loops can be written: they are compiled again in every session.") == 1


def test_a_folder_that_is_not_there_is_no_traceback(tmp_path, monkeypatch):
    monkeypatch.setenv("COURSE_COMPILED", "/proc/no/such/place")
    assert use(tmp_path) == ("compiled", 12.0)


def test_without_numba_loops_are_plain_python_and_one_sentence_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "numba", None)
    assert use(tmp_path) == ("plain", 12.0) == use(tmp_path)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "numba cannot be imported" in said and "doctor" in said
    compiled._numba.cache_clear()
    monkeypatch.setenv("COURSE_UNCOMPILED", "1")
    assert use(tmp_path) == ("plain", 12.0)
    assert capsys.readouterr().err == ""


def test_the_folder_is_the_users_own(tmp_path, monkeypatch):
    monkeypatch.delenv("COURSE_COMPILED", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(compiled.tempfile, "tempdir", str(tmp_path))
    if sys.platform == "linux":
        assert compiled.folder() == tmp_path / "home" / "course-3d-reconstruction" / "compiled"
        assert compiled.folder().stat().st_mode & 0o077 == 0, "others could put machine code there"
    monkeypatch.setattr(compiled.tempfile, "TemporaryFile", lambda dir: (_ for _ in ()).throw(OSError("read-only")))
    assert compiled.folder() is None


def test_a_folder_of_somebody_else_is_not_trusted(tmp_path, monkeypatch):
    monkeypatch.delenv("COURSE_COMPILED", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    monkeypatch.setattr(compiled.tempfile, "tempdir", str(tmp_path))
    if hasattr(os, "getuid"):
        monkeypatch.setattr(compiled.os, "getuid", lambda: 12345)
        assert compiled.folder() is None


SAMPLE = """
import json, sys
import numpy as np
from course_lib import compiled
from course_lib.cloud import clusters, downsample, neighbours, normals
from course_lib.notebook.lzf_loops import unpack
from course_lib.registration import icp, pair_sums
downsample.MANY = neighbours.SMALL = clusters.SMALL = pair_sums.MANY = 100
rng = np.random.default_rng(5)
points = rng.uniform(0, [2, 1, 0.1], (700, 3))
near = neighbours.Neighbours(points)
six, count = near.covariances(8, 0.2)
distance, index = near.nearest(rng.uniform(0, [2, 1, 0.1], (300, 3)), radius=0.5)
source = points + [0.02, 0.01, 0.0]
given = normals.estimate_normals(points, 8)
registered = [icp.icp(source, points, 0.2, n, steps=4).T_target_source for n in (None, given)]
answers = [near.mean_distances(6), six, count, near.crowded(0.1, 4), distance, index, given, *registered,
           downsample.voxel_downsample(points, 0.1), clusters.euclidean_clusters(points, 0.06)]
block = np.zeros(5, np.uint8)
answers += [unpack(np.array([1, 65, 66, 0x20, 1], np.uint8), block), block]
np.savez(sys.argv[1], *answers)
print(json.dumps(compiled.states))
"""


@pytest.mark.slow
def test_compiled_and_plain_loops_give_the_same_numbers(tmp_path):
    answers, states = [], []
    for name, environment in (("compiled", {}), ("plain", {"COURSE_UNCOMPILED": "1"})):
        file = tmp_path / f"{name}.npz"
        known = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
        done = subprocess.run(
            [sys.executable, "-c", SAMPLE, str(file)], env=known, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        states.append(json.loads(done.stdout))
        answers.append(list(np.load(file).values()))
    assert set(states[1].values()) == {"plain"} and "plain" not in states[0].values()
    modules = {path.stem for path in (ROOT / "course_lib").rglob("*_loops.py")}
    assert {name.split(".")[0] for name in states[1]} == modules, "the sample calls loops of every module"
    for one, other in zip(*answers, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_every_module_of_loops_is_found():
    """`fill` imports what is named so; nothing else marks a function."""
    marked = {
        path.name
        for path in (ROOT / "course_lib").rglob("*.py")
        if any(line.startswith(("@compiled", "@inlined")) for line in path.read_text(encoding="utf-8").splitlines())
    }
    assert marked and all(name.endswith("_loops.py") for name in marked)


@pytest.mark.parametrize(("count", "least"), [(0, 1), (1, 1), (7, 3), (100, 1), (100, 1000), (1000, 10)])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_parts_cover_everything_once(monkeypatch, count, least, threads):
    monkeypatch.setattr(compiled, "threads", lambda: threads)
    done = np.zeros(count, dtype=int)

    def job(start: int, stop: int) -> None:
        assert stop - start >= min(least, count)
        done[start:stop] += 1

    in_threads(job, count, least)
    assert (done == 1).all()


def test_what_fails_in_a_part_is_raised(monkeypatch):
    monkeypatch.setattr(compiled, "threads", lambda: 2)

    def job(start: int, stop: int) -> None:
        if start <= 50 < stop:
            raise ValueError("part of 50")

    with pytest.raises(ValueError, match="part of 50"):
        in_threads(job, 100)


def _sum_in_threads(sent):
    total = np.zeros(100)
    in_threads(lambda start, stop: total.__setitem__(slice(start, stop), 1.0), 100)
    sent.put(float(total.sum()))


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork here")
def test_threads_work_after_a_fork(monkeypatch):
    monkeypatch.setattr(compiled, "threads", lambda: 2)
    in_threads(lambda start, stop: None, 100)
    context = multiprocessing.get_context("fork")
    sent = context.SimpleQueue()
    child = context.Process(target=_sum_in_threads, args=(sent,))
    child.start()
    child.join(30)
    with contextlib.suppress(ProcessLookupError):
        child.kill()
    assert child.exitcode == 0 and sent.get() == 100
