"""Graders with a defence removed: what many classrooms use. They are the controls that prove an attack real.

The usual one runs the notebook with nbval, `check` judges inside the learner's process, and green means points.
"""

from __future__ import annotations

import os
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

from grading_helpers import ROOT


def run_nbval(folder: Path, data: bytes, name: str = "lab.ipynb") -> dict[str, str]:
    """Run a submission as `COURSE_STRICT=1 pytest --nbval-lax` does in its own folder: cell to passed or failed."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)
    environment = {**os.environ, "COURSE_STRICT": "1", "COURSE_QUIET": "1", "PYTHONPATH": str(ROOT)}
    environment.pop("PYTEST_DISABLE_PLUGIN_AUTOLOAD", None)
    words = [
        "-m",
        "pytest",
        "--nbval-lax",
        "-q",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:xdist",
        "--junitxml=out.xml",
        name,
    ]
    subprocess.run([sys.executable, *words], cwd=folder, env=environment, capture_output=True, timeout=120, check=False)
    results = {}
    for case in ET.parse(folder / "out.xml").iter("testcase"):
        kinds = {child.tag for child in case}
        results[case.attrib["name"]] = "failed" if kinds & {"failure", "error"} else "passed"
    return results


def naive_green(folder: Path, data: bytes) -> bool:
    """Whether the usual grader gives this submission all its points."""
    results = run_nbval(folder, data)
    return bool(results) and set(results.values()) == {"passed"}
