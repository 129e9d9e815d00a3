"""A cell calls: `from course_lib.notebook import check, data, files, picture, predict, report, report_table, show`;
names are imported when first used. Importing the package in IPython also makes cells that begin with
`# real data: NAME` show what is stored of them where that dataset is not on this machine, so that Run All goes on.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

_PARTS = {  # which module holds it
    "check": "check",
    "data": "data",
    "files": "files",
    "picture": "show",
    "predict": "predict",
    "report": "report",
    "report_table": "report",
    "show": "show",
}
__all__ = ["check", "data", "files", "picture", "predict", "report", "report_table", "show"]


def __getattr__(name: str) -> object:
    """Import a part when it is first asked for (PEP 562)."""
    if name not in _PARTS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = importlib.import_module(f"{__name__}.{_PARTS[name]}")
    part = globals()[name] = getattr(module, name, module)
    return part


def __dir__() -> list[str]:
    return sorted({*globals(), *_PARTS})


class _Package(ModuleType):
    """Keeps `notebook.report` the function, where importing the submodule of that name would put the module."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in _PARTS and isinstance(value, ModuleType):
            value = getattr(value, name, value)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if "IPython" in sys.modules:
    from course_lib.notebook._cells import register

    register()
