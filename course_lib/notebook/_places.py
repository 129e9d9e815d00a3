"""Where data lie on this machine, and what may be said while they are made.

A progress bar is there only while a person watches, and leaves nothing behind: no text, no dead widget.
"""

from __future__ import annotations

import functools
import html
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import platformdirs

from course_lib.notebook._errors import ELSEWHERE, CannotWrite, Refusal, cannot_write, shown

DATASETS = Path(__file__).resolve().parents[2] / "datasets"
"""The catalogue, the cards and, below cache/, what was made or fetched."""


def quiet() -> bool:
    """COURSE_QUIET=1: nothing may be printed (notebooks being built or proved)."""
    return os.environ.get("COURSE_QUIET", "0") not in ("", "0")


def in_kernel() -> bool:
    """Does this process serve a notebook?"""
    ipython = sys.modules.get("IPython")
    return "ipykernel" in sys.modules and ipython is not None and ipython.get_ipython() is not None


def live() -> bool:
    """Is a person watching, in a terminal or a notebook, so that a progress bar helps?

    What runs notebooks without a person (nbval, nbconvert) allows no input, and compares all that is shown.
    """
    if quiet() or not in_kernel():
        return not quiet() and bool(sys.stderr and sys.stderr.isatty())
    kernel = getattr(sys.modules["IPython"].get_ipython(), "kernel", None)
    return bool(getattr(kernel, "_allow_stdin", True))


def notice(sentence: str) -> None:
    """Print one sentence to stderr, unless COURSE_QUIET=1."""
    if not quiet():
        print(sentence, file=sys.stderr)


_once = functools.cache(notice)


def mirror() -> Path | None:
    """The folder that COURSE_DATA_MIRROR names, or None.

    Raises
    ------
    Refusal
        If it names a folder that is not there.
    """
    named = os.environ.get("COURSE_DATA_MIRROR", "")
    if not named:
        return None
    path = Path(named).expanduser()
    if not path.is_dir():
        raise Refusal(f"COURSE_DATA_MIRROR names {named}, which is no folder: plug it in, or unset the variable.")
    return path


def cache_roots() -> list[Path]:
    """The folders that may hold made or fetched data, in the order in which they are looked through."""
    named = os.environ.get("COURSE_CACHE", "")
    if named:
        return [Path(named).expanduser()]
    return [DATASETS / "cache", Path(platformdirs.user_cache_dir("course-3d-reconstruction", appauthor=False))]


def writable_root() -> Path:
    """The first of `cache_roots` that can be written; it is made where it is missing.

    Where the course's own folder is read-only (a shared installation), one sentence says that the user's is taken.

    Raises
    ------
    CannotWrite
        If none can be written.
    """
    roots = cache_roots()
    for root in roots:
        refused = _try(root)
        if refused is None:
            if root != roots[0]:
                _once(f"{shown(roots[0])} is read-only here, so the data go to {root}.")
            return root
    if os.environ.get("COURSE_CACHE"):
        raise CannotWrite(f"COURSE_CACHE names {roots[0]}, which cannot be written: name another folder with it.")
    raise CannotWrite(f"Neither {shown(roots[0])} nor {roots[1]} can be written: {ELSEWHERE}.")


def _try(root: Path) -> OSError | None:
    """Make a file in a folder and remove it again; a full disk is not a read-only one and is said at once."""
    try:
        root.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root):
            return None
    except OSError as error:
        refusal = cannot_write(root / "data", error)
        if "full" in str(refusal):
            raise refusal from error
        return error


class _Line:
    """What a notebook shows for a moment; nothing at last."""

    def __init__(self, text: str):
        self.text = text

    def __repr__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(self.text)}</pre>" if self.text else ""


class Bar:
    """A context that gives a function ``step(done, total)``."""

    def __init__(self, title: str):
        self.title, self.bar, self.handle, self.start = title, None, None, time.monotonic()

    def __enter__(self) -> Callable[[int, int], None]:
        return self.step if live() else lambda done, total: None

    def step(self, done: int, total: int) -> None:
        """Show that `done` of `total` steps are behind."""
        from tqdm import tqdm

        if not in_kernel():
            self.bar = self.bar or tqdm(total=total, desc=self.title, leave=False)
            self.bar.update(done - self.bar.n)
            return
        line = _Line(tqdm.format_meter(done, total, time.monotonic() - self.start, prefix=self.title, ncols=80))
        if self.handle is None:
            from IPython.display import display

            self.handle = display(line, display_id=True)
        else:
            self.handle.update(line)

    def __exit__(self, *args: object) -> None:
        if self.bar is not None:
            self.bar.close()
        if self.handle is not None:
            self.handle.update(_Line(""))


@contextmanager
def told(words: str) -> Iterator[None]:
    """Show some words while something takes its time."""
    with Bar(words) as step:
        step(0, 1)
        yield
