"""A cell calls: `from course_lib.notebook import check, data, files, picture, predict, report, report_table, show`;
names are imported when first used. Importing the package in IPython also makes cells that begin with
`# real data: NAME` show a "skipped" card where that dataset is not on this machine, so that Run All goes on.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

# name: (module that holds it, name there; None for the module itself)
_PARTS: dict[str, tuple[str, str | None]] = {
    "check": ("check", "check"),
    "data": ("data", None),
    "files": ("files", None),
    "picture": ("show", "picture"),
    "predict": ("predict", "predict"),
    "report": ("report", "report"),
    "report_table": ("report", "report_table"),
    "show": ("show", "show"),
}
__all__ = ["check", "data", "files", "picture", "predict", "report", "report_table", "show"]


def __getattr__(name: str) -> object:
    """Import a part when it is first asked for (PEP 562)."""
    if name not in _PARTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module_name, inside = _PARTS[name]
    module = importlib.import_module(f"{__name__}.{module_name}")
    part = module if inside is None else getattr(module, inside)
    globals()[name] = part
    return part


def __dir__() -> list[str]:
    return sorted({*globals(), *_PARTS})


class _Package(ModuleType):
    """Keeps `notebook.report` the function, where importing the submodule of that name would put the module."""

    def __setattr__(self, name: str, value: object) -> None:
        module_name, inside = _PARTS.get(name, ("", None))
        if inside is not None and isinstance(value, ModuleType):
            if module_name != name or not hasattr(value, inside):
                return
            value = getattr(value, inside)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if "IPython" in sys.modules:
    from course_lib.notebook._cells import register

    register()
