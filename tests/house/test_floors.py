"""The house is a tower: a room imports only from floors below its own, no modules import each other in a ring."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

import course_lib
from course_lib.grading.module_graph import imported, imported_names
from course_lib.tasks.core import LIBRARY

ROOT = Path(course_lib.__file__).parent
HOME = ROOT.parent
# from the ground up; rooms of one floor do not import each other
FLOORS = (
    ("checks", "compiled"),
    ("geometry",),
    ("camera",),
    ("cloud",),
    ("surface",),
    ("registration",),
    ("robot",),
    ("simulate",),
    ("tasks",),
    ("notebook",),
    ("programs",),
    ("authoring",),
    ("grading",),
    ("bench",),
    ("launch",),
    ("cli",),
)
FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}
BOOTSTRAP = ("launch", "bootstrap")  # no room: what runs before there is an environment belongs to course.py
MODULES = sorted(path for path in ROOT.rglob("*.py"))


def name_of(path: Path) -> str:
    parts = path.relative_to(HOME).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def room_of(name: str) -> str:
    """The room of a dotted name below course_lib; "" for the package itself."""
    return name.split(".")[1] if "." in name else ""


def violations(name: str, source: str, package: str) -> list[str]:
    """What a module imports from its own floor's neighbours or from above."""
    own = room_of(name)
    found = []
    for target in sorted(imported_names(source, package.split("."))):
        room = room_of(target)
        if room not in FLOOR_OF or room == own or target.split(".")[1:3] == list(BOOTSTRAP):
            continue
        if own == "" or FLOOR_OF[room] >= FLOOR_OF[own]:
            found.append(f"{name} imports {target}")
    return found


def test_modules_import_only_from_floors_below():
    found = []
    for path in MODULES:
        package = ".".join(path.relative_to(HOME).parts[:-1])
        found += violations(name_of(path), path.read_text(encoding="utf-8"), package)
    assert not found


STEPS = ("release", "intake", "ledger", "run", "tell", "verbs")


def test_a_step_of_grading_imports_only_from_steps_before():
    home = ROOT / "grading"
    for path in sorted(home.rglob("*.py")):
        own = path.relative_to(home).parts[0]
        targets = {to.relative_to(home).parts[0] for to in imported(path, HOME) if home in to.parents}
        later = STEPS[STEPS.index(own) + 1 :] if own in STEPS else STEPS
        assert not targets & set(later), name_of(path)


def test_every_room_has_a_floor():
    rooms = {path.relative_to(ROOT).parts[0].removesuffix(".py") for path in MODULES} - {"__init__"}
    assert rooms <= set(FLOOR_OF)


PAIRS = [(low, high) for low in FLOOR_OF for high in FLOOR_OF if low != high and FLOOR_OF[low] <= FLOOR_OF[high]]


def test_the_proof_sees_every_import_from_above_and_beside():
    """Every pair of rooms, in each form of an import."""
    for low, high in PAIRS:
        for source in (
            f"from course_lib import {high}",
            f"import course_lib.{high}.x",
            f"def f():\n    from course_lib.{high}.x import y",
            f"from ..{high} import x",
            f"import importlib\nimportlib.import_module('course_lib.{high}.x')",
        ):
            assert len(set(violations(f"course_lib.{low}.m", source, f"course_lib.{low}"))) >= 1, source
            if FLOOR_OF[low] < FLOOR_OF[high]:
                below = source.replace(high, low)
                assert violations(f"course_lib.{high}.m", below, f"course_lib.{high}") == [], below


def test_no_modules_import_each_other_in_a_ring():
    """Packages above a module do not count: Python imports them first, and they import nothing of what lies in them."""
    graph = {
        path: {
            target for target in imported(path, HOME) if target.name != "__init__.py" or target.parent != path.parent
        }
        for path in MODULES
    }
    graph = {
        path: {t for t in targets if t.parent not in path.parents or t.name != "__init__.py"}
        for path, targets in graph.items()
    }
    done: set[Path] = set()

    def walk(path: Path, trail: tuple[Path, ...]) -> list[Path]:
        if path in trail:
            return [*trail[trail.index(path) :], path]
        if path in done:
            return []
        for target in sorted(graph[path]):
            if ring := walk(target, (*trail, path)):
                return ring
        done.add(path)
        return []

    rings = [ring for path in MODULES if (ring := walk(path, ()))]
    assert not rings, " -> ".join(name_of(path) for path in rings[0])


def test_the_library_reads_no_files_and_prints_nothing():
    for path in (p for p in MODULES if p.relative_to(ROOT).parts[0] in LIBRARY):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
        assert not calls & {"print", "open", "input", "exec", "eval"}, name_of(path)


def test_a_package_says_in_one_paragraph_what_is_in_it():
    for path in (p for p in MODULES if p.name == "__init__.py"):
        said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        assert 30 < len(said) and (path.parent == ROOT or "\n\n" not in said), name_of(path)


def test_no_module_is_over_300_lines():
    long = {name_of(path): n for path in MODULES if (n := len(path.read_text(encoding="utf-8").splitlines())) > 300}
    assert not long


# --- Names that stand as text, which no import test sees --------------------------------------------------------------

TEXTS = sorted(
    path
    for pattern in (
        *("course_lib/**/*.py", "tests/**/*.py", "notebooks/source/*", "solutions/source/*", "docs/*.md"),
        *("*.md", "*.toml", "course.py", "LICENSE", "datasets/*.md", "datasets/*.toml", "solutions/**/*.md"),
    )
    for path in HOME.glob(pattern)
    if path.is_file() and "fixtures" not in path.parts and path not in (Path(__file__), ROOT / "__init__.py")
)
DOTTED = re.compile(r"(?<![\w/])course_lib((?:\.[a-zA-Z_]\w*)+)")
FILES = re.compile(r"(?<![\w.])course_lib/[\w/]*(?:\.\w+)?")
IMPORTED = re.compile(r"from (course_lib[\w.]*) import \(?([\w ,]+)")
# a file of that name, attributes, and what tests and the guide invent
INVENTED = re.compile(r"course_lib\.(?:py$|__file__$|__path__$|.*\bno_such|tasks\.labs\.lab_NN)")


def exists(dotted: str) -> bool:
    """Whether a dotted name is a module of the course, or something defined or imported at the top of one."""
    parts = dotted.split(".")
    for length in range(len(parts), 0, -1):
        place = HOME.joinpath(*parts[:length])
        path = place.with_suffix(".py") if place.with_suffix(".py").is_file() else place / "__init__.py"
        if not path.is_file():
            continue
        if length == len(parts):
            return True
        return parts[length] in _names(path)
    return False


@cache
def _names(path: Path) -> set[str]:
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            found.add(node.name)
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            found |= {(alias.asname or alias.name).split(".")[0] for alias in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
        elif isinstance(node, ast.Constant) and path.name == "__init__.py":
            found.add(str(node.value))  # what a lazy package gives out
    return found


def test_names_of_the_library_in_texts_are_names_that_exist():
    for path in TEXTS:
        text = path.read_text(encoding="utf-8")
        names = {f"course_lib{match[1]}" for match in DOTTED.finditer(text)}
        for match in IMPORTED.finditer(text):
            names |= {f"{match[1]}.{name.split(' as ')[0].strip()}" for name in match[2].split(",") if name.strip()}
        wrong = [name for name in sorted(names) if not exists(name) and not INVENTED.match(name)]
        files = {match[0].rstrip("/.") for match in FILES.finditer(text)}
        wrong += [name for name in sorted(files) if not re.search("NN|NAME", name) and not (HOME / name).exists()]
        assert not wrong, path.relative_to(HOME)
