"""What wrong answers give on the public cases of a lab: made when the lab is built and kept beside its tasks.

So a learner's session runs no wrong answer and needs no reference to know a mistake or a slip again. Of a large answer
some numbers are kept, at places that tell the answers apart.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from course_lib.tasks import registry
from course_lib.tasks.core import Case, Task
from course_lib.tasks.diagnosis.agreement import Sampled, leaves
from course_lib.tasks.diagnosis.recognition import Wrong, known_of
from course_lib.tasks.plain import from_wire, to_wire
from course_lib.tasks.running import Outcome

FILE = "public.npz"
MOST = 256
"""So many numbers of a large answer are kept."""
LARGE = 2 * MOST
"""An answer of more numbers is large; others are kept whole, so that points in another order are known again."""
Kept = dict[str, Any]
"""Of one case: names, and of each whether it answers, is far, passes; its answer, or numbers of it."""


def file_of(lab: str) -> Path:
    """Where the answers of a lab are kept."""
    return registry.folder(lab) / FILE


def recall(task: Task, cases: Sequence[Case]) -> None:
    """Let the public cases of a task know what its wrong answers give, where that is kept."""
    stored = unpack(file_of(task.lab)).get(task.id) if task.lab in registry.lab_numbers() else None
    names = [case.name for case in cases]
    if stored is not None and len(stored) != len(cases):  # the real ones are not here
        stored = [kept for kept in stored if names.count(kept["case"]) == 1]
    if stored is None or len(stored) != len(cases):
        return
    sources = {name_of(m.name, i): source for m in task.misconceptions for i, source in enumerate(m.sources)}
    for case, kept in zip(cases, stored, strict=True):
        known = known_of.setdefault(case, {})
        for i, name in enumerate(kept["names"]):
            known.setdefault((task.id, sources.get(name, name)), _wrong(kept, i))


def name_of(mistake: str, variant: int) -> str:
    """What the answer of a mistake's source is kept under."""
    return f"mistake: {mistake} ({variant})"


def _wrong(kept: Kept, i: int) -> Wrong:
    if not kept["answers"][i]:
        return Wrong(Outcome("raised"), False, False)
    answer = kept["values"][i]
    if kept["sampled"][i]:
        form = kept["forms"][answer["form"]]
        answer = Sampled(form["form"], tuple(form["places"]), tuple(answer["values"]), answer["tolerance"])
    return Wrong(Outcome("answer", answer), bool(kept["far"][i]), bool(kept["passes"][i]))


def unpack(path: Path) -> Mapping[str, list[Kept]]:
    """What the file of a lab keeps, by task; nothing where there is none."""
    return _read(path, path.stat().st_mtime_ns) if path.is_file() else {}


@lru_cache(maxsize=32)
def _read(path: Path, _changed: int) -> Mapping[str, list[Kept]]:
    with np.load(path, allow_pickle=False) as stored:
        return {name: from_wire(stored[name].tobytes()) for name in stored.files}


def keep(wrongs: Mapping[str, Wrong], tolerances: Mapping[str, float], case: str = "") -> Kept:
    """What is kept of the wrong answers to one case.

    Parameters
    ----------
    wrongs : by name.
    tolerances : by the same names, of the judge, in the unit of the answers.
    case : its name.
    """
    large: dict[str, list[tuple[str, list[np.ndarray]]]] = {}
    for name, wrong in wrongs.items():
        if wrong.outcome.kind == "answer":
            form, parts = leaves(wrong.outcome.answer)
            if sum(part.size for part in parts) > LARGE:
                large.setdefault(form, []).append((name, parts))
    forms = [{"form": form, "places": _places([parts for _, parts in same])} for form, same in large.items()]
    numbers = {name: number for number, same in enumerate(large.values()) for name, _ in same}
    kept: Kept = {"case": case, "names": list(wrongs), "forms": forms, "values": []}
    for name, wrong in wrongs.items():
        if name in numbers:
            parts = leaves(wrong.outcome.answer)[1]
            places = forms[numbers[name]]["places"]
            values = [part.reshape(-1)[at] for part, at in zip(parts, places, strict=True)]
            tolerance = float(np.nan_to_num(tolerances[name], posinf=0.0))
            kept["values"].append({"form": numbers[name], "values": values, "tolerance": tolerance})
        else:
            kept["values"].append(wrong.outcome.answer)
    kept["sampled"] = np.array([name in numbers for name in wrongs])
    kept["answers"] = np.array([wrong.outcome.kind == "answer" for wrong in wrongs.values()])
    kept["far"] = np.array([wrong.far for wrong in wrongs.values()])
    kept["passes"] = np.array([wrong.passes for wrong in wrongs.values()])
    return kept


def _places(answers: Sequence[Sequence[np.ndarray]]) -> list[np.ndarray]:
    """Of each part of answers of one form, places spread evenly and places where the answers differ most."""
    total = sum(part.size for part in answers[0])
    places = []
    for part in zip(*answers, strict=True):
        size = part[0].size
        few = max(4, MOST * size // total // 2)
        rows = np.stack([np.nan_to_num(one.reshape(-1).astype(np.float64)) for one in part])
        spread = np.argsort(-np.ptp(rows, axis=0), kind="stable")[:few]
        even = np.linspace(0, size - 1, min(few, size)).astype(np.int64)
        places.append(np.unique(np.concatenate([even, spread])).astype(np.int32))
    return places


def pack(tasks: Mapping[str, Sequence[Kept]]) -> bytes:
    """The bytes of the file of a lab; the same answers give the same bytes."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for task_id in sorted(tasks):
            array = io.BytesIO()
            np.lib.format.write_array(array, np.frombuffer(to_wire(list(tasks[task_id])), np.uint8), (1, 0))
            info = zipfile.ZipInfo(f"{task_id}.npy", (1980, 1, 1, 0, 0, 0))
            archive.writestr(info, array.getvalue(), zipfile.ZIP_DEFLATED, 9)
    return file.getvalue()
