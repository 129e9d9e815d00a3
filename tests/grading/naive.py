"""Graders with a defence removed: what many classrooms use. They are the controls that prove an attack real.

The usual one runs the notebook with nbval, `check` judges inside the learner's process, and green means points.
"""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path

from grading_helpers import ROOT

PLAIN_NBVAL = ("-m", "pytest", "-p", "nbval.plugin", "--nbval-lax", "-q", "-p", "no:cacheprovider")
NO_OTHER_PLUGINS = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
"""For its environment: what else is installed here is no part of the usual grader, and takes long to import."""


def run_nbval_on_each(folder: Path, given: Mapping[str, bytes], *more: str) -> dict[str, dict[str, str]]:
    """Run submissions as `COURSE_STRICT=1 pytest --nbval-lax` does in their own folder.

    Parameters
    ----------
    given : submissions by the names of their files, without .ipynb.
    more : words for pytest.

    Returns
    -------
    By the same names: cell to passed or failed, as the report says that pytest left.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in given.items():
        (folder / f"{name}.ipynb").write_bytes(data)
    environment = {**os.environ, "COURSE_STRICT": "1", "COURSE_QUIET": "1", "PYTHONPATH": str(ROOT), **NO_OTHER_PLUGINS}
    words = [*PLAIN_NBVAL, "--junitxml=out.xml", *more, *(f"{name}.ipynb" for name in given)]
    subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, timeout=120, check=False)
    results: dict[str, dict[str, str]] = {name: {} for name in given}
    for case in ET.parse(folder / "out.xml").iter("testcase"):
        file = case.attrib.get("classname", "").removesuffix(".ipynb")
        kinds = {child.tag for child in case}
        cells = next(iter(results.values())) if len(results) == 1 else results[file]
        cells[case.attrib["name"]] = "failed" if kinds & {"failure", "error"} else "passed"
    return results


def run_nbval(folder: Path, data: bytes, *more: str) -> dict[str, str]:
    """The same for one submission."""
    return run_nbval_on_each(folder, {"lab": data}, *more)["lab"]


def green(results: Mapping[str, str]) -> bool:
    """Whether the usual grader gives all points for this."""
    return bool(results) and set(results.values()) == {"passed"}
