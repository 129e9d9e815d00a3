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


_SHRINKING = "np.geomspace(long / 2, 2 * gap, 5)"


def _wrong_register(
    fit: str = "planes",
    radii: str = _SHRINKING,
    steps: int = 15,
    *,
    rows: str = "np.cross(p, n), n",
    right: str = "n * (q - p)",
    turn: str = "x[:3]",
    shift: str = "x[3:]",
    p: str = "moved[k]",
    seen: str = "moved",
    after: str = "S @ T",
    begin: str = "start",
    given: str = "T",
) -> str:
    """A registration by a shrinking radius with a piece exchanged; `turn` is the rotation vector of a step."""
    step = {
        "planes": f"            x = np.linalg.lstsq(np.hstack([{rows}]), np.sum({right}, axis=1), rcond=None)[0]\n"
        f"            w, t = {turn}, {shift}\n"
        "            a = max(np.linalg.norm(w), 1e-12)\n"
        "            K = np.cross(np.eye(3), w / a)\n"
        "            S = np.eye(4)\n"
        "            S[:3, :3] = np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K\n"
        "            S[:3, 3] = t\n",
        "points": "            U, _, Vt = np.linalg.svd((p - p.mean(0)).T @ (q - q.mean(0)))\n"
        "            S = np.eye(4)\n"
        "            S[:3, :3] = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T\n"
        "            S[:3, 3] = q.mean(0) - S[:3, :3] @ p.mean(0)\n",
    }
    return (
        "from scipy.spatial import cKDTree\n"
        "def register(source, target, normals, start):\n"
        f"    T, tree = {begin}, cKDTree(target)\n"
        "    gap, long = np.median(tree.query(target, 2)[0][:, 1]), np.ptp(target, axis=0).max()\n"
        f"    for radius in {radii}:\n"
        f"        for _ in range({steps}):\n"
        "            moved = source @ T[:3, :3].T + T[:3, 3]\n"
        f"            d, i = tree.query({seen})\n"
        "            k = d <= radius\n"
        f"            p, q, n = {p}, target[i[k]], normals[i[k]]\n"
        "            if len(p) < 10:\n"
        "                break\n"
        f"{step[fit]}"
        f"            T = {after}\n"
        f"    return {given}\n"
    )


_ROWS = (
    "def register(source, target, normals, start):\n"
    "    T, count = np.eye(4), min(len(source), len(target))\n"
    "    p, q = source[:count], target[:count]\n"
    "    U, _, Vt = np.linalg.svd((p - p.mean(0)).T @ (q - q.mean(0)))\n"
    "    T[:3, :3] = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T\n"
    "    T[:3, 3] = q.mean(0) - T[:3, :3] @ p.mean(0)\n"
    "    return T\n"
)
_MIDDLES = (
    "def register(source, target, normals, start):\n"
    "    T = start.copy()\n"
    "    T[:3, 3] += target.mean(axis=0) - (source @ T[:3, :3].T + T[:3, 3]).mean(axis=0)\n"
    "    return T\n"
)
_TURN = "add the turn of np.degrees(np.linalg.norm(w)) about w"
OPEN_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the start, or little more: the lesson's radii were for a room. Take the first from how far start may be off, "
        "the last from this scene's spacing; look from where T has moved the source, and go on with step @ T",
        _wrong_register(radii="[1.0, 0.3, 0.1, 0.05]", steps=10),
        variants=(
            *(_wrong_register(radii="[1.0, 0.3, 0.1, 0.05]", steps=steps) for steps in (25, 40)),
            _wrong_register(radii="[1.0, 0.05]", steps=25),
            *(_wrong_register(radii=f"[{many} * gap]", steps=30) for many in (2, 4, 6, 8)),
            _wrong_register("points", "[2 * gap]", 30),
            _wrong_register("points", "[1.0, 0.3, 0.1, 0.05]", 25),
            _wrong_register(seen="source"),
            "def register(source, target, normals, start):\n    return start\n",
        ),
    ),
    Misconception(
        "every pair, to points",
        "every pair kept, and distances to points, as in the lesson's first loop: leaves and what has no partner pull",
        _wrong_register("points", "[np.inf]", 30),
        variants=(_wrong_register("points", "[np.inf]", 60),),
    ),
    Misconception(
        "one large radius",
        "one radius, so large that leaves and what has no partner pull to the end: shrink it from coarse to fine",
        _wrong_register(radii="[long / 2]", steps=30),
        variants=tuple(_wrong_register(radii=f"[{radius}]", steps=30) for radius in ("np.inf", "0.75 * long", "0.35 * long", "0.25 * long")),
    ),
    Misconception(
        "start ignored",
        "a search that begins where the source lies in its own coordinates: begin with T = start",
        _wrong_register(begin="np.eye(4)"),
    ),
    Misconception(
        "start left out of the result",
        "the correction alone, without the start that it corrects: steps go on from T = start, and T is the answer",
        _wrong_register(given="T @ np.linalg.inv(start)"),
    ),
    Misconception(
        "to points",
        "a shrinking radius, but distances to points, whose wrong pairs hold the ground back: measure to planes",
        _wrong_register("points"),
        variants=(_wrong_register("points", "long * np.array([0.5, 0.15, 0.05, 0.025])"), _wrong_register("points", steps=40)),
    ),
    Misconception(
        "one step",
        "a single step: pairs are better after it, so look for them again, until nothing moves",
        _wrong_register(radii="[0.75 * long]", steps=1),
        variants=(_wrong_register("points", "[0.75 * long]", 1), _wrong_register("points", "[np.inf]", 1)),
    ),
    Misconception(
        "degrees forgotten",
        "radians where turn() takes degrees, so that each step hardly turns: turn(w, np.degrees(np.linalg.norm(w)))",
        _wrong_register(turn="np.radians(x[:3])"),
    ),
    Misconception(
        "no turn in the step",
        f"steps that only shift: {_TURN}",
        _wrong_register(turn="0 * x[:3]"),
    ),
    Misconception(
        "the turn the other way",
        "steps that turn the other way about the same axis: w is x[:3] as it is, for rows of p × n",
        _wrong_register(turn="-x[:3]"),
        variants=(_wrong_register(rows="np.cross(n, p), n"),),
    ),
    Misconception(
        "the other sign on the right",
        "n · (p − q) on the right-hand side, which steps away from the target: it is n · (q − p)",
        _wrong_register(right="n * (p - q)"),
    ),
    Misconception(
        "turn and shift exchanged",
        "the halves of the solution exchanged: with rows (p × n, n) its first three numbers turn, its last three shift",
        _wrong_register(turn="x[3:]", shift="x[:3]"),
        variants=(_wrong_register(rows="n, np.cross(p, n)"),),
    ),
    Misconception(
        "step on the right",
        "T @ step, which applies the newest step first: it acts on what has moved, so it stands leftmost",
        _wrong_register(after="T @ S"),
    ),
    Misconception(
        "only the last step",
        "the newest step alone for T: the earlier ones have moved the source, too, so step @ T",
        _wrong_register(after="S"),
    ),
    Misconception(
        "fitted where the source began",
        "steps fitted to the source as it was given, and then put onto T as well: fit the points that have moved",
        _wrong_register(p="source[k]"),
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
