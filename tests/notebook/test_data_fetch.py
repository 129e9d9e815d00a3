"""Fetching: from the mirror first, else over the network, resumed and proved. The only network is 127.0.0.1."""

import errno
import os
import shutil
import threading
from pathlib import Path

import pytest
from data_helpers import real_entry, remote, serving

from course_lib.launch import fetch
from course_lib.notebook import _catalog, _real
from course_lib.notebook._errors import CannotWrite, DataMissing

CONTENT = bytes(range(256)) * 2000
NOWHERE = "http://127.0.0.1:9/file.bin"


@pytest.fixture(autouse=True)
def alone(tmp_path, monkeypatch):
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.delenv("COURSE_DATA_MIRROR", raising=False)
    monkeypatch.setattr(fetch, "PAUSE_SECONDS", 0)


@pytest.fixture
def target(tmp_path):
    return tmp_path / "cache" / "real" / "folder" / "file.bin"


def get(entry):
    """Fetch, and return the number of files brought, what was said, and the bytes that were counted."""
    said, steps = [], []
    brought = fetch.fetch(entry, say=said.append, step=steps.append)
    return brought, said, sum(steps)


def names(target: Path) -> list[str]:
    return sorted(path.name for path in target.parent.iterdir())


def test_fetching_once_and_again(target):
    with serving(CONTENT) as (server, url):
        entry = real_entry(remote(CONTENT, url))
        assert get(entry) == (1, [], len(CONTENT))
        assert target.read_bytes() == CONTENT and names(target) == ["file.bin"]
        assert get(entry) == (0, [], 0)
        assert server.requests == [None]


def test_what_had_come_is_not_fetched_again(target):
    target.parent.mkdir(parents=True)
    target.with_name(".file.bin.part").write_bytes(CONTENT[:100_000])
    with serving(CONTENT) as (server, url):
        brought, _, counted = get(real_entry(remote(CONTENT, url)))
        assert server.requests == ["bytes=100000-"]
    assert target.read_bytes() == CONTENT and brought == 1 and counted == len(CONTENT) and names(target) == ["file.bin"]


def test_an_answer_that_ends_early_is_taken_up_where_it_stopped(target):
    with serving(CONTENT, {"cut": 200_000}, {"cut": 100_000}) as (server, url):
        get(real_entry(remote(CONTENT, url)))
        asked = [0 if request is None else int(request[6:-1]) for request in server.requests]
    assert target.read_bytes() == CONTENT
    assert len(asked) == 3 and asked[0] == 0 and 0 < asked[1] <= 200_000 and asked[1] < asked[2] <= 300_000


def test_a_server_without_ranges_starts_anew(target):
    target.parent.mkdir(parents=True)
    target.with_name(".file.bin.part").write_bytes(b"x" * 100_000)
    with serving(CONTENT, {"ranges": False}) as (_, url):
        _, _, counted = get(real_entry(remote(CONTENT, url)))
    assert target.read_bytes() == CONTENT and counted == len(CONTENT)


def test_a_spoiled_part_is_thrown_away(target):
    target.parent.mkdir(parents=True)
    target.with_name(".file.bin.part").write_bytes(b"x" * 1000)
    with serving(CONTENT) as (_, url):
        entry = real_entry(remote(CONTENT, url))
        with pytest.raises(fetch.FetchFailed, match="gave other bytes than the catalogue names"):
            get(entry)
        assert names(target) == []
        get(entry)
    assert target.read_bytes() == CONTENT


def test_an_interrupted_fetch_can_go_on_later(target):
    with serving(CONTENT, *[{"cut": 100_000}] * fetch.TRIES) as (server, url):
        entry = real_entry(remote(CONTENT, url))
        with pytest.raises(fetch.FetchFailed, match="127.0.0.1:.* could not be reached|ended early"):
            get(entry)
        assert names(target) == [".file.bin.part"] and not _real.missing(entry) == []
        get(entry)
        assert server.requests[-1] not in (None, "bytes=0-")
    assert target.read_bytes() == CONTENT and names(target) == ["file.bin"]


def test_ctrl_c_while_fetching_leaves_only_what_can_go_on(target, monkeypatch):
    def interrupt(n_bytes):
        if n_bytes:
            raise KeyboardInterrupt

    with serving(CONTENT) as (_, url):
        entry = real_entry(remote(CONTENT, url))
        with pytest.raises(KeyboardInterrupt):
            fetch.fetch(entry, say=print, step=interrupt)
        assert names(target) == [".file.bin.part"]
        with pytest.raises(DataMissing):
            _real.load(entry)
        get(entry)
    assert target.read_bytes() == CONTENT


def test_other_bytes_are_refused(target):
    with serving(b"?" * len(CONTENT)) as (_, url):
        with pytest.raises(fetch.FetchFailed) as caught:
            get(real_entry(remote(CONTENT, url)))
    assert str(caught.value) == (
        f"{url} gave other bytes than the catalogue names (its sha256 differs), so they were thrown away: try again, "
        "and tell the course's authors if it happens twice."
    )
    assert names(target) == []


