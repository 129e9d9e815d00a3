"""The anatomy of an error that nobody has a name for: what all its parts have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from course_lib.tasks.core import Case, Task, Verdict, lowest
from course_lib.tasks.diagnosis.forms import of_gaps
from course_lib.tasks.diagnosis.named_errors import ALL_ZERO, SIGN_IN_SOME, Found, part_of
from course_lib.tasks.plain import Plain
from course_lib.tasks.wording import quantity

VAGUE = ("scattered", "a part only")
EQUAL = 1e-4  # relative: so equal are offsets, or factors, that are called the same


def anatomy(task: Task, cases: Sequence[Case], answers: Sequence[Plain], verdicts: Sequence[Verdict]) -> Found | None:
    """What is common to the errors of an answer; None where nothing simple is.

    Parameters
    ----------
    answers : one a case, or None where there is none.
    """
    failed = [i for i, verdict in enumerate(verdicts) if not verdict.passed]
    told = [i for i in failed if answers[i] is not None and math.isfinite(verdicts[i].error)]
    if not failed:
        return None
    spoken = lowest(verdicts) if task.kind == "open" else -1
    worst = max(told, key=lambda i: (i == spoken, verdicts[i].ratio), default=failed[0])
    found = part_of(task, cases[worst], answers[worst]) if told else None
    if found is None and len(failed) == 1 and len(verdicts) > 2 and task.kind != "open":
        name = cases[failed[0]].name or f"number {failed[0] + 1}"
        found = "only in one case", f"Only one case is wrong, “{name}”; the other {len(verdicts) - 1} are right."
        more = _of_cases(cases, answers, [failed[0]], verdicts) if told else None
        return found if more is None or more[0] in VAGUE else (found[0], f"{found[1]} {more[1]}")
    found = found or (_of_cases(cases, answers, told, verdicts) if told else None)
    if found is None or found[0] != "scattered" or len(failed) == len(verdicts) or task.kind == "open":
        return found
    names = " and ".join(f"“{cases[i].name or f'number {i + 1}'}”" for i in failed)
    return "only in some cases", (
        f"{len(failed)} of {len(verdicts)} cases are wrong, {names}; the others are right: what do the wrong ones have "
        "in common?"
    )


def _of_cases(
    cases: Sequence[Case], answers: Sequence[Plain], some: Sequence[int], verdicts: Sequence[Verdict]
) -> Found | None:
    """What the numbers of these cases have in common."""
    pairs = [_numbers(answers[i], cases[i].hidden.get("truth")) for i in some]
    if any(pair is None for pair in pairs):
        return None
    worst = max(range(len(some)), key=lambda k: verdicts[some[k]].ratio)
    return _of_arrays(pairs, worst, verdicts[some[worst]].unit)


def _numbers(answer: Plain, truth: Plain) -> tuple[np.ndarray, np.ndarray] | None:
    try:
        a, t = np.asarray(answer), np.asarray(truth)
    except ValueError:
        return None
    if a.dtype.kind not in "biuf" or t.dtype.kind not in "biuf" or a.shape != t.shape or a.size == 0:
        return None
    return (a, t) if (a.dtype.kind == "b") == (t.dtype.kind == "b") else None


def _of_arrays(pairs: list[tuple[np.ndarray, np.ndarray]], worst: int, unit: str) -> Found | None:
    a, t = pairs[worst]
    if t.dtype.kind == "b":
        return _of_masks(pairs)
    if t.shape == (4, 4):
        return _of_motions(a.astype(float), t.astype(float))
    floats = [(x.astype(float), y.astype(float)) for x, y in pairs]
    a, t = floats[worst]
    if (np.isnan(a) != np.isnan(t)).any():
        return of_gaps(a, t)
    known = [np.isfinite(x) & np.isfinite(y) for x, y in floats]
    off = [(x - y)[k] for (x, y), k in zip(floats, known, strict=True)]
    found = None
    if sum(len(one) for one in off) > 1:
        found = _of_offset_or_factor(floats, known, off, unit) or _of_each_case(floats, known, unit)
    if not found and t.ndim and 2 <= t.shape[-1] <= 4 and t.size > t.shape[-1]:
        found = _of_components(floats, worst, unit)
    if not found and t.ndim == 2 and len(t) > 2 and _rows(a) == _rows(t):
        found = (
            "rows in another order",
            "The right rows, in another order: row by row and column by column are exchanged, or something was sorted.",
        )
    found = found or of_rounding(a, t) or _of_places(floats, a, t)
    return found or _of_side(np.concatenate(off) if t.size == 1 else off[worst], unit)


def _rows(table: np.ndarray) -> list[bytes]:
    return sorted(row.tobytes() for row in np.round(table, 6) + 0.0)


def _of_each_case(pairs: list[tuple[np.ndarray, np.ndarray]], known: list[np.ndarray], unit: str) -> Found | None:
    """One factor, one offset or one sign in each case, but not the same in all."""
    factors, offsets, turned = [], [], []
    for (a, t), k in zip(pairs, known, strict=True):
        a, t = a[k], t[k]
        if len(t) < 2 or np.ptp(t) == 0:
            return None
        slope = ((a - a.mean()) * (t - t.mean())).sum() / ((t - t.mean()) ** 2).sum()
        level = a.mean() - slope * t.mean()
        if np.abs(a - slope * t - level).max() > EQUAL * np.abs(a).max():
            return None
        factors.append(slope), offsets.append(level), turned.append(abs(level) <= EQUAL * np.abs(a).max())
    if all(turned) and np.isin(np.round(factors, 6), (-1, 0, 1)).all():
        return SIGN_IN_SOME
    if all(turned):
        low, high = (quantity(x) for x in (min(factors), max(factors)))
        return (
            "one factor a case",
            f"In each case all values are wrong by one factor, {low} to {high}: a length or a scale is wrong.",
        )
    if np.allclose(factors, 1, atol=EQUAL):
        low, high = (quantity(x, unit) for x in (min(offsets), max(offsets)))
        return (
            "one offset a case",
            f"In each case all values are off by one length, {low} to {high}: they are counted from another place.",
        )
    if np.allclose(factors, -1, atol=EQUAL):
        return (
            "other sign and offset",
            "All values run the other way and are shifted: something is subtracted the wrong way round.",
        )
    return None


def _of_offset_or_factor(
    pairs: list[tuple[np.ndarray, np.ndarray]], known: list[np.ndarray], off: list[np.ndarray], unit: str
) -> Found | None:
    every = np.concatenate(off)
    if len(every) == 0 or not np.abs(every).max() > 0:
        return None
    if np.ptp(every) <= EQUAL * np.abs(every).max():
        side = "large" if every[0] > 0 else "small"
        size = quantity(abs(float(np.median(every))), unit if unit != "%" else "")
        return "constant offset", f"Every value is {size} too {side}: one constant was added or left out."
    a = np.concatenate([x[k] for (x, _), k in zip(pairs, known, strict=True)])
    t = np.concatenate([y[k] for (_, y), k in zip(pairs, known, strict=True)])
    some = np.abs(t) > 1e-9 * np.abs(t).max()
    if some.sum() > 1 and (np.abs(a[~some]) <= 1e-9 * np.abs(a).max() + 1e-300).all():
        factors = a[some] / t[some]
        middle = float(np.median(factors))
        if np.ptp(factors) <= EQUAL * abs(middle):
            if abs(middle + 1) <= EQUAL:
                return SIGN_IN_SOME
            if middle == 0:
                return ALL_ZERO
            return "constant factor", f"Every value is {quantity(middle)} times the right one: one factor is wrong."
        if (np.abs(np.abs(factors) - 1) < EQUAL).all():
            share = np.mean(factors < 0)
            return "signs", f"All sizes are right, but {100 * share:.0f} % of the values have the other sign."
    return None


def _of_components(pairs: list[tuple[np.ndarray, np.ndarray]], worst: int, unit: str) -> Found | None:
    """Only some of x, y and z are wrong, in every case."""
    a, t = pairs[worst]
    size = range(t.shape[-1])
    names = "xyzw" if len(size) > 2 else "uv"
    every = [_wrong(x, y).reshape(-1, len(size)).any(axis=0) for x, y in pairs]
    wrong = [i for i in size if any(one[i] for one in every)]
    if not 0 < len(wrong) < len(size):
        return None
    words = " and ".join(names[i] for i in wrong)
    inner = [(a[..., i], t[..., i]) for i in wrong]
    known = [np.isfinite(x) & np.isfinite(y) for x, y in inner]
    more = (
        _of_offset_or_factor(inner[:1], known[:1], [(inner[0][0] - inner[0][1])[known[0]]], unit)
        if len(wrong) == 1
        else None
    )
    right = ", ".join(names[i] for i in size if i not in wrong)
    ends = f"; {right} {'is' if len(right) == 1 else 'are'} right.{f' {more[1]}' if more else ''}"
    return f"only {words}", f"Only {words} {'is' if len(wrong) == 1 else 'are'} wrong{ends}"


def _of_motions(a: np.ndarray, t: np.ndarray) -> Found | None:
    R = a[:3, :3].T @ t[:3, :3]
    turned = np.degrees(np.arccos(np.clip((np.trace(R) - 1) / 2, -1, 1)))
    shift = float(np.linalg.norm(a[:3, 3] - t[:3, 3]))
    if turned < 0.01 and shift > 0:
        rate = np.linalg.norm(a[:3, 3]) / max(np.linalg.norm(t[:3, 3]), 1e-12)
        alike = "; its length is right, so it points the wrong way" if abs(rate - 1) < 1e-3 else ""
        return "only the shift", f"The rotation is right; only the shift is wrong, by {quantity(shift, 'm')}{alike}."
    if turned < 0.01:
        return None
    if shift < 1e-4:
        return "only the rotation", f"The shift is right; only the rotation is wrong, by {turned:.1f}°."
    return (
        "the rotation first",
        f"The rotation is wrong by {turned:.1f}°, and the shift may only follow from it: mend the rotation first.",
    )


def _of_masks(pairs: list[tuple[np.ndarray, np.ndarray]]) -> Found | None:
    many = sum(int((a & ~t).sum()) for a, t in pairs)
    few = sum(int((~a & t).sum()) for a, t in pairs)
    if all(not a.any() for a, _ in pairs):
        return "nothing chosen", "Nothing is True: is a length or a threshold too small, or a comparison turned round?"
    if all(a.all() for a, _ in pairs):
        return "all chosen", "Everything is True: is a threshold too large, or a comparison turned round?"
    if many and not few:
        return "too many", f"Everything that should be True is, and {many:,} more: the condition is too weak."
    if few and not many:
        return "too few", f"Nothing is True that should not be, and {few:,} are missing: the condition is too strict."
    return None


def _of_places(pairs: list[tuple[np.ndarray, np.ndarray]], a: np.ndarray, t: np.ndarray) -> Found | None:
    """Where the errors are: below zero, at the border, in one row, in a part, growing with the size."""
    wrong = _wrong(a, t)
    if len(pairs) > 0 and t.size > 1:
        every = [(_wrong(x, y).ravel(), y.ravel()) for x, y in pairs]
        bad, true = np.concatenate([w for w, _ in every]), np.concatenate([y for _, y in every])
        if bad.any() and not bad.all() and (true[bad] < 0).all() and (true[~bad] >= 0).all():
            return (
                "only below zero",
                "Only values below 0 are wrong: think of what abs(), int() or a cut at 0 does to them.",
            )
        both = bad.any() and not bad.all() and (true < 0).any()  # where nothing is negative, 0 often means no data
        if both and (true[bad] > 0).all() and (true[~bad] <= 0).all():
            return "only above zero", "Only values above 0 are wrong."
    count, size = int(wrong.sum()), wrong.size
    if count == 0 or size < 8:
        return None
    if count < size:
        if t.ndim == 2 and min(t.shape) > 4 and not wrong[1:-1, 1:-1].any():
            return "only at the border", (
                f"Only the border is wrong, {count:,} of {size:,} values: look at the first and last rows and columns."
            )
        rows = np.flatnonzero(wrong.reshape(len(wrong), -1).any(axis=1))
        if len(rows) == 1 and len(wrong) > 3:
            which = {0: "the first", len(wrong) - 1: "the last"}.get(int(rows[0]), f"number {rows[0]}")
            return "only one row", f"Only {which} of {len(wrong)} is wrong."
    if 2 * count < size:
        share = f"{100 * count / size:.0f} %"
        return (
            "a part only",
            f"{share} of the values are wrong, and the others are exact: what do the wrong ones have in common?",
        )
    size_of, off = np.abs(t[wrong]), np.abs(a - t)[wrong]
    if np.ptp(size_of) > 0 and np.ptp(off) > 0 and np.corrcoef(size_of, off)[0, 1] > 0.95:
        return "grows with the value", (
            "The error grows with the size of the value: a factor or an angle is wrong, not an offset."
        )
    return None


def _wrong(a: np.ndarray, t: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore"):
        off = np.nan_to_num(np.abs(a - t), posinf=0)
    return off > 1e-6 * max(1.0, float(np.abs(t[np.isfinite(t)]).max(initial=0)))


def of_rounding(a: np.ndarray, t: np.ndarray) -> Found | None:
    """Whether numbers are the right ones with fewer digits."""
    a, t = a[np.isfinite(a) & np.isfinite(t)], t[np.isfinite(a) & np.isfinite(t)]
    for step in (100.0, 10.0, 1.0, 0.1, 0.01, 0.001):
        whole = a.size and np.abs(t).max() > 2 * step and np.abs(a - step * np.round(a / step)).max() <= 1e-6 * step
        between = a.size and np.abs(t - step * np.round(t / step)).max() > 0.01 * step
        if whole and between and np.abs(a - t).max() < step:
            return "rounded", f"The values are right, but rounded or cut to {step:g}: keep all digits."
    return None


def _of_side(off: np.ndarray, unit: str) -> Found | None:
    if len(off) == 0:
        return None
    if (off > 0).all() or (off < 0).all():
        side = "large" if off[0] > 0 else "small"
        if len(off) == 1:
            return f"too {side}", f"The answer is too {side}."
        low, high = (quantity(float(size), unit) for size in (np.abs(off).min(), np.abs(off).max()))
        return f"all too {side}", f"All are too {side}, by {low} to {high}."
    return (
        "scattered",
        "The errors go to both sides, without a common offset, factor or place: look at the idea, not at a number.",
    )
