"""A page for the instructor that shows how the class did, and where to look."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import mean, median
from typing import Any

from course_lib.grading.release.released import released_lab

from .pages import render, write_text
from .similar import similar_answers

__all__ = ["class_report", "write_report"]

ROUTINE = ("helpers", "several", "moved", "cells moved", "cells changed", "cells gone", "cells doubled", "missing")
"""Notices of repairs: common, and no sign of anything."""
BINS = 10


def write_report(standings: Sequence[Any], path: Path) -> None:
    """Write the page of all labs of the standings."""
    write_text(path, class_report(standings))


def class_report(standings: Sequence[Any]) -> str:
    """The page as HTML."""
    labs = sorted({one.lab for one in standings})
    return render("class.html", labs=[_lab([one for one in standings if one.lab == lab], lab) for lab in labs])


def _lab(standings: list[Any], lab: str) -> dict[str, Any]:
    graded = [one for one in standings if one.status == "graded"]
    sums = [one.points for one in graded]
    most = max((one.max for one in standings), default=0.0)
    return {
        "number": lab,
        "title": released_lab(lab).name[3:].replace("_", " "),
        "statuses": sorted(Counter(one.status for one in standings).items()),
        "graded": len(graded),
        "mean": mean(sums) if sums else None,
        "median": median(sums) if sums else None,
        "max": most,
        "to_mark": sum(one.to_mark for one in graded),
        "late": [(_who(one), one.late_reason) for one in graded if one.kept < 1],
        "bars": _bars(sums, most),
        "tasks": _tasks(graded),
        "mistakes": _mistakes(graded),
        "odd": _odd(standings),
        "alike": _alike(graded, lab),
    }


def _who(one: Any) -> str:
    return one.name or one.student or (one.entry.named if one.entry else "?")


def _bars(sums: list[float], most: float) -> list[dict[str, Any]]:
    """The histogram: how many earned between `low` and `high`, and the height of the bar in percent."""
    counts = Counter(min(BINS - 1, int(BINS * points / most)) for points in sums) if most else Counter()
    top = max(counts.values(), default=1)
    return [
        {"low": most * i / BINS, "high": most * (i + 1) / BINS, "count": counts[i], "height": 100 * counts[i] / top}
        for i in range(BINS)
    ]


def _tasks(graded: list[Any]) -> list[dict[str, Any]]:
    """Each task with the share that has all its points; the hardest first."""
    by_task: dict[str, list[Any]] = {}
    for one in graded:
        for task in one.tasks:
            by_task.setdefault(task.id, []).append(task)
    rows = [
        {
            "number": some[0].number,
            "title": some[0].title,
            "passed": sum(task.points >= task.max for task in some) / len(some),
            "mean": mean(task.points for task in some),
            "max": some[0].max,
            "untouched": sum(task.record["status"] == "not started" for task in some),
        }
        for some in by_task.values()
        if not any(task.open for task in some)
    ]
    return sorted(rows, key=lambda row: (row["passed"], row["number"]))


def _mistakes(graded: list[Any]) -> list[dict[str, Any]]:
    """Misconceptions by how many have them."""
    counts: Counter[tuple[int, str, str, str]] = Counter()
    for one in graded:
        for task in one.tasks:
            for name in task.record["misconceptions"]:
                counts[task.number, name, task.record["looks_like"], task.record["where"]] += 1
    merged: dict[tuple[int, str], list[Any]] = {}
    for (number, name, looks, where), count in counts.items():
        row = merged.setdefault((number, name), [0, looks, where])
        row[0] += count
    rows = [
        {"task": number, "name": name, "count": count, "looks": looks, "where": where}
        for (number, name), (count, looks, where) in merged.items()
    ]
    return sorted(rows, key=lambda row: (-row["count"], row["task"], row["name"]))


def _odd(standings: list[Any]) -> list[dict[str, str]]:
    """Submissions at which a person should look, and why."""
    rows = []
    for one in standings:
        notices = one.record["notices"] if one.record is not None else []
        codes = [notice["code"] for notice in notices if notice["code"] not in ROUTINE]
        texts = [notice["text"] for notice in notices if notice["code"] not in ROUTINE]
        texts.insert(0, one.waits)
        if any(texts) or one.status in ("unreadable", "infrastructure", "waiting"):
            path = one.entry.path if one.entry else ""
            rows.append(
                {"who": _who(one), "path": path, "why": " ".join(dict.fromkeys(texts)), "codes": ", ".join(codes)}
            )
    return rows


def _alike(graded: list[Any], lab: str) -> list[dict[str, Any]]:
    """Near-identical answers, by task."""
    stubs = {slot.task.id: slot.stub for slot in released_lab(lab).slots}
    by_task: dict[str, dict[str, str]] = {}
    names = {}
    for one in graded:
        names[one.student] = _who(one)
        for task in one.tasks:
            if task.record["status"] not in ("not started", "by hand", "missing"):
                by_task.setdefault(task.id, {})[one.student] = task.record["source"]
    rows = []
    for task, answers in sorted(by_task.items()):
        for pair in similar_answers(answers, stubs.get(task, "")):
            rows.append(
                {
                    "task": task,
                    "first": names[pair.first],
                    "second": names[pair.second],
                    "share": round(100 * pair.share),
                }
            )
    return rows
