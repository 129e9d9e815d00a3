"""Reading zips that anybody made: names that lead outside, links, bombs and doubles are refused one by one."""

from __future__ import annotations

import io
import re
import stat
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime

from .untrusted_notebook import IntakeLimits, Unreadable

__all__ = ["Member", "members"]

END_BYTES = 66_000
"""In so many last bytes a zip says how long its list of files is: a comment of 65,535 may stand behind that."""
NAME_BYTES = 1_000
"""What one file may take of a zip's list of files, on average: its name and what is told of it."""


@dataclass(frozen=True)
class Member:
    """One file of a zip: its bytes, or why there are none."""

    name: str
    data: bytes
    received: str
    code: str = ""
    trouble: str = ""


def members(data: bytes, limits: IntakeLimits) -> Iterator[Member]:
    """The files of a zip, in order.

    Raises
    ------
    Unreadable
        If it is no zip, or holds or unpacks to more than the limits.
    """
    try:
        _refuse_long_list(data, limits)
        archive = zipfile.ZipFile(io.BytesIO(data))
        infos = [info for info in archive.infolist() if not info.is_dir()]
    except (zipfile.BadZipFile, ValueError, EOFError, OSError, NotImplementedError) as error:
        raise Unreadable("damaged zip", f"the zip is damaged: {str(error)[:100]}.") from None
    if len(infos) > limits.archive_members:
        raise Unreadable("zip bomb", f"the zip holds {len(infos)} files; {limits.archive_members} is the most.")
    if sum(info.file_size for info in infos) > limits.archive_bytes:
        most = limits.archive_bytes // 1_000_000
        raise Unreadable("zip bomb", f"the zip unpacks to more than {most} MB.")
    seen: set[str] = set()
    for info in infos:
        yield _member(archive, info, seen, limits)


def _refuse_long_list(data: bytes, limits: IntakeLimits) -> None:
    """Refuse a zip by the length of its list of files, before millions of them are read into memory."""
    tail, sizes = data[-END_BYTES:], []
    for mark, start, stop in ((b"PK\5\6", 12, 16), (b"PK\6\6", 40, 48)):  # the end of a zip, and of a large one
        places = [match.start() for match in re.finditer(mark, tail)]
        sizes += [int.from_bytes(tail[place + start : place + stop], "little") for place in places]
    if any(limits.archive_members * NAME_BYTES < size < len(data) for size in sizes):
        raise Unreadable("zip bomb", f"the zip lists far more than {limits.archive_members} files.")


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, seen: set[str], limits: IntakeLimits) -> Member:
    name = info.filename
    received = _time(info)
    refusal = _refusal(info, seen, limits)
    seen.add(name)
    if refusal:
        return Member(name, b"", received, *refusal)
    try:
        with archive.open(info) as file:
            data = file.read(limits.notebook_bytes + 1)
    except (zipfile.BadZipFile, RuntimeError, OSError, EOFError, ValueError, NotImplementedError) as error:
        return Member(name, b"", received, "damaged zip", f"it cannot be unpacked: {str(error)[:100]}.")
    except Exception as error:  # zlib and lzma errors, which share no class
        return Member(name, b"", received, "damaged zip", f"it cannot be unpacked: {type(error).__name__}.")
    if len(data) > limits.notebook_bytes:
        most = limits.notebook_bytes // 1_000_000
        return Member(name, b"", received, "too big", f"it has more than {most} MB.")
    return Member(name, data, received)


def _refusal(info: zipfile.ZipInfo, seen: set[str], limits: IntakeLimits) -> tuple[str, str] | None:
    name = info.filename.replace("\\", "/")
    if name.startswith("/") or re.match(r"^[A-Za-z]:", name) or ".." in name.split("/"):
        return "zip slip", "its name leads out of the zip, as no honest file's does."
    if stat.S_ISLNK(info.external_attr >> 16):
        return "symlink", "it is a symbolic link, which is not followed."
    if info.flag_bits & 0x1:
        return "encrypted", "it is encrypted: zip it without a password."
    if info.filename in seen:
        return "doubled name", "the zip holds this name twice; only the first was read."
    if info.file_size > 1_000_000 and info.file_size > limits.archive_ratio * max(1, info.compress_size):
        return "zip bomb", f"it was squeezed more than {limits.archive_ratio} to 1, as no notebook is."
    return None


def _time(info: zipfile.ZipInfo) -> str:
    try:
        return datetime(*info.date_time, tzinfo=UTC).isoformat()
    except ValueError:
        return ""
