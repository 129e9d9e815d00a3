"""The lessons of the course, there or to come: notebooks/source/NN_name.toml says what each is for."""

from __future__ import annotations

import functools
import tomllib
from dataclasses import dataclass
from pathlib import Path

from course_lib.notebook._errors import Refusal

SOURCES = Path(__file__).resolve().parents[2] / "notebooks" / "source"


@dataclass(frozen=True)
class Stage:
    """One row of the course's running error budget: an error that adds to the error of a surface.

    Attributes
    ----------
    order : where it stands: errors of pixels first, then of depth, of registration, of the surface.
    key : how lessons name it.
    name : what it is, in the table.
    unit : of the measured value.
    lesson : which lesson measures it.
    announced : whether lessons before it show the row, too; else adding the lesson would change what they have stored.
    """

    order: int
    key: str
    name: str
    unit: str
    lesson: str
    announced: bool = False


@dataclass(frozen=True)
class Lesson:
    """One lesson.

    Attributes
    ----------
    name : 07_icp.
    title : ICP.
    does : what a person can do after it.
    minutes, lab_minutes : of its core, and of its lab.
    stages : the rows of the error budget that it measures.
    """

    name: str
    title: str
    does: str = ""
    minutes: int = 0
    lab_minutes: int = 0
    stages: tuple[Stage, ...] = ()

    @property
    def number(self) -> str:
        """07."""
        return self.name[:2]


@functools.cache
def _read(path: Path, _changed: int) -> Lesson:
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        stages = tuple(Stage(lesson=path.stem, **row) for row in table.pop("budget", []))
        return Lesson(path.stem, stages=stages, **table)
    except (tomllib.TOMLDecodeError, TypeError) as error:
        raise Refusal(f"{path.name} cannot be read ({error}): mend notebooks/source/{path.name}.") from error


def lessons(folder: Path = SOURCES) -> list[Lesson]:
    """Every lesson in order, also those to come."""
    return [_read(path, path.stat().st_mtime_ns) for path in sorted(folder.glob("[0-9][0-9]_*.toml"))]


def stages() -> list[Stage]:
    """The rows of the error budget, in the order in which errors arise."""
    return sorted((stage for lesson in lessons() for stage in lesson.stages), key=lambda stage: stage.order)