def test_more_bytes_than_promised_are_refused(target):
    with serving(CONTENT + b"more") as (_, url):
        with pytest.raises(fetch.FetchFailed, match="gives more than the 512,000 bytes of the catalogue: it was"):
            get(real_entry(remote(CONTENT, url)))
    assert names(target) == []


def test_a_lost_address(target):
    with serving(CONTENT, {"status": 404}) as (server, url):
        with pytest.raises(fetch.FetchFailed, match=f"{url} answered with 404: try later, or check the network"):
            get(real_entry(remote(CONTENT, url)))
        assert len(server.requests) == 1


def test_a_busy_server_is_asked_again(target):
    with serving(CONTENT, {"status": 503}, {"status": 429}) as (server, url):
        get(real_entry(remote(CONTENT, url)))
        assert len(server.requests) == 3
    assert target.read_bytes() == CONTENT


def test_no_network(target):
    with pytest.raises(fetch.FetchFailed) as caught:
        get(real_entry(remote(CONTENT, NOWHERE)))
    assert str(caught.value) == (
        "127.0.0.1:9 could not be reached: check the network, or set COURSE_DATA_MIRROR to a folder that holds the "
        "files."
    )


def test_a_damaged_file_is_named_and_fetched_again(target):
    target.parent.mkdir(parents=True)
    target.write_bytes(CONTENT[:-1] + b"?")
    with serving(CONTENT) as (_, url):
        brought, said, _ = get(real_entry(remote(CONTENT, url)))
    assert brought == 1 and target.read_bytes() == CONTENT
    assert said == [
        "folder/file.bin of tiny_real is damaged (its content is not the catalogue's), so it is fetched again."
    ]


@pytest.fixture
def mirror(tmp_path, monkeypatch):
    path = tmp_path / "mirror" / "folder" / "file.bin"
    path.parent.mkdir(parents=True)
    path.write_bytes(CONTENT)
    monkeypatch.setenv("COURSE_DATA_MIRROR", str(tmp_path / "mirror"))
    return path


def test_the_mirror_is_copied_from_first(mirror, target):
    assert get(real_entry(remote(CONTENT, NOWHERE))) == (1, [], len(CONTENT))
    assert target.read_bytes() == CONTENT and names(target) == ["file.bin"]


def test_a_wrong_mirror_is_named_and_refused(mirror, target):
    mirror.write_bytes(CONTENT[:-1] + b"?")
    with serving(CONTENT) as (_, url):
        brought, said, _ = get(real_entry(remote(CONTENT, url)))
    assert brought == 1 and target.read_bytes() == CONTENT
    assert said == [
        f"The mirror's file {mirror} is not the one of the catalogue (its sha256 differs), so it is refused: copy it "
        "there again, or unset COURSE_DATA_MIRROR."
    ]
    shutil.rmtree(target.parent)
    with pytest.raises(fetch.FetchFailed, match="could not be reached"):
        get(real_entry(remote(CONTENT, NOWHERE)))


def test_a_mirror_without_the_file(mirror, target):
    mirror.unlink()
    with serving(CONTENT) as (_, url):
        get(real_entry(remote(CONTENT, url)))
    assert target.read_bytes() == CONTENT


def test_a_full_disk_while_fetching(target, monkeypatch):
    real_open = open

    class Full:
        def __init__(self, file):
            self.file = file

        def write(self, chunk):
            raise OSError(errno.ENOSPC, "No space left on device")

        def close(self):
            self.file.close()

        def __enter__(self):
            return self

        def __exit__(self, *args):
            self.file.close()

    monkeypatch.setattr(fetch, "open", lambda *args: Full(real_open(*args)), raising=False)
    with serving(CONTENT) as (_, url):
        with pytest.raises(CannotWrite, match="The disk is full: .* nothing half-written stays; free some space"):
            get(real_entry(remote(CONTENT, url)))
    assert names(target) == []


def test_a_disk_that_is_too_small_is_refused_beforehand(target):
    file = remote(CONTENT, NOWHERE)
    huge = _catalog.RemoteFile(file.name, file.path, file.url, file.sha256, 10**18)
    with pytest.raises(CannotWrite, match="MB are needed: free some space, or choose another folder"):
        get(real_entry(huge))


def test_two_at_once_fetch_once(target):
    with serving(CONTENT) as (server, url):
        entry = real_entry(remote(CONTENT, url))
        results = []
        threads = [threading.Thread(target=lambda: results.append(get(entry)[0])) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    assert sorted(results) == [0, 1] and len(server.requests) == 1 and target.read_bytes() == CONTENT


def test_clearing_leaves_the_mirror(mirror, target):
    entry = real_entry(remote(CONTENT, NOWHERE))
    get(entry)
    target.with_name(".file.bin.part").write_bytes(b"12345")
    assert fetch.clear(entry) == len(CONTENT) + 5
    assert names(target) == [] and mirror.exists()


def test_a_read_only_cache(tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("COURSE_CACHE", str(tmp_path / "file" / "cache"))
    with pytest.raises(CannotWrite, match="COURSE_CACHE names .* which cannot be written: name another folder with it"):
        get(real_entry(remote(CONTENT, NOWHERE)))
    assert os.listdir(tmp_path) == ["file"]
