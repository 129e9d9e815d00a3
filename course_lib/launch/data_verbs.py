"""`python3 course.py data get|list|verify|clear`: what is here, fetching what is not, and proving what is."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import click

from course_lib.authoring.tree import CourseError
from course_lib.notebook import _cache, _catalog, _places, _real
from course_lib.notebook._errors import DataDamaged, Refusal


@dataclass(frozen=True)
class State:
    """How it stands with one dataset on this machine.

    Attributes
    ----------
    entry : of the catalogue.
    words : "here", "here (mirror)", "made", "made on first use", "not here" or "damaged".
    n_bytes : of its files; 0 for a synthetic one that has not been made.
    n_files : how many were proved by their hashes.
    damage : one sentence about the first damaged file, or "".
    """

    entry: _catalog.Entry
    words: str
    n_bytes: int = 0
    n_files: int = 0
    damage: str = ""


def states(names: Sequence[str] = (), *, prove: bool = False) -> list[State]:
    """Say how it stands with these datasets (all, without names).

    Parameters
    ----------
    names : of the catalogue.
    prove : hash every file that is there.
    """
    entries = [_catalog.entry(name) for name in names or _catalog.catalogue()]
    return [_made(entry, prove) if entry.kind == "synthetic" else _fetched(entry, prove) for entry in entries]


def _fetched(entry: _catalog.Entry, prove: bool) -> State:
    if _real.missing(entry):
        return State(entry, "not here", entry.size)
    mirror = _places.mirror()
    in_mirror = bool(mirror) and all((mirror / one.path).is_file() for one in entry.files)
    try:
        n_files = len(_real.locate(entry)) if prove else 0
    except DataDamaged as error:
        return State(entry, "damaged", entry.size, damage=str(error))
    return State(entry, "here (mirror)" if in_mirror else "here", entry.size, n_files)


def _made(entry: _catalog.Entry, prove: bool) -> State:
    folders = [root / _cache.key(entry, entry.seed) for root in _places.cache_roots()]
    made = next((folder for folder in folders if folder.is_dir()), None)
    if made is None:
        return State(entry, "made on first use")
    size = sum(path.stat().st_size for path in made.rglob("*") if path.is_file())
    try:
        n_files = len(_cache.proved(made, _cache.fingerprint(entry, entry.seed))["files"]) if prove else 0
    except DataDamaged as error:
        return State(entry, "damaged", size, damage=f"{error}; it is made again when it is next loaded.")
    return State(entry, "made", size, n_files)


@click.group("data", context_settings={"help_option_names": ["-h", "--help"]})
def data_group() -> None:
    """List, fetch, prove and remove datasets.

    Fetched data go to datasets/cache (or COURSE_CACHE); COURSE_DATA_MIRROR names a folder that is copied from first.
    """


@data_group.command("list")
def list_() -> None:
    """Say which datasets there are and which are here."""
    rows = [("name", "kind", "size", "state", "what it is")]
    rows += [(s.entry.name, s.entry.kind, _size(s.n_bytes), s.words, s.entry.title) for s in states()]
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    for row in rows:
        name, kind, size, words = (cell.ljust(width) for cell, width in zip(row, widths, strict=False))
        click.echo(f"{name}  {kind}  {size.strip().rjust(widths[2])}  {words}  {row[4]}")


@data_group.command("get")
@click.argument("names", nargs=-1, metavar="[NAME…]")
@click.option("--all", "everything", is_flag=True, help="Every dataset of the catalogue.")
def get(names: tuple[str, ...], everything: bool) -> None:
    """Fetch real datasets and make synthetic ones, so that they work without a network from then on."""
    entries = _chosen(names, everything)
    failed = []
    for entry in entries:
        try:
            _get_one(entry)
        except Refusal as refusal:
            if len(entries) == 1:
                raise
            failed.append(entry.name)
            click.echo(f"{entry.name}: {refusal}", err=True)
    if failed:
        raise CourseError(f"{len(failed)} of {len(entries)} datasets could not be got: {', '.join(failed)}.")


def _get_one(entry: _catalog.Entry) -> None:
    if entry.kind == "synthetic":
        there = _made(entry, prove=False).words == "made"
        _cache.make(entry)
        click.echo(f"{entry.name}: {'already made' if there else 'made'}")
        return
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    from .fetch import fetch

    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with Progress(*columns, transient=True, disable=not sys.stdout.isatty()) as progress:
        task = progress.add_task(entry.name, total=entry.size)
        brought = fetch(
            entry,
            say=lambda sentence: click.echo(sentence, err=True),
            step=lambda n_bytes: progress.advance(task, n_bytes),
        )
    what = f"{brought} of {len(entry.files)} files fetched" if brought else "already here"
    click.echo(f"{entry.name}: {what}, {_size(entry.size)}; licence: {entry.licence}")


@data_group.command("verify")
@click.argument("names", nargs=-1, metavar="[NAME…]")
def verify(names: tuple[str, ...]) -> None:
    """Hash every file that is here; damaged ones are named and the exit code is 1."""
    found = states(names, prove=True)
    for state in found:
        click.echo(f"{state.entry.name}: {state.damage or state.words}")
    if any(state.damage for state in found):
        sys.exit(1)


@data_group.command("clear")
@click.argument("names", nargs=-1, metavar="[NAME…]")
@click.option("--all", "everything", is_flag=True, help="Every dataset of the catalogue.")
@click.option("--yes", is_flag=True, help="Do not ask.")
def clear(names: tuple[str, ...], everything: bool, yes: bool) -> None:
    """Remove made and fetched data of this machine; the mirror is left alone."""
    from .fetch import clear as clear_fetched

    entries = _chosen(names, everything)
    if not yes:
        click.confirm(f"Remove the data of {', '.join(entry.name for entry in entries)} from this machine?", abort=True)
    freed = 0
    for entry in entries:
        freed += _cache.clear(entry.name) if entry.kind == "synthetic" else clear_fetched(entry)
    click.echo(f"{_size(freed)} freed")


def _chosen(names: tuple[str, ...], everything: bool) -> list[_catalog.Entry]:
    if bool(names) == everything:
        raise Refusal(f"Name datasets, or say --all; known: {', '.join(_catalog.catalogue())}.")
    return [_catalog.entry(name) for name in names or _catalog.catalogue()]


def _size(n_bytes: int) -> str:
    return f"{n_bytes / 1e6:.1f} MB" if n_bytes else "–"
