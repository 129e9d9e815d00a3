"""The wrong answers of task 5 of lab 06, the floor of a furnished room, as learner code."""

from __future__ import annotations

from course_lib.tasks.core import Misconception

_FIT = """
def fit_to(points):
    middle = points.mean(axis=0)
    normal = np.linalg.eigh((points - middle).T @ (points - middle))[1][:, 0]
    return np.append(normal, -normal @ middle)
"""
_SEARCH = """
def search(points, threshold, tries, seed, level):
    rng = np.random.default_rng(seed)
    a, b, c = points[rng.integers(0, len(points), (tries, 3))].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1)
    a, normals = a[sizes > 0], normals[sizes > 0] / sizes[sizes > 0, None]
    best = np.zeros(len(points), bool)
    for corner, normal in zip(a, normals):
        if level(normal):
            inliers = np.abs((points - corner) @ normal) <= threshold
            if inliers.sum() > best.sum():
                best = inliers
    for _ in range(4):
        plane = fit_to(points[best])
        best = np.abs(points @ plane[:3] + plane[3]) <= threshold
    return plane, best
"""
_START = "def find_plane(points, up, threshold):\n"


def _of(body: str) -> str:
    return _FIT + _START + body


def _searching(body: str) -> str:
    return _FIT + _SEARCH + _START + body


def _one_after_another(pick: str, planes: int, tries: int = 600, least: float = 0.0) -> str:
    """The lesson's recipe: planes, one after the other; of the level ones that which `pick` says."""
    return _searching(
        "    rng, found, left = np.random.default_rng(0), [], points\n"
        f"    while len(found) < {planes} and len(left) > 10:\n"
        f"        plane, inliers = search(left, threshold, {tries}, rng, lambda normal: True)\n"
        f"        if inliers.sum() < {least} * len(points):\n"
        "            break\n"
        "        found.append((plane, left[inliers]))\n"
        "        left = left[~inliers]\n"
        "    level = [one for one in found if abs(one[0][:3] @ up) > np.cos(np.radians(12))]\n"
        f"    return {pick}[0] if level else np.append(up, 0.0)\n"
    )


def _three_level(pick: str) -> str:
    """The lowest ("min") or the highest ("max") of the three largest level planes."""
    return _searching(
        "    square, found, left = np.cos(np.radians(12)), [], points\n"
        "    for i in range(3):\n"
        "        plane, inliers = search(left, threshold, 6000, i, lambda normal: abs(normal @ up) > square)\n"
        "        found.append((plane, left[inliers]))\n"
        "        left = left[~inliers]\n"
        f"    return {pick}(found, key=lambda one: np.median(one[1] @ up))[0]\n"
    )


_LARGEST = "max(found, key=lambda one: len(one[1]))"
_LOWEST = "min(level, key=lambda one: np.median(one[1] @ up))"

FIND_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "the plane that most points agree with, as in the lesson: here that is a wall; look for level planes, and take "
        "the lowest",
        _searching("    return search(points, threshold, 1000, 0, lambda normal: True)[0]\n"),
        variants=(
            _searching("    return search(points, threshold, 1000, 1, lambda normal: abs(normal[2]) > -1)[0]\n"),
            _one_after_another(_LARGEST, 4),
        ),
    ),
    Misconception(
        "the largest level plane",
        "the largest level plane, which is a table's top: the floor is the lowest level plane that has points enough",
        _searching(
            "    square = np.cos(np.radians(12))\n"
            "    return search(points, threshold, 3000, 0, lambda normal: abs(normal @ up) > square)[0]\n"
        ),
    ),
    Misconception(
        "too few planes",
        "the lowest level plane of the few largest: rooms differ in how many outnumber the floor, so go on as long as "
        "one point in ten lies on the next",
        _one_after_another(_LOWEST, 3),
        variants=(_one_after_another(_LOWEST, 4), _one_after_another(_LOWEST, 5), _three_level("min")),
    ),
    Misconception(
        "no support asked for",
        "the lowest of all level planes, however few points lie on it: a reflection, not the floor; stop when less "
        "than one point in ten lies on the next",
        _one_after_another(_LOWEST, 10),
        variants=(_one_after_another(_LOWEST, 12, 300),),
    ),
    Misconception(
        "too few tries",
        "too few samples for each plane, so that some are not found: task 1 says how many, and seven rooms of several "
        "planes each need more than 0.99",
        _one_after_another(_LOWEST, 10, 50),
        variants=(_one_after_another(_LOWEST, 99, 50, 0.1),),
    ),
    Misconception(
        "the highest level plane",
        "the highest level plane: heights grow along up, and the floor is the lowest",
        _three_level("max"),
    ),
    Misconception(
        "up for the normal",
        "up taken for the floor's normal: it is several degrees off; let the floor's points say how it lies",
        _START + "    return np.append(up, -np.quantile(points @ up, 0.1))\n",
        variants=(
            _START + "    heights = points @ up\n"
            "    steps = np.linspace(heights.min(), heights.min() + 1, 400)\n"
            "    near = np.abs(heights[:, None] - steps) < threshold\n"
            "    return np.append(up, -steps[near.sum(axis=0).argmax()])\n",
            _START + "    return np.append(up, -(points @ up).min())\n",
        ),
    ),
    Misconception(
        "fit to the lowest points",
        "a fit to the lowest points: reflections lie below the floor, and up is several degrees off; vote instead",
        _of("    heights = points @ up\n    return fit_to(points[heights <= np.quantile(heights, 0.1)])\n"),
        variants=(
            _of("    heights = points @ up\n    return fit_to(points[heights <= np.quantile(heights, 0.2)])\n"),
            _of("    heights = points @ up\n    return fit_to(points[heights <= np.quantile(heights, 0.05)])\n"),
            _of("    heights = points @ up\n    return fit_to(points[heights <= heights.min() + 0.1])\n"),
        ),
    ),
    Misconception(
        "fit to all points",
        "a fit to all points, in which the farthest weigh most: find out who belongs to the floor first",
        _of("    return fit_to(points)\n"),
    ),
    Misconception(
        "n · p = 1 of all points",
        "n · p = 1 solved for all points: all have their say; find out who belongs to the floor first",
        _START + "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
    ),
    Misconception(
        "least squares in z of all points",
        "least squares in z over all points: errors along the camera's z, and of points that are not the floor's",
        _START + "    columns = np.column_stack([points[:, :2], np.ones(len(points))])\n"
        "    a, b, c = np.linalg.lstsq(columns, points[:, 2], rcond=None)[0]\n"
        "    return np.array([a, b, -1.0, c]) / np.sqrt(a * a + b * b + 1)\n",
    ),
    Misconception(
        "z for up",
        "levels and heights told by the camera's z: the points are in its frame, where up is the direction given",
        _of("    heights = points[:, 2]\n    return fit_to(points[heights <= np.quantile(heights, 0.1)])\n"),
        variants=(_START + "    return np.array([0.0, 0.0, 1.0, -np.quantile(points[:, 2], 0.1)])\n",),
    ),
)
