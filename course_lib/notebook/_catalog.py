"""The catalogue of datasets as Python objects: datasets/NAME.toml is one entry, its card is NAME.md beside it.

A synthetic entry names a recipe of course_lib/simulate/recipes/; recipe, version and seed decide its content. A real
one lists its files.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from course_lib.notebook import _places
from course_lib.notebook._errors import Refusal, nearest


@dataclass(frozen=True)
class RemoteFile:
    """One file of a real dataset.

    Attributes
    ----------
    name : how the dataset calls it, such as "color/00000.jpg".
    path : where it lies below a mirror, and below real/ in the cache; forward slashes.
    url : where it is fetched from; the address holds the commit, so its content never changes.
    sha256, size : what its content must be.
    """

    name: str
    path: str
    url: str
    sha256: str
    size: int


@dataclass(frozen=True)
class Entry:
    """One dataset of the catalogue.

    Attributes
    ----------
    name, kind, title, licence, credit, units : for people; kind is "synthetic" or "real".
    recipe, version, seed : of a synthetic one: what makes it.
    reader : of a real one: the function of `_real.READERS` that reads its files.
    encoding, registered : of its depth images; is depth aligned to colour?
    camera : width, height, fx, fy, cx, cy; or preset = a name; or file = one of its files.
    camera_source : one sentence; begins with "assumed" where upstream gives no intrinsics.
    citation : the paper to cite.
    parts : by name, title, camera, camera_source and encoding of recordings that differ from the main one.
    files : what to fetch: where each lies below COURSE_DATA_MIRROR and below the cache's real/ folder, its address,
        which holds the commit that it was taken from, and the sha256 and size that must come.
    """

    name: str
    kind: Literal["synthetic", "real"]
    title: str
    licence: str
    credit: str
    units: str
    recipe: str = ""
    version: int = 0
    seed: int = 0
    reader: str = ""
    encoding: str = ""
    registered: bool = True
    camera: Mapping[str, float] = field(default_factory=dict)
    camera_source: str = ""
    citation: str = ""
    parts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    files: tuple[RemoteFile, ...] = ()

    @property
    def size(self) -> int:
        """Bytes to fetch; 0 for a synthetic one."""
        return sum(one.size for one in self.files)

    @property
    def card_path(self) -> Path:
        return _places.DATASETS / f"{self.name}.md"

    def command(self) -> str:
        """The command that fetches it."""
        return f"python3 course.py data get {self.name}"


def _broken(name: str, why: str) -> Refusal:
    return Refusal(f"The dataset {name!r} {why}: mend datasets/{name}.toml.")


def parse(name: str, text: str) -> Entry:
    """Read an entry of the catalogue.

    Raises
    ------
    Refusal
        If the entry lacks something or a file's path leaves its folder.
    """
    try:
        table = tomllib.loads(text)
        files = tuple(RemoteFile(**one) for one in table.pop("files", []))
        entry = Entry(name=name, files=files, **table)
    except (tomllib.TOMLDecodeError, TypeError) as error:
        raise _broken(name, f"cannot be read ({error})") from error
    for one in files:
        parts = PurePosixPath(one.path)
        if parts.is_absolute() or ".." in parts.parts or "\\" in one.path or len(one.sha256) != 64:
            raise _broken(name, f"has an unsafe file {one.path!r}")
    if (entry.kind == "real") != bool(files) or (entry.kind == "synthetic") != bool(entry.recipe):
        raise _broken(name, "needs either files or a recipe")
    return entry


@functools.cache
def _read(path: Path, _changed: int) -> Entry:
    return parse(path.stem, path.read_text(encoding="utf-8"))


def catalogue() -> dict[str, Entry]:
    """Every entry by its name, the synthetic ones first."""
    entries = [_read(path, path.stat().st_mtime_ns) for path in sorted(_places.DATASETS.glob("*.toml"))]
    if not entries:
        raise Refusal("datasets/ holds no entry in this copy of the course: get it again with git checkout.")
    return {one.name: one for one in sorted(entries, key=lambda one: one.kind == "real")}


def entry(name: str) -> Entry:
    """Find an entry by its name.

    Raises
    ------
    Refusal
        If there is none; the nearest name is suggested.
    """
    known = catalogue()
    if not isinstance(name, str):
        raise Refusal(f"A dataset's name is a text such as 'living_room', and this is a {type(name).__name__}.")
    if name not in known:
        suggestion = nearest(name.strip().lower().replace("-", "_").replace(" ", "_"), known)
        raise Refusal(f"There is no dataset {name!r}.{suggestion or ' Known: ' + ', '.join(known) + '.'}")
    return known[name]
