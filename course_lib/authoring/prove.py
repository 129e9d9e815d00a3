"""`course test`: one pytest run over the library, the tools, and every stored lesson and solution through nbval."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from course_lib import compiled
from course_lib.notebook._words import count

from . import notebooks as nbs
from . import proof_plugin
from .kernels import CELL_SECONDS, START_SECONDS, kernel_environment
from .needed_data import make_side_by_side, missing_data
from .tree import CourseError, Source, Tree

QUICK_LABS = 2
COPIES = "course"  # pytest names a copy by its path below this folder: notebooks/01_name.ipynb
LEFT_OUT = {"quick": "not slow and not thorough", "all": "not thorough", "thorough": ""}  # tests, by their marks

# Our own settings: a pytest.ini or pyproject.toml beside a notebook must not change what is proved.
INI = """\
[pytest]
timeout = {seconds}
norecursedirs = fixtures source .*
markers =
    slow: left out by --quick
    thorough: only with --thorough
filterwarnings =
    ignore::DeprecationWarning
"""


@dataclass(frozen=True)
class Skipped:
    """Real-data cells whose outputs cannot be compared, because their data are not there."""

    cells: int
    notebooks: int
    datasets: tuple[str, ...]

    @property
    def line(self) -> str:
        """What was not compared, and why; "" where everything was."""
        if not self.cells:
            return ""
        mirror = os.environ.get("COURSE_DATA_MIRROR")
        why = f"{mirror} and the cache lack {', '.join(self.datasets)}" if mirror else "COURSE_DATA_MIRROR is not set"
        return f"{count(self.cells, 'real-data cell')} in {count(self.notebooks, 'notebook')} skipped: {why}"


def copy_notebooks(notebooks: Iterable[Path], tree: Tree, folder: Path, missing: Callable[..., set[str]]) -> Skipped:
    """Copy notebooks, and free real-data cells whose data are missing from the comparison.

    Parameters
    ----------
    notebooks : stored notebooks; one that cannot be read is left out (its gate says why).
    folder : where the copies go, in the same folders as in the course.
    missing : given names of datasets, those that are not there.
    """
    cells = changed = 0
    lacking: set[str] = set()
    for path in notebooks:
        try:
            nb = nbs.read_notebook(path)
        except CourseError:
            continue
        before = cells
        for cell in nb.cells:
            names = missing(nbs.real_data_of(cell)) if cell.cell_type == "code" else set()
            if names:
                cell.metadata["tags"] = [*nbs.cell_tags(cell), "nbval-ignore-output"]
                lacking |= names
                cells += 1
        changed += cells > before
        nbs.write_notebook(folder / tree.relative(path), nb)
    return Skipped(cells, changed, tuple(sorted(lacking)))


def proved(tree: Tree, depth: str) -> list[Source]:
    """The lessons and labs of a proof: all, or of a quick one the first lesson and the first labs."""
    lessons, labs = tree.lessons(), tree.labs()
    return lessons[:1] + labs[:QUICK_LABS] if depth == "quick" else lessons + labs


def _left_out(tree: Tree, depth: str) -> list[str]:
    """What is not run: tests by their marks; if quick, also tasks of later labs, by files and by ids such as [03-2]."""
    words = ["-m", LEFT_OUT[depth]] if LEFT_OUT[depth] else []
    if depth != "quick":
        return words
    later = [lab.number for lab in tree.labs()[QUICK_LABS:]]
    files = [path for number in later for path in (tree.tests_folder / "tasks").glob(f"test_lab_{number}*.py")]
    ids = ["-k", " and ".join(f"not [{number}{end}" for number in later for end in "-]")] if later else []
    return [*(f"--ignore={path}" for path in files), *ids, *words]


def pytest_words(tree: Tree, folder: Path, depth: str, workers: int, more: Sequence[str]) -> list[str]:
    """The one pytest command of a proof, its settings taken from nowhere but here."""
    ini = folder / "prove.ini"
    ini.write_text(INI.format(seconds=1800 if depth == "thorough" else 300), encoding="utf-8")
    return [
        *(sys.executable, "-P", "-m", "pytest", "-c", str(ini), "--rootdir", str(tree.root)),
        *("-p", "no:cacheprovider", "-p", "no:dash", "-p", proof_plugin.__name__, "-q", "--color=no", "--durations=8"),
        *("-n", str(workers), "--dist", "loadfile", "--no-loadscope-reorder"),  # the long ones, notebooks, come first
        *("--nbval", "--nbval-current-env", f"--nbval-cell-timeout={CELL_SECONDS}"),
        f"--nbval-kernel-startup-timeout={START_SECONDS}",
        *_left_out(tree, depth),
        *more,
        *(str(place) for place in (folder / COPIES, tree.tests_folder) if place.exists()),
    ]


def prove(tree: Tree, depth: str, workers: int, more: Sequence[str], say: Callable[[str], None]) -> int:
    """Run the proof and return pytest's exit code.

    Parameters
    ----------
    depth : "quick" (the library, the tools, the first lesson and the first labs), "all", or "thorough" (with many more
        drawings and repetitions).
    workers : processes; each runs one file, and so one notebook's kernel, at a time.
    more : further words for pytest.
    say : prints a line.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a shell's background: Ctrl-C could not be tested
        signal.signal(signal.SIGINT, signal.default_int_handler)
    began = time.monotonic()
    subprocess.run([sys.executable, "-P", "-m", compiled.__name__], check=True)
    compiled_at = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="course-test-", ignore_cleanup_errors=True) as name:
        folder = Path(name)
        stored = [source.notebook for source in proved(tree, depth) if source.notebook.exists()]
        skipped = copy_notebooks(stored, tree, folder / COPIES, missing_data)
        copies = [nbs.read_notebook(path) for path in sorted((folder / COPIES).rglob("*.ipynb"))]
        make_side_by_side([*dict.fromkeys(name for nb in copies for name in nbs.named_datasets(nb))], workers)
        made_at = time.monotonic()
        (folder / "ipython").mkdir()
        environment = kernel_environment(tree.root, folder / "ipython")
        environment.update(JUPYTER_RUNTIME_DIR=str(folder / "run"), COURSE_PROOF=depth)
        words = pytest_words(tree, folder, depth, workers, more)
        if skipped.cells:
            say(skipped.line)  # before the run: what pytest says stands last
        say(f"loops compiled ... {compiled_at - began:5.1f} s\ndata made ........ {made_at - compiled_at:5.1f} s")
        return subprocess.run(words, env=environment, cwd=tree.root, check=False).returncode
