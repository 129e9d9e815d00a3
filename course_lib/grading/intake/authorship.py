"""Whose file it is: read from where it lies in a download, by the rules of each kind of download."""

from __future__ import annotations

import re
from dataclasses import dataclass

_MOODLE_MARK = "_assignsubmission_"
_MOODLE = re.compile(r"^(?P<name>.+?)_(?P<id>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*))?$", re.S)
_CANVAS = re.compile(r"^(?P<name>[^_]+)(?P<late>_LATE)?_(?P<id>\d+)_(?P<sub>\d+)_(?P<file>.+)$", re.S)
_AGAIN = re.compile(r"-(\d+)(?=\.[A-Za-z]+$)")


@dataclass(frozen=True)
class Author:
    """What a download says of whoever handed in.

    Parameters
    ----------
    layout : "folders", "moodle", "canvas" or "loose".
    ids, names : that may be meant; in a Moodle or Canvas download the id is sure to be one.
    late : marked so by the download.
    suffix : 2 of "lab-2.ipynb", 0 where there is none.
    """

    layout: str
    ids: tuple[str, ...]
    names: tuple[str, ...]
    late: bool
    suffix: int


def author(parts: tuple[str, ...]) -> Author:
    """Whose file it is, from where it lies.

    Only the first part is the LMS's or the instructor's; folders and names below it are chosen by whoever handed in,
    and could name somebody else.
    """
    top, file = parts[0], parts[-1]
    again = _AGAIN.search(file)
    suffix = int(again[1][:6]) if again else 0
    canvas = _CANVAS.match(file) if len(parts) == 1 else None
    if top.count(_MOODLE_MARK) > 1 or (canvas and _MOODLE_MARK in file):
        return Author("loose", (top,), (top,), False, suffix)  # two can be meant: a person decides
    if canvas:
        return Author("canvas", (canvas["id"],), (canvas["name"],), canvas["late"] is not None, suffix)
    moodle = _MOODLE.match(top)
    if moodle:
        return Author("moodle", (moodle["id"],), (moodle["name"],), False, suffix)
    if len(parts) > 1:
        return Author("folders", (top,), (top,), False, suffix)
    stem = re.sub(r"(\.ipynb|\.zip)+$", "", file, flags=re.I)
    plain = re.sub(r"(\.ipynb|\.zip)+$", "", _AGAIN.sub("", file), flags=re.I)
    before = re.sub(r"[_\- ]*\d\d_[a-z_]*.*$", "", plain) or plain
    ids = tuple(dict.fromkeys([before, plain.split("_")[0], stem]))
    return Author("loose", ids, (before, plain), False, suffix)
