"""How loops are compiled: by numba, with stated types, kept for the user, on all processors.

A loop that NumPy cannot say stands as plain Python in a module `*_loops.py` and is marked with `compiled`. Such a
module is imported only where one of its loops is called. Importing it takes what an earlier process has compiled from a
folder of the user's, or compiles it (seconds a loop) while `announce` is told. Nothing is reordered to be faster (no
fastmath): compiled and plain Python give the same numbers. Without numba, or with COURSE_UNCOMPILED=1, loops stay plain
Python.

Two processors are used by threads (`in_threads`): a compiled loop lets go of the interpreter's lock.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import os
import pickle
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from types import CodeType
from typing import Any, TypeVar

__all__ = [
    *("FLAGS", "FLOATS", "INTS", "LIST", "ROWS", "TABLE"),
    *("announce", "compiled", "fill", "folder", "in_threads", "inlined", "states", "threads"),
]

Loop = TypeVar("Loop", bound=Callable[..., Any])

# Types of arguments, for signatures: what is only read may be an array that cannot be written.
ROWS, FLOATS = "Array(float64, 2, 'C', True)", "Array(float64, 1, 'C', True)"
INTS = "Array(int64, 1, 'C', True)"
TABLE, LIST = "Array(int32, 2, 'C', True)", "Array(int32, 1, 'C', True)"
FLAGS = "boolean[::1]"
SPOILED = (OSError, EOFError, pickle.UnpicklingError, ValueError, KeyError, TypeError, AttributeError)
PARTS = 4  # for each thread: what takes longer on one leaves less to it


@lru_cache(maxsize=1)
def _said_once(sentence: str) -> None:
    say(sentence)


def _announce(words: str) -> contextlib.AbstractContextManager[Any]:
    _said_once("The course's loops are compiled, once on this machine; that takes some seconds.")
    return contextlib.nullcontext()


announce: Callable[[str], contextlib.AbstractContextManager[Any]] = _announce
"""Entered around each compilation with words for people; a notebook puts a line here that leaves nothing behind."""
states: dict[str, str] = {}
"""Each loop of this process: "cached" where it was found compiled, "compiled", or "plain"."""


def folder() -> Path | None:
    """Where compiled loops are kept: COURSE_COMPILED, the user's own cache, or a temporary folder; None where none can.

    A folder that COURSE_COMPILED names may be read-only, if it is filled.
    """
    named = os.environ.get("COURSE_COMPILED", "")
    if named:
        return Path(named)
    places = [Path(tempfile.gettempdir()) / f"course-compiled-{os.getuid() if hasattr(os, 'getuid') else 'own'}"]
    with contextlib.suppress(ImportError):
        import platformdirs

        user = platformdirs.user_cache_path("course-3d-reconstruction", appauthor=False)
        places.insert(0, user / "compiled")
    for place in places:
        with contextlib.suppress(OSError):
            place.mkdir(parents=True, exist_ok=True, mode=0o700)
            if hasattr(os, "getuid") and place.stat().st_uid != os.getuid():
                continue  # somebody else's, in a folder that all can write
            tempfile.TemporaryFile(dir=place).close()
            return place
    return None


def _stamp(function: Callable[..., Any]) -> str:
    """What a compiled loop is made of: its own instructions and numbers, and those of what it calls, and so on."""
    parts: list[object] = []
    codes = [(function.__code__, function.__globals__)]
    for code, names in codes:  # which grows
        parts += [code.co_code, code.co_names]
        for constant in code.co_consts:
            if isinstance(constant, CodeType):
                codes.append((constant, names))
            else:
                parts.append(constant)
        for name in code.co_names:
            thing = names.get(name)
            if isinstance(thing, (int, float)):
                parts.append((name, thing))
            called = getattr(thing, "py_func", None)
            if called is not None and (called.__code__, called.__globals__) not in codes:
                codes.append((called.__code__, called.__globals__))
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _keep(dispatcher: Any, function: Callable[..., Any], place: Path) -> Any:
    """Give a loop a cache that knows it by its module's name and text, not by where the course lies or when it changed.

    What cannot be read there is compiled again, and what cannot be written is not kept.
    """
    from numba.core import caching

    class Locator(caching._CacheLocator):  # type: ignore[misc]
        def get_cache_path(self) -> str:
            return str(place)

        def get_source_stamp(self) -> str:
            return _stamp(function)

        def get_disambiguator(self) -> str:
            return function.__module__

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Locator:
            return cls()

    class Kept(caching.CompileResultCacheImpl):  # type: ignore[misc]
        _locator_classes = (Locator,)

    class Cache(caching.FunctionCache):  # type: ignore[misc]
        _impl_class = Kept

        def load_overload(self, sig: Any, target_context: Any) -> Any:
            try:
                return super().load_overload(sig, target_context)
            except SPOILED:
                with contextlib.suppress(OSError):
                    self.flush()
                return None

        def save_overload(self, sig: Any, data: Any) -> None:
            with contextlib.suppress(*SPOILED):
                super().save_overload(sig, data)

    dispatcher._cache = Cache(function)
    return dispatcher


def compiled(signature: str) -> Callable[[Loop], Loop]:
    """Mark a loop to be compiled for arguments of these types, and no others.

    Parameters
    ----------
    signature : as numba reads it: f"void({ROWS}, int64, float64[::1])".
    """

    def mark(function: Loop) -> Loop:
        name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
        numba = _numba()
        if numba is None:
            states[name] = "plain"
            return function
        dispatcher = numba.njit(nogil=True, error_model="numpy")(function)
        place = folder()
        if place is not None:
            _keep(dispatcher, function, place)
        elif "compiled" not in states.values():
            say("No folder for compiled loops can be written: they are compiled again in every session.")
        compile_loop = dispatcher._compiler.compile

        def told(*types: Any) -> Any:
            with announce(f"Compiling {name}, once on this machine"):
                return compile_loop(*types)

        dispatcher._compiler.compile = told
        dispatcher.compile(signature)
        dispatcher.disable_compile()
        states[name] = "cached" if dispatcher.stats.cache_hits else "compiled"
        loop: Loop = dispatcher
        return loop

    return mark


def inlined(function: Loop) -> Loop:
    """Mark a small piece of a loop that is written into each loop that calls it, and is never compiled alone.

    What a loop takes from the folder of compiled ones is machine code, into which another loop cannot look; so without
    this, how fast a loop is would depend on what was compiled when.
    """
    numba = _numba()
    return function if numba is None else numba.njit(inline="always", nogil=True, error_model="numpy")(function)


@lru_cache(maxsize=1)
def _numba() -> Any:
    """numba, or None where loops are to stay plain Python."""
    if os.environ.get("COURSE_UNCOMPILED", "0") not in ("", "0"):
        return None
    try:
        return importlib.import_module("numba")
    except ImportError as error:
        say(f"numba cannot be imported ({error}): loops run as plain Python, slowly; `python3 course.py doctor` helps.")
        return None


def say(sentence: str) -> None:
    """Tell a person, on the standard error, unless COURSE_QUIET=1."""
    if os.environ.get("COURSE_QUIET", "0") in ("", "0"):
        print(sentence, file=sys.stderr)


def fill() -> dict[str, str]:
    """Compile every loop of the course that is not kept yet; what was done with each."""
    library = Path(__file__).parent
    for path in sorted(library.rglob("*_loops.py")):
        importlib.import_module(".".join((library.name, *path.relative_to(library).with_suffix("").parts)))
    return states


def threads() -> int:
    """How many threads a loop is given: the processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(job: Callable[[int, int], None], count: int, least: int = 1) -> None:
    """Run a job over all of range(count), in parts on several threads.

    Parameters
    ----------
    job : called with the first and the last (excluded) of a part; parts share nothing that is written.
    least : a part is not smaller.
    """
    most = max(1, count // max(1, least))
    workers = min(threads(), most)
    if workers == 1:
        job(0, count)
        return
    parts = min(PARTS * workers, most)
    edges = [count * part // parts for part in range(parts + 1)]
    waiting = iter(list(zip(edges, edges[1:], strict=False)))

    def work() -> None:
        for first, last in waiting:
            job(first, last)

    helpers = [_pool(workers - 1).submit(work) for _ in range(workers - 1)]
    try:
        work()  # this thread, too
    finally:
        for helper in helpers:
            if not helper.cancel():
                helper.result()


@lru_cache(maxsize=4)
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="loops")


if hasattr(os, "register_at_fork"):  # the threads of a pool stay behind in the parent
    os.register_at_fork(after_in_child=_pool.cache_clear)


if __name__ == "__main__":
    fill()
