"""What is wrong with an exercise that was run as learners get it."""

from __future__ import annotations

import re

from nbformat import NotebookNode

from course_lib.authoring import notebooks as nbs


def _task_of_check(source: str) -> str | None:
    match = re.search(r"\bcheck\(\s*[\"'](\d\d-\d+)[\"']", source)
    return match[1] if match else None


def stub_findings(nb: NotebookNode) -> list[str]:
    """What is wrong with an exercise that ran untouched under COURSE_STRICT=1, errors kept.

    Each check must end in its own task's NotImplementedError, and no other cell in any error.
    """
    found = []
    checks = 0
    for number, cell in enumerate(nb.cells):
        if cell.cell_type != "code":
            continue
        raised = [f"{output.ename}: {output.evalue}" for output in cell.outputs if output.output_type == "error"]
        task = _task_of_check(cell.source) if "check" in nbs.cell_tags(cell) else None
        if task is None:
            declared = "raises-exception" in nbs.cell_tags(cell)
            found += [] if declared else [f"cell {number} ({cell.id}) raises {error[:100]}" for error in raised]
            continue
        checks += 1
        wanted = f"NotImplementedError: Task {task.split('-')[1]}:"
        if not raised:
            found.append(f"cell {number} ({cell.id}): the check of the stub {task} raises nothing")
        found += [
            f"cell {number} ({cell.id}): the check of {task} raises {error[:100]}, not {wanted} …"
            for error in raised
            if not error.startswith(wanted)
        ]
    return found if checks else [*found, "it has no check"]
