"""What one submission may use while it is graded: limits.toml beside this module, with a comment a line."""

from __future__ import annotations

import tomllib
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from course_lib.authoring.tree import CourseError, nearest

__all__ = ["Limits", "read_limits"]

DEFAULT = Path(__file__).with_name("limits.toml")


@dataclass(frozen=True)
class Limits:
    """Seconds, megabytes (of a million bytes) and counts; each is explained in limits.toml."""

    read_seconds: float
    read_mb: float
    start_seconds: float
    cell_seconds: float
    task_seconds: float
    total_seconds: float
    grace_seconds: float
    memory_mb: float
    runner_mb: float
    processes: int
    threads: int
    output_mb: float
    message_mb: float
    answer_mb: float
    file_mb: float
    folder_mb: float
    open_files: int

    def as_dict(self) -> dict[str, float]:
        """The limits as plain numbers, for a job."""
        return asdict(self)

    def but(self, **changed: float) -> Limits:
        """These limits with some changed."""
        return replace(self, **changed)

    @staticmethod
    def from_dict(values: dict[str, Any]) -> Limits:
        """Limits of a job; what is missing is as in limits.toml."""
        return replace(read_limits(), **values)


def read_limits(path: Path | None = None) -> Limits:
    """The limits of limits.toml, with those of a file of the same form in their place.

    Raises
    ------
    CourseError
        If the file cannot be read, names an unknown limit, or gives one that is not a number above 0.
    """
    values = _read(DEFAULT)
    if path is not None:
        values |= _read(path)
    return Limits(**values)


def _read(path: Path) -> dict[str, float]:
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise CourseError(f"the limits {path} cannot be read: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CourseError(f"the limits {path} are not TOML: {error}.") from error
    known = [field.name for field in fields(Limits)]
    for name, value in values.items():
        if name not in known:
            raise CourseError(f"{path.name}: there is no limit {name!r}.{nearest(name, known)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
            raise CourseError(f"{path.name}: {name} = {value!r} must be a number above 0.")
    return values
