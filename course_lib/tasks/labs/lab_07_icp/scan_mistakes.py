"""The wrong answers of lab 07's registrations, of the table and of the two scans: what each looks like, what to do."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import swapped

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
    Misconception(
        "reflection for another",
        "a reflection and something else taken for each other: only a missing guard makes the determinant −1",
        swapped(CAUSE_OF, CAUSES[2], CAUSES[3]),
        variants=(swapped(CAUSE_OF, CAUSES[2], CAUSES[1]), swapped(CAUSE_OF, CAUSES[2], CAUSES[4])),
    ),
    Misconception(
        "translation for a wrong turn",
        "a wrong translation and a wrong turn taken for each other: t without R has the right R, so an angle of 0",
        swapped(CAUSE_OF, CAUSES[1], CAUSES[0]),
        variants=(swapped(CAUSE_OF, CAUSES[1], CAUSES[3]),),
    ),
    Misconception(
        "one step for a turn the other way",
        "an early end and a turn the other way taken for each other: the other way is off by twice the turn, 60°",
        swapped(CAUSE_OF, CAUSES[4], CAUSES[0]),
        variants=(swapped(CAUSE_OF, CAUSES[4], CAUSES[3]),),
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
_TO_PLANES = (
    "            x = np.linalg.lstsq(np.hstack([np.cross(p, n), n]), np.sum(n * (q - p), axis=1), rcond=None)[0]\n"
    "            a = max(np.linalg.norm(x[:3]), 1e-12)\n"
    "            k = x[:3] / a\n"
    "            K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])\n"
    "            S = np.eye(4)\n"
    "            S[:3, :3] = np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K\n"
    "            S[:3, 3] = x[3:]\n"
    "            T = S @ T\n"
)
_ROWS = (
    "def register(source, target, normals):\n"
    "    T, count = np.eye(4), min(len(source), len(target))\n"
    "    p, q = source[:count], target[:count]\n"
    "    U, _, Vt = np.linalg.svd((p - p.mean(0)).T @ (q - q.mean(0)))\n"
    "    T[:3, :3] = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T\n"
    "    T[:3, 3] = q.mean(0) - T[:3, :3] @ p.mean(0)\n"
    "    return T\n"
)
_MIDDLES = (
    "def register(source, target, normals):\n"
    "    T = np.eye(4)\n"
    "    T[:3, 3] = target.mean(axis=0) - source.mean(axis=0)\n"
    "    return T\n"
)
OPEN_MISTAKES = (
    Misconception(
        "one large radius",
        "one radius, so large that strays and what has no partner pull on the result: shrink it from coarse to fine",
        _wrong_register("[9.0]", _TO_POINTS, 40),
        variants=(_wrong_register("[9.0]", _TO_PLANES, 40),),
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
        variants=(_wrong_register("[1.0]", _TO_PLANES, 1),),
    ),
    Misconception(
        "middles only",
        "the means laid together, no more: the scans overlap in part, so their means differ, and a turn is left",
        _MIDDLES,
    ),
    Misconception(
        "pairs by row",
        "row i paired with row i: nobody gave pairs here, so look for the closest points, again and again",
        _ROWS,
    ),
)
