"""Whose file it is: read from where it lies in a download, by the rules of each kind of download."""

from __future__ import annotations

import re

_MOODLE_MARK = "_assignsubmission_"
_MOODLE = re.compile(r"^(?P<name>.+?)_(?P<id>\d+)_assignsubmission_[a-z]+(?:_(?P<file>.*))?$", re.S)
_CANVAS = re.compile(r"^(?P<name>[^_]+)(?P<late>_LATE)?_(?P<id>\d+)_(?P<sub>\d+)_(?P<file>.+)$", re.S)
_AGAIN = re.compile(r"-(\d+)(?=\.[A-Za-z]+$)")


def author(parts: tuple[str, ...]) -> tuple[str, tuple[str, ...], tuple[str, ...], bool, int]:
    """Layout, ids, names, mark of lateness and number of the attempt, from where a file lies.

    Only the first part is the LMS's or the instructor's; folders and names below it are chosen by whoever handed in,
    and could name somebody else.
    """
    file = parts[-1]
    again = _AGAIN.search(file)
    attempt = int(again[1][:6]) if again else 0
    canvas = _CANVAS.match(file) if len(parts) == 1 else None
    if parts[0].count(_MOODLE_MARK) > 1 or (canvas and _MOODLE_MARK in file):
        return "loose", (parts[0],), (parts[0],), False, attempt  # two can be meant: a person decides
    if canvas:
        return "canvas", (canvas["id"],), (canvas["name"],), canvas["late"] is not None, attempt
    moodle = _MOODLE.match(parts[0])
    if moodle:
        return "moodle", (moodle["id"],), (moodle["name"],), False, attempt
    if len(parts) > 1:
        return "folders", (parts[0],), (parts[0],), False, attempt
    stem = re.sub(r"(\.ipynb|\.zip)+$", "", file, flags=re.I)
    plain = _AGAIN.sub("", file)
    plain = re.sub(r"(\.ipynb|\.zip)+$", "", plain, flags=re.I)
    before = re.sub(r"[_\- ]*\d\d_[a-z_]*.*$", "", plain) or plain
    ids = tuple(dict.fromkeys([before, plain.split("_")[0], stem]))
    return "loose", ids, (before, plain), False, attempt
