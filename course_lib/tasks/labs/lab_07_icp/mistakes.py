"""The wrong answers of lab 07, as learner code: what each looks like, and what to do about it."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended, swapped


def _wrong_total(line: str, start: str = "np.eye(4)", after: str = "T") -> str:
    return f"def accumulate(steps):\n    T = {start}\n    for step in steps:\n        T = {line}\n    return {after}\n"


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
    ),
    Misconception(
        "last step only",
        "the newest step alone: the earlier ones have moved the source, too",
        _wrong_total("step.copy()"),
    ),
    Misconception(
        "matrices added",
        "a sum where a product belongs: rotations do not add up, multiply the matrices",
        _wrong_total("T + step - np.eye(4)"),
    ),
)


def _wrong_fit(
    rotation: str = "V @ np.diag([1, 1, np.sign(np.linalg.det(V @ U.T))]) @ U.T",
    translation: str = "mean_q - R @ mean_p",
    p: str = "source - mean_p",
    q: str = "target - mean_q",
    after: str = "T",
) -> str:
    return (
        "def best_rigid(source, target):\n"
        "    mean_p, mean_q = source.mean(axis=0), target.mean(axis=0)\n"
        f"    p, q = {p}, {q}\n"
        "    U, _, Vt = np.linalg.svd(p.T @ q)\n"
        "    V = Vt.T\n"
        f"    R = {rotation}\n"
        "    T = np.eye(4)\n"
        "    T[:3, :3] = R\n"
        f"    T[:3, 3] = {translation}\n"
        f"    return {after}\n"
    )


FIT_MISTAKES = (
    Misconception(
        "Vt taken for V",
        "NumPy's third matrix taken for V: it is Vᵀ already, so V is its transpose",
        _wrong_fit("Vt @ np.diag([1, 1, np.sign(np.linalg.det(Vt @ U.T))]) @ U.T"),
        variants=(_wrong_fit("Vt @ U.T"), _wrong_fit("Vt @ U")),
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


_GIVEN_MISTAKES = {
    "pairs": ("source", "moved", "partners looked for where the source began: look from where T has moved it"),
    "order": ("T @ step", "step @ T", "T @ step, which applies the new step before the old ones: it stands leftmost"),
    "fitness": (
        "near[keep].size / max(keep.sum(), 1)",
        "keep.sum() / len(source)",
        "a fitness that divides by the pairs: divide by the number of source points",
    ),
}


def _wrong_step(left: tuple[str, ...], reject: str = "distance <= radius", share: str = "") -> str:
    """The given code with some of its three mistakes still in it."""
    pairs, order, fitness = mended(_GIVEN_MISTAKES, left)
    return (
        "def icp_step(source, target, T, radius):\n"
        "    moved = source @ T[:3, :3].T + T[:3, 3]\n"
        f"    distances = np.linalg.norm({pairs}[:, None] - target[None], axis=2)\n"
        "    near, distance = distances.argmin(axis=1), distances.min(axis=1)\n"
        f"    keep = {reject}\n"
        "    p, q = moved[keep], target[near[keep]]\n"
        "    U, _, Vt = np.linalg.svd((p - p.mean(axis=0)).T @ (q - q.mean(axis=0)))\n"
        "    guard = np.diag([1, 1, np.linalg.det(Vt.T @ U.T)])\n"
        "    step = np.eye(4)\n"
        "    step[:3, :3] = Vt.T @ guard @ U.T\n"
        "    step[:3, 3] = q.mean(axis=0) - step[:3, :3] @ p.mean(axis=0)\n"
        f'    return {{"T": {order}, "fitness": float({share or fitness})}}\n'
    )


MEND_MISTAKES = left_in(_GIVEN_MISTAKES, _wrong_step) + (
    Misconception(
        "share of the target",
        "a fitness that divides by the target's points: it is a share of the source's",
        _wrong_step((), share="keep.sum() / len(target)"),
    ),
    Misconception(
        "radius ignored",
        "every pair kept, however far apart: keep those whose distance is at most the radius",
        _wrong_step((), "distance >= 0"),
    ),
)


CAUSES = (
    "rotation transposed",
    "translation without R",
    "no reflection guard",
    "the inverse",
    "stopped after one step",
)
CAUSE_OF = {
    "A": "no reflection guard",
    "B": "the inverse",
    "C": "rotation transposed",
    "D": "stopped after one step",
    "E": "translation without R",
}


WHICH_MISTAKES = (
    Misconception(
        "transposed for inverse",
        "a transposed rotation and the inverse taken for each other: with the mean where it belongs, only the rotation "
        "is transposed; the inverse moves the mean away",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[3]),
    ),
    Misconception(
        "translation for one step",
        "a wrong translation and an early end taken for each other: a wrong translation leaves the rotation right",
        swapped(CAUSE_OF, CAUSES[1], CAUSES[4]),
    ),
    Misconception(
        "transposed for reflection",
        "a transposed rotation and a reflection taken for each other: look at the determinant",
        swapped(CAUSE_OF, CAUSES[0], CAUSES[2]),
    ),
)


def _wrong_register(radii: str, fit: str, steps: int = 15) -> str:
    return (
        "from scipy.spatial import cKDTree\n"
        "def register(source, target, normals):\n"
        "    T, tree = np.eye(4), cKDTree(target)\n"
        f"    for radius in {radii}:\n"
        f"        for _ in range({steps}):\n"
        "            p = source @ T[:3, :3].T + T[:3, 3]\n"
        "            d, i = tree.query(p)\n"
        "            k = d <= radius\n"
        "            p, q, n = p[k], target[i[k]], normals[i[k]]\n"
        "            if len(p) < 10:\n"
        "                return T\n"
        f"{fit}"
        "    return T\n"
    )


_TO_POINTS = (
    "            U, _, Vt = np.linalg.svd((p - p.mean(0)).T @ (q - q.mean(0)))\n"
    "            S = np.eye(4)\n"
    "            S[:3, :3] = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T\n"
    "            S[:3, 3] = q.mean(0) - S[:3, :3] @ p.mean(0)\n"
    "            T = S @ T\n"
)
OPEN_MISTAKES = (
    Misconception(
        "one large radius",
        "one radius, so large that strays and what has no partner pull on the result: shrink it from coarse to fine",
        _wrong_register("[9.0]", _TO_POINTS, 40),
    ),
    Misconception(
        "one small radius",
        "one radius, smaller than the distance to begin with, so that true partners are out of reach: begin larger",
        _wrong_register("[0.05]", _TO_POINTS, 40),
    ),
    Misconception(
        "one step",
        "a single step: pairs are better after it, so look for them again, until nothing moves",
        _wrong_register("[1.0]", _TO_POINTS, 1),
    ),
)
