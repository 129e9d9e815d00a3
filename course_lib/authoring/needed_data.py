"""The data that notebooks name: made before they run, so that no first-use message is stored; or missing, and told.

All functions raise `Refusal` if a name is unknown (the nearest is suggested) or the data cannot be written.
"""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterable, Sequence
from multiprocessing import get_context
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess

from nbformat import NotebookNode

from course_lib.notebook import _cache, _catalog, data
from course_lib.notebook._errors import Refusal

from . import notebooks as nbs


def missing_data(names: Iterable[str]) -> set[str]:
    """Which of these datasets are real ones that nobody has fetched."""
    return {name for name in sorted(set(names)) if not data.available(name)}


def prepare_data(nb: NotebookNode) -> set[str]:
    """Make the data that a notebook names before it runs, so that no first-use message is stored.

    Returns
    -------
    The named datasets that are not there: real ones that nobody has fetched.
    """
    names = nbs.named_datasets(nb)
    missing = missing_data(names)
    data.prepare(names)
    return missing


def _make(name: str) -> None:
    with contextlib.suppress(Refusal):  # what is wrong is said by the process that asked for it
        data.prepare(name)


def make_side_by_side(names: Sequence[str], workers: int) -> None:
    """Make the synthetic ones of these datasets, several at once, each in a process of its own."""
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
    data.prepare(names)  # finds them made, or says why not
