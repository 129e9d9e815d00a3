"""Where things lie in the house: folders, the sources of lessons and labs, and how a person names them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from course_lib.notebook._errors import Refusal, nearest


class CourseError(Refusal):
    """Something a person can mend; the message is one sentence and is printed without a traceback."""


@dataclass(frozen=True)
class Source:
    """One py:percent file and the notebooks that are made from it."""

    kind: Literal["lesson", "lab"]
    path: Path
    notebook: Path  # executed: the lesson, or the lab's solution
    exercise: Path | None  # a lab as learners get it

    @property
    def name(self) -> str:
        """The shared name of a lesson and its lab, for example 03_depth_to_points."""
        return self.path.stem

    @property
    def number(self) -> str:
        """The two digits that the name starts with."""
        return self.name[:2]

    @property
    def notebooks(self) -> tuple[Path, ...]:
        """Every notebook that is made from this source."""
        return (self.notebook,) if self.exercise is None else (self.notebook, self.exercise)


def _folder(name: str) -> Any:
    """A property of `Tree` that gives a folder of the house."""
    return property(lambda tree: tree.root / name)


@dataclass(frozen=True)
class Tree:
    """The folders of one copy of the course. Tests make their own; there is no global one."""

    root: Path
    lessons_folder = _folder("notebooks")
    solutions_folder = _folder("solutions")
    exercises_folder = _folder("exercises")
    tests_folder = _folder("tests")
    docs_folder = _folder("docs")

    def lessons(self) -> list[Source]:
        """Every lesson that has a source, in order."""
        folder = self.lessons_folder
        return [
            Source("lesson", path, folder / f"{path.stem}.ipynb", None)
            for path in sorted((folder / "source").glob("[0-9][0-9]_*.py"))
        ]

    def labs(self) -> list[Source]:
        """Every lab that has a source, in order."""
        folder = self.solutions_folder
        return [
            Source("lab", path, folder / f"{path.stem}.ipynb", self.exercises_folder / f"{path.stem}.ipynb")
            for path in sorted((folder / "source").glob("[0-9][0-9]_*.py"))
        ]

    def sources(self) -> list[Source]:
        """Every lesson and then every lab."""
        return self.lessons() + self.labs()

    def relative(self, path: Path) -> str:
        """A path as a person reads it, from the root, with forward slashes."""
        return path.resolve().relative_to(self.root.resolve()).as_posix()

    def find(self, names: Iterable[str]) -> list[Source]:
        """Find sources by number (03), name (03_depth_to_points), or the path of a source or notebook.

        A number or name means the lesson and its lab; no names mean everything.

        Raises
        ------
        CourseError
            If a name fits nothing; the nearest is suggested.
        """
        names = list(names)
        return list(dict.fromkeys(one for name in names for one in self._fitting(name))) if names else self.sources()

    def _fitting(self, name: str) -> list[Source]:
        sources = self.sources()
        path = Path(name)
        if len(path.parts) > 1:
            wanted = {path.resolve(), (self.root / path).resolve()}
            fitting = [s for s in sources if wanted & {place.resolve() for place in (s.path, *s.notebooks)}]
        else:
            stem = re.sub(r"\.(py|ipynb)$", "", name)
            fitting = [s for s in sources if stem == s.name or (stem.isdigit() and stem.zfill(2) == s.number)]
        if not fitting:
            known = sorted({s.name for s in sources})
            names = ", ".join(known) or "none yet"
            raise CourseError(f"there is no lesson or lab called {name!r}.{nearest(name, known)} Known: {names}.")
        return fitting


def course_tree() -> Tree:
    """The copy of the course that this file belongs to."""
    return Tree(Path(__file__).resolve().parents[2])
