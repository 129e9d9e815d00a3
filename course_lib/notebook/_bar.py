"""A progress bar that is there only while a person watches, and leaves nothing behind: no text, no dead widget."""

from __future__ import annotations

import html
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from tqdm import tqdm

from course_lib.notebook import _places


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
        return self.step if _places.live() else lambda done, total: None

    def step(self, done: int, total: int) -> None:
        """Show that `done` of `total` steps are behind."""
        if not _places.in_kernel():
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
