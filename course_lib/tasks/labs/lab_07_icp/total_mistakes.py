"""The wrong answers of lab 07's motion of several steps, as learner code: what each looks like, and what to do."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_total(line: str, start: str = "np.eye(4)", after: str = "T", steps: str = "steps") -> str:
    return (
        f"def accumulate(steps):\n    T = {start}\n    for step in {steps}:\n        T = {line}\n    return {after}\n"
    )


def _total_by_parts(shift: str, rotation: str = "step[:3, :3] @ R") -> str:
    """Rotation and shift kept apart; `old` is the rotation before the step, R with it."""
    return (
        "def accumulate(steps):\n"
        "    T, R, t = np.eye(4), np.eye(3), np.zeros(3)\n"
        "    for step in steps:\n"
        f"        old, R = R, {rotation}\n"
        f"        t = {shift}\n"
        "    T[:3, :3], T[:3, 3] = R, t\n"
        "    return T\n"
    )


TOTAL_MISTAKES = (
    Misconception(
        "new step on the right",
        "T @ step, which applies the newest step first: what happens last stands on the left, so step @ T",
        _wrong_total("T @ step"),
    ),
    Misconception(
        "inverse returned",
        "the way back, from the target to the source: return the transform itself",
        _wrong_total("step @ T", after="np.linalg.inv(T)"),
        variants=(_wrong_total("np.linalg.inv(step) @ T"),),
    ),
    Misconception(
        "last step only",
        "the newest step alone: the earlier ones have moved the source, too",
        _wrong_total("step.copy()"),
    ),
    Misconception(
        "matrices added",
        "a sum or a mean where a product belongs: rotations do not add up, multiply the matrices with @",
        _wrong_total("T + step - np.eye(4)"),
        variants=(
            _wrong_total("T + step"),
            _wrong_total("T + step", "np.zeros((4, 4))"),
            _wrong_total("T + step / len(steps)", "np.zeros((4, 4))"),
        ),
    ),
    Misconception(
        "entry by entry",
        "* or np.prod, which multiply entry by entry: the product of matrices is @",
        _wrong_total("step * T"),
        variants=(_wrong_total("step * T", "np.ones((4, 4))"),),
    ),
    Misconception(
        "begun with zeros",
        "a product that begins with zeros and so stays 0: begin with np.eye(4)",
        _wrong_total("step @ T", "np.zeros((4, 4))"),
    ),
    Misconception(
        "first step left out",
        "a product without the first step: does the loop begin at 1, with np.eye(4) in the place of the first",
        _wrong_total("step @ T", steps="steps[1:]"),
    ),
    Misconception(
        "last step left out",
        "a product without the last step: the loop ends one too early",
        _wrong_total("step @ T", steps="steps[:-1]"),
    ),
    Misconception(
        "first step twice",
        "a product with the first step in it twice: begin with np.eye(4), or let the loop begin with the second",
        _wrong_total("step @ T", "steps[0]"),
    ),
    Misconception(
        "first step only",
        "the first step alone: does return stand inside the loop",
        _wrong_total("step @ T", steps="steps[:1]"),
    ),
    Misconception(
        "shifts not turned",
        "shifts that were added up by themselves: the newest step turns the shift so far, too, as step @ T does",
        _total_by_parts("t + step[:3, 3]"),
    ),
    Misconception(
        "shift turned by all rotations",
        "a shift turned by the whole rotation so far: only the newest step's rotation turns it, as step @ T does",
        _total_by_parts("R @ t + step[:3, 3]"),
        variants=(_total_by_parts("old @ t + step[:3, 3]"),),
    ),
    Misconception(
        "rotations in the other order",
        "rotations put together in the other order than the shifts: the newest stands on the left in both",
        _total_by_parts("step[:3, :3] @ t + step[:3, 3]", "R @ step[:3, :3]"),
    ),
    Misconception(
        "new shift turned",
        "the new step's own shift turned by the rotation so far: it is the shift so far that the new step turns",
        _total_by_parts("t + old @ step[:3, 3]"),
        variants=(_total_by_parts("t + R @ step[:3, 3]"),),
    ),
)
