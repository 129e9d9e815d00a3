"""The data that notebooks name: made before they run, so that no first-use message is stored; or missing, and told.

All functions raise `Refusal` if a name is unknown (the nearest is suggested) or the data cannot be written.
"""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from multiprocessing import active_children, get_context

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
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: they do not hear Ctrl-C, we do
        try:
            try:
                making = [pool.submit(_make, name) for name in waiting]
            finally:
                signal.signal(signal.SIGINT, before)
            wait(making)
        except KeyboardInterrupt:
            for process in active_children():
                process.terminate()
            raise
    data.prepare(names)  # finds them made, or says why not
