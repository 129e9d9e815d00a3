"""Fetching real datasets: from the mirror first, else over the network, resumed, and proved by sha256."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable
from pathlib import Path

import pooch
import requests

from course_lib.notebook import _places, _real
from course_lib.notebook._atomic import atomic_file, locked, need_space
from course_lib.notebook._catalog import Entry, RemoteFile
from course_lib.notebook._errors import Refusal, cannot_write, shown

TIMEOUT_SECONDS = (10, 30)
"""To connect, and between two pieces of an answer."""
TRIES = 3
PAUSE_SECONDS = 1.0
"""Before the second try; twice as long before the third."""
CHUNK_BYTES = 1 << 16

pooch.get_logger().setLevel("ERROR")

Say = Callable[[str], None]
Step = Callable[[int], None]


class FetchFailed(Refusal):
    """A file could not be fetched; the sentence says why and what to do."""


def fetch(entry: Entry, *, say: Say = print, step: Step = lambda n_bytes: None) -> int:
    """Bring every file of a real dataset into the cache, and return how many had to be brought.

    A file that is there and whole is left alone; a damaged one is named and replaced. The mirror's copy is taken where
    it is whole; where it is not, it is named, refused, and the file is fetched from its address.

    Parameters
    ----------
    entry : a real dataset.
    say : prints a sentence.
    step : told the bytes that came in, for a progress bar.

    Raises
    ------
    FetchFailed
        If an address cannot be reached or gives other bytes than the catalogue names.
    CannotWrite
        If the cache is read-only or the disk is full.
    """
    root = _places.writable_root()
    mirror = _places.mirror()
    with locked(root / f".fetch-{entry.name}.lock", f"Another process is fetching {entry.name}: waiting for it.", say):
        lacking = [one for one in entry.files if not _there(root, one, entry, say)]
        need_space(root, sum(one.size for one in lacking))
        for one in lacking:
            target = root / "real" / one.path
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise cannot_write(target, error) from error
            if not (mirror and _copy(mirror / one.path, target, one, entry, say, step)):
                _download(one, target, step)
    return len(lacking)


def _there(root: Path, one: RemoteFile, entry: Entry, say: Say) -> bool:
    """Is a fetched copy there and whole? A damaged one is named, and fetched again."""
    path = root / "real" / one.path
    if not path.is_file():
        return False
    if _real.is_whole(path, one):
        return True
    say(f"{one.path} of {entry.name} is damaged (its content is not the catalogue's), so it is fetched again.")
    return False


def _copy(source: Path, target: Path, one: RemoteFile, entry: Entry, say: Say, step: Step) -> bool:
    """Copy a file of the mirror if it is whole; say so if it is not."""
    if not source.is_file():
        return False
    if not _real.is_whole(source, one):
        say(f"{_real.damaged(source, one, entry)}")
        return False
    with atomic_file(target, one.size) as partial:
        partial.write_bytes(source.read_bytes())
        if not _real.is_whole(partial, one):
            raise FetchFailed(f"The mirror's file {source} changed while it was copied: try again.")
    step(one.size)
    return True


def _download(one: RemoteFile, target: Path, step: Step) -> None:
    """Fetch one file through pooch, which proves its hash; what had come before an interruption is used."""
    try:
        pooch.retrieve(
            one.url,
            f"sha256:{one.sha256}",
            target.name,
            target.parent,
            downloader=lambda url, output, _: _resumed(url, Path(output), target, one, step),
        )
    except Refusal:
        raise
    except ValueError as error:
        raise FetchFailed(
            f"{one.url} gave other bytes than the catalogue names (its sha256 differs), so they were thrown away: "
            "try again, and tell the course's authors if it happens twice."
        ) from error
    except OSError as error:
        raise cannot_write(target, error) from error


def _resumed(url: str, output: Path, target: Path, one: RemoteFile, step: Step) -> None:
    """Download into a .part file beside the target, from where an earlier try stopped, then move it to `output`."""
    part = target.with_name(f".{target.name}.part")
    if part.exists() and part.stat().st_size >= one.size:
        part.unlink()
    step(part.stat().st_size if part.exists() else 0)
    for attempt in range(1, TRIES + 1):
        try:
            _request(url, part, one, step)
        except requests.RequestException as error:
            status = error.response.status_code if isinstance(error, requests.HTTPError) else 0
            refused = 400 <= status < 500 and status not in (408, 429)
            if attempt == TRIES or refused:
                raise FetchFailed(_why(error, url)) from error
            time.sleep(PAUSE_SECONDS * attempt)
        if part.exists() and part.stat().st_size == one.size:
            part.replace(output)
            return
    have = part.stat().st_size if part.exists() else 0
    raise FetchFailed(f"{url} ended early, after {have:,} of {one.size:,} bytes: try again, it goes on from there.")


def _request(url: str, part: Path, one: RemoteFile, step: Step) -> None:
    have = part.stat().st_size if part.exists() else 0
    headers = {"Range": f"bytes={have}-"} if have else {}
    headers["Accept-Encoding"] = "identity"
    with requests.get(url, stream=True, timeout=TIMEOUT_SECONDS, headers=headers) as answer:
        if answer.status_code == 416:
            part.unlink()
            return
        answer.raise_for_status()
        goes_on = answer.status_code == 206 and answer.headers.get("Content-Range", "").startswith(f"bytes {have}-")
        if have and not goes_on:
            step(-have)
            have = 0
        with open(part, "ab" if have else "wb") as file:
            for chunk in answer.iter_content(CHUNK_BYTES):
                have += len(chunk)
                if have > one.size:
                    file.close()
                    part.unlink()
                    raise FetchFailed(f"{url} gives more than the {one.size:,} bytes of the catalogue: it was refused.")
                try:
                    file.write(chunk)
                except OSError as error:
                    if error.errno in (errno.ENOSPC, errno.EDQUOT):
                        file.close()
                        part.unlink()
                    raise cannot_write(part, error) from error
                step(len(chunk))


def _why(error: requests.RequestException, url: str) -> str:
    host = url.split("/")[2] if url.count("/") > 2 else url
    offline = "check the network, or set COURSE_DATA_MIRROR to a folder that holds the files"
    if isinstance(error, requests.HTTPError) and error.response is not None:
        return f"{url} answered with {error.response.status_code}: try later, or {offline}."
    if isinstance(error, (requests.exceptions.ProxyError, requests.exceptions.SSLError)):
        return f"{host} could not be reached through this network's proxy or certificates: ask your administrator."
    if isinstance(error, requests.Timeout):
        return f"{host} did not answer in time: try again, or {offline}."
    return f"{host} could not be reached: {offline}."


def clear(entry: Entry) -> int:
    """Remove the fetched files of a real dataset, and return the bytes that this freed; the mirror is left alone."""
    freed = 0
    for root in _places.cache_roots():
        for one in entry.files:
            path = root / "real" / one.path
            for each in (path, path.with_name(f".{path.name}.part")):
                if each.is_file():
                    freed += each.stat().st_size
                    try:
                        each.unlink()
                    except OSError as error:
                        raise Refusal(f"{shown(each)} cannot be removed: the folder is read-only.") from error
    return freed
