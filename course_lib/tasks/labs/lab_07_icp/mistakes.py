"""The wrong answers of lab 07's motions from known pairs, as learner code: what each looks like, and what to do."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_total(line: str, start: str = "np.eye(4)", after: str = "T", steps: str = "steps") -> str:
    return (
        f"def accumulate(steps):\n    T = {start}\n    for step in {steps}:\n        T = {line}\n    return {after}\n"
    )


def _total_by_parts(shift: str) -> str:
    """Rotation and shift kept apart; `old` is the rotation before the step, R with it."""
    return (
        "def accumulate(steps):\n"
        "    T, R, t = np.eye(4), np.eye(3), np.zeros(3)\n"
        "    for step in steps:\n"
        "        old, R = R, step[:3, :3] @ R\n"
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
        "new shift turned",
        "the new step's own shift turned by the rotation so far: it is the shift so far that the new step turns",
        _total_by_parts("t + old @ step[:3, 3]"),
        variants=(_total_by_parts("t + R @ step[:3, 3]"),),
    ),
)


def _wrong_fit(
    rotation: str = "V @ np.diag([1, 1, np.sign(np.linalg.det(V @ U.T))]) @ U.T",
    translation: str = "mean_q - R @ mean_p",
    p: str = "source - mean_p",
    q: str = "target - mean_q",
    after: str = "T",
    means: str = "source.mean(axis=0), target.mean(axis=0)",
) -> str:
    return (
        "def best_rigid(source, target):\n"
        f"    mean_p, mean_q = {means}\n"
        f"    p, q = {p}, {q}\n"
        "    U, w, Vt = np.linalg.svd(p.T @ q)\n"
        "    V = Vt.T\n"
        f"    R = {rotation}\n"
        "    T = np.eye(4)\n"
        "    T[:3, :3] = R\n"
        f"    T[:3, 3] = {translation}\n"
        f"    return {after}\n"
    )


_SCALED = "np.vstack([np.c_[R * w.sum() / (p**2).sum(), mean_q - R @ mean_p * w.sum() / (p**2).sum()], [0, 0, 0, 1]])"
_AFFINE = (
    "def best_rigid(source, target):\n"
    "    T = np.eye(4)\n"
    "    T[:3] = np.linalg.lstsq(np.c_[source, np.ones(len(source))], target, rcond=None)[0].T\n"
    "    return T\n"
)
FIT_MISTAKES = (
    Misconception(
        "Vt taken for V",
        "NumPy's third matrix taken for V: it is Vᵀ already, so V is its transpose",
        _wrong_fit("Vt @ np.diag([1, 1, np.sign(np.linalg.det(Vt @ U.T))]) @ U.T"),
        variants=(_wrong_fit("Vt @ U.T"), _wrong_fit("Vt @ U")),
    ),
    Misconception(
        "U not transposed",
        "V U where V Uᵀ belongs: NumPy's first matrix is U, and the formula has its transpose",
        _wrong_fit("V @ np.diag([1, 1, np.sign(np.linalg.det(V @ U))]) @ U"),
        variants=(_wrong_fit("V @ U"),),
    ),
    Misconception(
        "transposed, and no guard",
        "two things at once: U Vᵀ where V Uᵀ belongs, and no guard against a reflection",
        _wrong_fit("U @ V.T"),
    ),
    Misconception(
        "guard that negates",
        "all of R negated where its determinant is −1, which turns as well: flip the last column of V only",
        _wrong_fit("V @ U.T * np.sign(np.linalg.det(V @ U.T))"),
    ),
    Misconception(
        "guard in the wrong place",
        "a guard that does not stand between V and Uᵀ: it flips the weakest direction, the last column of V",
        _wrong_fit("np.diag([1, 1, np.sign(np.linalg.det(V @ U.T))]) @ V @ U.T"),
        variants=(_wrong_fit("V @ U.T @ np.diag([1, 1, np.sign(np.linalg.det(V @ U.T))])"),),
    ),
    Misconception(
        "another direction flipped",
        "a guard that flips another direction than the weakest: the singular values fall, so diag(1, 1, det)",
        _wrong_fit("V @ np.diag([np.sign(np.linalg.det(V @ U.T)), 1, 1]) @ U.T"),
        variants=(_wrong_fit("V @ np.diag([1, np.sign(np.linalg.det(V @ U.T)), 1]) @ U.T"),),
    ),
    Misconception(
        "always flipped",
        "V's last column flipped always: flip it only where det(V Uᵀ) is −1, or a right turn becomes a mirror",
        _wrong_fit("V @ np.diag([1, 1, -1]) @ U.T"),
    ),
    Misconception(
        "guard turned round",
        "a guard that flips where it need not, and does not where it must: flip where det(V Uᵀ) is negative",
        _wrong_fit("V @ np.diag([1, 1, -np.sign(np.linalg.det(V @ U.T))]) @ U.T"),
    ),
    Misconception(
        "rotation transposed",
        "U Vᵀ where V Uᵀ belongs, which turns the other way and still has the determinant +1",
        _wrong_fit("U @ np.diag([1, 1, np.sign(np.linalg.det(U @ V.T))]) @ V.T"),
    ),
    Misconception(
        "translation without R",
        "the difference of the two means: rotate the source's mean first, t = mean of target − R · mean of source",
        _wrong_fit(translation="mean_q - mean_p"),
    ),
    Misconception(
        "the difference of the means turned",
        "R · (mean of target − mean of source): R turns the mean of the source only",
        _wrong_fit(translation="R @ (mean_q - mean_p)"),
    ),
    Misconception(
        "mean of the source turned back",
        "a shift with Rᵀ in it (mean @ R is Rᵀ mean): t = mean of target − R · mean of source",
        _wrong_fit(translation="mean_q - mean_p @ R"),
    ),
    Misconception(
        "mean of the target turned",
        "a shift from the turned mean of the target: R belongs to the source, t = mean of target − R · mean of source",
        _wrong_fit(translation="R @ mean_q - mean_p"),
        variants=(_wrong_fit(translation="mean_p - R @ mean_q"), _wrong_fit(translation="mean_q @ R - mean_p")),
    ),
    Misconception(
        "translation before the guard",
        "a shift computed from the mirror: compute t after the guard, from the R that you return",
        _wrong_fit(translation="mean_q - V @ U.T @ mean_p"),
    ),
    Misconception(
        "no reflection guard",
        "a reflection, or a turn that came of one: flip the sign of V's last column where det(V Uᵀ) is −1",
        _wrong_fit("V @ U.T"),
    ),
    Misconception(
        "the first three pairs",
        "a motion from three pairs, with all their noise: every pair has its say",
        _wrong_fit(p="(source - mean_p)[:3]", q="(target - mean_q)[:3]"),
        variants=(
            _wrong_fit(
                p="(source - source[:3].mean(axis=0))[:3]",
                q="(target - target[:3].mean(axis=0))[:3]",
                translation="target[:3].mean(axis=0) - R @ source[:3].mean(axis=0)",
            ),
        ),
    ),
    Misconception(
        "centred on the first pair",
        "points counted from the first of them, whose noise then moves all: subtract the means",
        _wrong_fit(p="source - source[0]", q="target - target[0]", translation="target[0] - R @ source[0]"),
    ),
    Misconception(
        "translation from one pair",
        "a translation that lays one pair exactly together, with its noise: take it from the means",
        _wrong_fit(translation="target[-1] - R @ source[-1]"),
    ),
    Misconception(
        "no centring",
        "the cross-covariance of points that were not centred: subtract each cloud's mean first",
        _wrong_fit(p="source", q="target"),
        variants=(
            _wrong_fit(p="source", q="target", translation="0"),
            _wrong_fit(rotation="V @ U.T", p="source", q="target", translation="0"),
            _wrong_fit(p="source", q="target", translation="mean_q - mean_p"),
        ),
    ),
    Misconception(
        "means without axis",
        "one mean of all numbers where each coordinate has its own: mean(axis=0)",
        _wrong_fit(means="np.full(3, source.mean()), np.full(3, target.mean())"),
    ),
    Misconception(
        "medians for means",
        "medians in the place of the means: least squares belong to means",
        _wrong_fit(means="np.median(source, axis=0), np.median(target, axis=0)"),
    ),
    Misconception(
        "a scale in it",
        "a rotation with a scale: a rigid motion keeps lengths, so R alone",
        _wrong_fit(after=_SCALED),
    ),
    Misconception(
        "an affine map",
        "least squares for all entries, which may stretch and shear: only a rotation is allowed, so the SVD",
        _AFFINE,
    ),
    Misconception(
        "shift only",
        "a shift with no turn at all: the rotation comes from the SVD of the centred points' cross-covariance",
        _wrong_fit("np.eye(3)"),
    ),
    Misconception(
        "the other direction",
        "the transform from the target to the source: the source is what moves",
        _wrong_fit(after="np.linalg.inv(T)"),
    ),
    Misconception(
        "rotation without translation",
        "a rotation about the origin with no shift: t is the mean of the target minus R times the mean of the source",
        _wrong_fit(translation="0"),
    ),
)
