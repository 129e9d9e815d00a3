"""Running a notebook in a fresh kernel of this environment, in the same surroundings for building and for proving."""

from __future__ import annotations

import copy
import os
import re
import sys
import tempfile
from pathlib import Path

import ipykernel.kernelspec
from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError, CellTimeoutError, DeadKernelError
from nbformat import NotebookNode

from .notebooks import cell_tags
from .tree import CourseError

CELL_SECONDS = 60
START_SECONDS = 120


class CellFailed(CourseError):
    """A cell raised, hung, or took its kernel with it: `cell` is its place in the notebook, `line` counts from 1."""

    def __init__(self, cell: int, message: str, line: int = 1) -> None:
        super().__init__(message)
        self.cell = cell
        self.line = line


class _ThisEnvironment(KernelSpecManager):
    """Knows one kernel, python3: the interpreter that runs this process."""

    def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
        return KernelSpec(resource_dir=ipykernel.kernelspec.RESOURCES, **ipykernel.kernelspec.get_kernel_dict())


def kernel_environment(root: Path, private: Path, *, strict: bool = False) -> dict[str, str]:
    """The environment variables of a kernel.

    Threads stay at their defaults, as on a learner's machine: a cell that needs one thread pins it itself.

    Parameters
    ----------
    root : the course's root, so that `import course_lib` works from any folder.
    private : an empty folder for IPython's profile, so that nobody's own start-up files change an output.
    strict : make `check` raise where a task is not solved.
    """
    environment = {key: value for key, value in os.environ.items() if key not in ("COURSE_STRICT", "PYTHONSTARTUP")}
    environment.update(
        PYTHONPATH=os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")])),
        PYTHONHASHSEED="0",
        PYTHONUTF8="1",
        PYDEVD_DISABLE_FILE_VALIDATION="1",
        IPYTHONDIR=str(private),
        COURSE_QUIET="1",
    )
    if strict:
        environment["COURSE_STRICT"] = "1"
    return environment


def _line_in_cell(traceback: str) -> int:
    """The line of the failing cell itself that IPython's traceback names, counted from 1."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", traceback)
    match = re.search(r"Cell In\[\d+\], line (\d+)", plain) or re.search(r"^-+> (\d+) ", plain, re.M)
    return int(match[1]) if match else 1


def execute(
    nb: NotebookNode,
    root: Path,
    *,
    strict: bool = False,
    go_on: bool = False,
    cell_seconds: int = CELL_SECONDS,
) -> NotebookNode:
    """Run every code cell of a notebook in place, in a fresh kernel, and return the notebook.

    Parameters
    ----------
    nb : changed in place: outputs and execution counts.
    root : the course's root.
    strict : run with COURSE_STRICT=1.
    go_on : keep error outputs and go on, instead of stopping at the first.
    cell_seconds : the longest a cell may take.

    Raises
    ------
    CellFailed
        If a cell raises (and is not tagged raises-exception), takes too long, or kills its kernel.
    """
    metadata = copy.deepcopy(nb.metadata)
    with (
        tempfile.TemporaryDirectory(prefix="course-", ignore_cleanup_errors=True) as name,
        tempfile.TemporaryFile("w+", encoding="utf-8") as said,
    ):
        folder = Path(name)
        for part in ("run", "ipython"):  # an empty one (a cell must not rely on where it runs), and IPython's own
            (folder / part).mkdir()
        manager = AsyncKernelManager(
            kernel_name="python3",
            kernel_spec_manager=_ThisEnvironment(),
            connection_file=str(folder / "k.json"),
            transport="tcp" if sys.platform == "win32" else "ipc",
        )
        client = NotebookClient(
            nb,
            km=manager,
            timeout=cell_seconds,
            startup_timeout=START_SECONDS,
            allow_errors=go_on,
            record_timing=False,
            coalesce_streams=True,
            resources={"metadata": {"path": str(folder / "run")}},
        )
        running = {"cell": 0}
        client.on_cell_execute = lambda cell, cell_index: running.update(cell=cell_index)
        environment = kernel_environment(root, folder / "ipython", strict=strict)
        try:
            client.execute(env=environment, stdout=said, stderr=said, cleanup_kc=True)
        except CellExecutionError as error:
            message = f"{error.ename}: {error.evalue}".strip()[:600]
            raise CellFailed(running["cell"], message, _line_in_cell(error.traceback)) from error
        except CellTimeoutError as error:
            raise CellFailed(running["cell"], f"the cell took longer than {cell_seconds} s.") from error
        except DeadKernelError as error:
            said.seek(0)
            last = "\n".join(said.read().splitlines()[-5:])
            raise CellFailed(running["cell"], f"the kernel died in this cell. {last}".strip()) from error
    nb.metadata = metadata
    _normalise(nb)
    return nb


def _normalise(nb: NotebookNode) -> None:
    """Take out of a run notebook what differs from run to run: counts that jump, timings, transient metadata."""
    count = 0
    for cell in nb.cells:
        if cell.cell_type != "code":
            continue
        count += 1
        cell.execution_count = count
        cell.metadata.pop("execution", None)
        for output in cell.outputs:
            output.pop("transient", None)
            if output.output_type == "execute_result":
                output.execution_count = count
            if output.output_type in ("execute_result", "display_data"):
                output.data = {
                    key: value.rstrip("\n") if key.startswith("image/") and isinstance(value, str) else value
                    for key, value in output.data.items()
                }
            if output.output_type == "error" and "raises-exception" in cell_tags(cell):
                output.traceback = [f"{output.ename}: {output.evalue}"]
