"""Which modules of the course a module imports, read from its source and executing nothing."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path

LIBRARY = "course_lib"


def imported_names(source: str, package: Iterable[str], *, below: str = LIBRARY) -> set[str]:
    """The dotted names that a source imports anywhere, also inside functions; some are no modules.

    Parameters
    ----------
    source : Python.
    package : of the module, as parts: ("course_lib", "cloud"); for relative imports.
    below : only what lies below this package; "" for all.

    Examples
    --------
    >>> sorted(imported_names("from . import planes\nimport numpy", ("course_lib", "cloud")))
    ['course_lib.cloud', 'course_lib.cloud.planes']
    """
    package = list(package)
    found: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *((node.module or "").split(".") if node.module else [])])
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("importlib.import_module", "import_module"):
            if node.args and isinstance(node.args[0], ast.Constant):
                found.add(str(node.args[0].value))
    return {name for name in found if below in ("", name.split(".")[0])}


def imported(path: Path, root: Path) -> frozenset[Path]:
    """The files of the course's modules and packages that a module imports, those above each among them.

    Parameters
    ----------
    path : a module below root/course_lib.
    root : the folder that holds course_lib/.
    """
    return _imported(path, root, path.stat().st_mtime_ns)


@lru_cache(maxsize=1024)
def _imported(path: Path, root: Path, _changed: int) -> frozenset[Path]:
    package = path.relative_to(root).parts[:-1]
    names = imported_names(path.read_text(encoding="utf-8"), package) | {".".join(package)}
    found = set()
    for name in names:
        place = root.joinpath(*name.split("."))
        found |= {p for p in (place.with_suffix(".py"), place / "__init__.py") if p.is_file()}
        found |= {p / "__init__.py" for p in place.parents if root in p.parents and (p / "__init__.py").is_file()}
    return frozenset(found - {path})


def closure(files: Iterable[Path], root: Path, without: Callable[[Path], bool] = lambda path: False) -> list[Path]:
    """Files, and every module of the course that they import, directly or not, in order.

    Parameters
    ----------
    without : modules that are left out, with what only they import.
    """
    found: set[Path] = set()
    waiting = list(files)
    while waiting:
        path = waiting.pop()
        if path in found or not path.is_file() or without(path):
            continue
        found.add(path)
        waiting += imported(path, root) if path.suffix == ".py" else ()
    return sorted(found)
