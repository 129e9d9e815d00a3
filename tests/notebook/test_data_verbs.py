"""`course data list|get|verify|clear` as typed."""

import sys

import pytest
from data_helpers import needs_mirror

from course_lib import cli
from course_lib.launch import fetch
from course_lib.notebook import _cache, _catalog, data


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(fetch, "PAUSE_SECONDS", 0)
    return tmp_path / "cache"


@pytest.fixture
def run(capfd):
    """Run a verb; return exit code, stdout, stderr."""

    def call(*words):
        code = 0
        try:
            cli.main(["data", *words])
        except SystemExit as end:
            code = end.code or 0
        sys.stdout.flush()
        return code, *capfd.readouterr()

    return call


def test_help(run):
    code, out, _ = run("--help")
    assert code == 0 and all(verb in out for verb in ("list", "get", "verify", "clear"))


def test_list(cache, run, monkeypatch):
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    code, out, err = run("list")
    assert code == 0 and err == ""
    lines = {line.split()[0]: line for line in out.splitlines()}
    assert set(lines) == {"name", *data.names()}
    assert "made on first use" in lines["living_room"] and "not here" in lines["tum_pair"]
    assert f"{_catalog.entry('tum_pair').size / 1e6:.1f} MB" in lines["tum_pair"]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["get"], "Name datasets, or say --all; known: bunny_like"),
        (["get", "tum_pair", "--all"], "Name datasets, or say --all"),
        (["get", "tum_pear"], "There is no dataset 'tum_pear'. Did you mean tum_pair?"),
        (["verify", "livingroom"], "There is no dataset 'livingroom'. Did you mean living_room?"),
        (["clear", "--yes"], "Name datasets, or say --all"),
    ],
)
def test_wrong_words_are_one_sentence(cache, run, words, says):
    code, out, err = run(*words)
    assert code == 1 and out == "" and err.startswith(says) and err.count("\n") == 1 and "Traceback" not in err


@needs_mirror
def test_get_verify_damage_clear(cache, run, monkeypatch):
    code, out, err = run("get", "tum_pair")
    assert (code, err) == (0, "")
    assert out.startswith("tum_pair: 2 of 2 files fetched, 0.6 MB; licence: MIT as upstream states it")
    assert run("get", "tum_pair")[1].startswith("tum_pair: already here")
    monkeypatch.delenv("COURSE_DATA_MIRROR")
    assert data.load("tum_pair").frames[0].depth.any()
    assert run("verify", "tum_pair") == (0, "tum_pair: here\n", "")
    path = cache / "real" / _catalog.entry("tum_pair").files[0].path
    path.write_bytes(path.read_bytes()[:-1] + b"?")
    code, out, _ = run("verify")
    assert code == 1 and f"{_catalog.entry('tum_pair').files[0].path} of dataset tum_pair is damaged" in out
    assert run("clear", "tum_pair", "--yes") == (0, "0.6 MB freed\n", "")
    assert not data.available("tum_pair")


@needs_mirror
def test_the_mirror_is_named_in_the_list(cache, run):
    assert "here (mirror)" in run("list")[1]


def test_a_failure_is_one_sentence(cache, run, monkeypatch):
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    monkeypatch.setattr(fetch, "_request", refuse)
    code, out, err = run("get", "tum_pair")
    assert code == 1 and out == ""
    assert err == (
        "raw.githubusercontent.com could not be reached: check the network, or set COURSE_DATA_MIRROR to a folder that "
        "holds the files.\n"
    )


def test_one_failure_does_not_stop_the_others(cache, run, monkeypatch):
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    monkeypatch.setattr(fetch, "_request", refuse)
    monkeypatch.setattr(_cache, "make", lambda entry: None)
    code, out, err = run("get", "tum_pair", "living_room")
    assert code == 1 and out == "living_room: made\n"
    assert err.splitlines()[-1] == "1 of 2 datasets could not be got: tum_pair."


def refuse(*args):
    raise fetch.requests.ConnectionError("no network")


def test_clear_asks_first(cache, run, monkeypatch):
    monkeypatch.setattr("click.termui.visible_prompt_func", lambda prompt: "n")
    code, out, err = run("clear", "tum_pair")
    assert code == 1 and "Aborted" in err
