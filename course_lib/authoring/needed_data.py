"""The data that notebooks name: made before they run, so that no first-use message is stored; or missing, and told."""

from __future__ import annotations

import contextlib
import importlib
import signal
from collections.abc import Iterable, Sequence
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess

from nbformat import NotebookNode

from course_lib.notebook import _cache, _catalog

from . import notebooks as nbs
from .tree import CourseError


def missing_data(names: Iterable[str]) -> set[str]:
    """Which of these datasets are real ones that nobody has fetched.

    Raises
    ------
    CourseError
        If a name is unknown; the nearest is suggested.
    """
    names = sorted(set(names))
    if not names:
        return set()
    data = importlib.import_module("course_lib.notebook.data")
    try:
        return {name for name in names if not data.available(name)}
    except data.Refusal as refusal:
        raise CourseError(str(refusal)) from refusal


def prepare_data(nb: NotebookNode) -> set[str]:
    """Make the data that a notebook names before it runs, so that no first-use message is stored.

    Returns
    -------
    The named datasets that are not there: real ones that nobody has fetched.

    Raises
    ------
    CourseError
        If a name is unknown, or the data cannot be written.
    """
    names = nbs.named_datasets(nb)
    missing = missing_data(names)
    if names:
        make_data(names)
    return missing


def make_data(names: str | Iterable[str]) -> None:
    """Make the synthetic ones of these datasets where they are not there yet.

    Raises
    ------
    CourseError
        If a name is unknown, or the data cannot be written.
    """
    data = importlib.import_module("course_lib.notebook.data")
    try:
        data.prepare(names)
    except data.Refusal as refusal:
        raise CourseError(str(refusal)) from refusal


def _make(name: str) -> None:
    with contextlib.suppress(CourseError):  # what is wrong is said by the process that asked for it
        make_data(name)


def make_side_by_side(names: Sequence[str], workers: int) -> None:
    """Make the synthetic ones of these datasets, several at once, each in a process of its own.

    Raises
    ------
    CourseError
        If a name is unknown, or the data cannot be written.
    """
    catalogue = _catalog.catalogue()
    known = [catalogue[name] for name in names if name in catalogue]
    waiting = [one.name for one in known if one.kind == "synthetic" and not _cache.find(one, one.seed)]
    running: list[BaseProcess] = []
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                one = get_context("spawn").Process(target=_make, args=(waiting.pop(0),))
                before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: it does not hear Ctrl-C, we do
                try:
                    one.start()
                finally:
                    signal.signal(signal.SIGINT, before)
                running.append(one)
            wait([one.sentinel for one in running])
            running = [one for one in running if one.is_alive()]
    finally:
        for one in running:
            one.terminate()
            one.join()
    make_data(names)  # finds them made, or says why not
