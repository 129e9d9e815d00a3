"""The wrong answers of lab 07's old task 2, a motion from pairs that all count alike, as learner code."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


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


_BOTH = "np.vstack([source, target]).mean(axis=0)"
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
        "two things at once: a rotation the wrong way round (U Vᵀ for V Uᵀ), and no guard against a reflection",
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
        "the wrong ones transposed",
        "U and V multiplied with the wrong ones transposed: R = V Uᵀ, which is Vt.T @ U.T",
        _wrong_fit("U @ V"),
        variants=(
            _wrong_fit("U.T @ V"),
            _wrong_fit("U.T @ Vt"),
            _wrong_fit("U @ np.diag([1, 1, np.sign(np.linalg.det(U @ V))]) @ V"),
            _wrong_fit("U.T @ np.diag([1, 1, np.sign(np.linalg.det(U @ V))]) @ V"),
            _wrong_fit("U.T @ np.diag([1, 1, np.sign(np.linalg.det(U @ V))]) @ Vt"),
        ),
    ),
    Misconception(
        "singular values in R",
        "a rotation with the singular values in it: they stretch, so leave them out, R = V diag(1, 1, det) Uᵀ",
        _wrong_fit("V @ np.diag(w) @ U.T"),
        variants=(_wrong_fit("V @ np.diag(w * [1, 1, np.linalg.det(V @ U.T)]) @ U.T"),),
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
        "a rotation the wrong way round: V Uᵀ of source times target is right, not U Vᵀ, nor target times source",
        _wrong_fit("U @ np.diag([1, 1, np.sign(np.linalg.det(U @ V.T))]) @ V.T"),
    ),
    Misconception(
        "translation without R",
        "the difference of the two means: rotate the source's mean first, t = mean of target − R · mean of source",
        _wrong_fit(translation="mean_q - mean_p"),
        variants=(_wrong_fit(translation="mean_p - mean_q"),),
    ),
    Misconception(
        "turned about its own middle",
        "a source that turns about its own mean and stays there: its mean must end at the target's",
        _wrong_fit(translation="mean_p - R @ mean_p"),
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
            _wrong_fit(means=f"{_BOTH}, {_BOTH}"),
            _wrong_fit(means=f"{_BOTH}, {_BOTH}", translation="target.mean(axis=0) - R @ source.mean(axis=0)"),
        ),
    ),
    Misconception(
        "means without axis",
        "a mean of all numbers, or of each row, where each coordinate has its own: mean(axis=0)",
        _wrong_fit(means="np.full(3, source.mean()), np.full(3, target.mean())"),
        variants=(
            _wrong_fit(
                p="source - source.mean(axis=1)[:, None]",
                q="target - target.mean(axis=1)[:, None]",
            ),
        ),
    ),
    Misconception(
        "sums for means",
        "sums in the place of the means: divide by the number of points",
        _wrong_fit(means="source.sum(axis=0), target.sum(axis=0)"),
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
