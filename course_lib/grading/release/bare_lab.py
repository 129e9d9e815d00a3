"""A lab's modules as a release holds them: judges, and nothing that draws cases, makes their truth or answers wrongly.

Public cases, mistakes and keys become data (see `tasks/released_cases.py`); of the modules stays what the tasks still
name, statement by statement, as it stood.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from course_lib import tasks
from course_lib.tasks.private import private_tasks
from course_lib.tasks.released_cases import FILE, cases_file

__all__ = ["bare_lab"]

MAKERS = {"Task", "which_cause", "in_words"}


def bare_lab(number: str, root: Path, wanted: Iterable[str]) -> dict[Path, bytes]:
    """The files of a lab's package, bare.

    Parameters
    ----------
    number : "03".
    root : the folder that holds course_lib/.
    wanted : dotted names of the package that a notebook imports.
    """
    (folder,) = (root / "course_lib/tasks/labs").glob(f"lab_{number}_*")
    package = f"course_lib.tasks.labs.{folder.name}"
    lab = [task for task in tasks.lab(number) if task not in private_tasks(number)]
    choices = {task.id: _choices(task) for task in lab if task.kind == "which"}
    texts = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.py")}
    modules = {f"{package}.{name}": _Module(_told_by_data(text, choices)) for name, text in texts.items()}
    _mark(modules, [f"{package}.tasks.TASKS", *wanted])
    files = {folder / FILE: cases_file(lab, choices)}
    for name, module in modules.items():
        if module.kept or name.endswith(("__init__", ".tasks")):
            files[folder / f"{name.rpartition('.')[2]}.py"] = module.text().encode()
    files |= {path: path.read_bytes() for path in folder.glob("*.npz") if path.name != FILE}
    return files


def _choices(task: tasks.Task) -> list[str]:
    """What may be chosen, in the order of the list: the judge says it of a cause that is none."""
    (case,) = task.public(None)
    text = task.judge(case, dict.fromkeys(case.truth, "?")).message.partition("the choices are ")[2]
    return list(ast.literal_eval(f"[{text.removesuffix('.')}]"))


def _told_by_data(text: str, choices: Mapping[str, list[str]]) -> str:
    """A module whose tasks ask for their data by their ids."""
    tree = ast.parse(text)
    edits: list[tuple[ast.expr, str]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in MAKERS:
            named = {word.arg: word.value for word in node.keywords}
            name = ast.literal_eval(named["id"] if "id" in named else node.args[0])
            if node.func.id == "which_cause":
                edits.append((node.args[2], f"released_cases.key({name!r})"))
                edits.append((node.args[4], f"released_cases.mistakes({name!r})"))
            for word, value in named.items():
                if word in ("cases", "guess"):
                    edits.append((value, "released_cases.drawn_by_the_grader"))
                elif word == "misconceptions":
                    edits.append((value, f"released_cases.mistakes({name!r})"))
                elif word == "causes" and name in choices:
                    edits.append((value, repr(tuple(choices[name]))))
    if not edits:
        return text
    lines = text.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    data = b"".join(lines)
    for node, new in sorted(edits, key=lambda edit: (edit[0].lineno, edit[0].col_offset), reverse=True):
        begin, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        data = data[:begin] + new.encode() + data[end:]
    future = "from __future__ import annotations\n"
    return data.decode().replace(future, f"{future}\nfrom course_lib.tasks import released_cases\n", 1)


@dataclass
class _Module:
    """A module's text, its statements, and which of them are kept."""

    source: str
    kept: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.body = ast.parse(self.source).body
        self.homes: dict[str, str] = {}
        self.places: dict[str, list[int]] = {}
        for i, node in enumerate(self.body):
            if isinstance(node, ast.ImportFrom):
                self.homes |= {a.asname or a.name: f"{node.module}.{a.name}" for a in node.names}
            else:
                for name in _bound(node):
                    self.places.setdefault(name, []).append(i)

    def used(self) -> set[str]:
        """The names that what is kept mentions."""
        return set().union(*(_names(self.body[i]) for i in self.kept))

    def text(self) -> str:
        """What is kept, as it stood, and the imports that it needs."""
        lines, used, parts = self.source.split("\n"), self.used(), []
        for i, node in enumerate(self.body):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                future = isinstance(node, ast.ImportFrom) and node.module == "__future__"
                node.names = [a for a in node.names if future or (a.asname or a.name.split(".")[0]) in used]
                if node.names:
                    parts.append(ast.unparse(node))
            elif i in self.kept or (i == 0 and isinstance(node, ast.Expr)):
                first = min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])
                gap = "\n\n" if isinstance(node, (ast.FunctionDef, ast.ClassDef)) else ""
                parts.append(gap + "\n".join(lines[first - 1 : node.end_lineno]))
        return "\n".join(parts) + "\n"


def _mark(modules: dict[str, _Module], names: Iterable[str]) -> None:
    """Keep what binds some dotted names, and whatever that needs."""
    waiting, seen = list(names), set()
    while waiting:
        dotted = waiting.pop()
        home, _, name = dotted.rpartition(".")
        if dotted in seen or home not in modules:
            continue
        seen.add(dotted)
        module = modules[home]
        if name in module.homes:
            waiting.append(module.homes[name])
        for i in module.places.get(name, ()):
            module.kept.add(i)
            waiting += [f"{home}.{used}" for used in _names(module.body[i])]
            waiting += [f"{module.homes[name]}.{part}" for name, part in _parts(module.body[i]) if name in module.homes]


def _bound(node: ast.stmt) -> set[str]:
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        return {node.name}
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}


def _parts(node: ast.AST) -> set[tuple[str, str]]:
    """What is mentioned of names, such as of a module that was imported whole."""
    inside = [n for n in ast.walk(node) if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)]
    return {(n.value.id, n.attr) for n in inside if isinstance(n.value, ast.Name)}


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
