"""The wrong answers to task 2 of lab 04, a voxel grid, as learner code: built from parts, one or two of them wrong."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_grid(
    index: str = "np.floor((points - origin) / voxel)", result: str = "", full: str = "count >= least"
) -> str:
    result = result or "np.array([points[which == i].mean(axis=0) for i in np.flatnonzero(full)])"
    return (
        "def voxel_centroids(points, voxel, origin, least):\n"
        f"    index = {index}\n"
        "    cubes, which, count = np.unique(index, axis=0, return_inverse=True, return_counts=True)\n"
        "    which = which.reshape(-1)\n"
        f"    full = {full}\n"
        "    total, last = np.zeros((len(cubes), 3)), np.zeros((len(cubes), 3))\n"
        "    np.add.at(total, which, points)\n"
        "    last[which] += points\n"
        f"    return {result}\n"
    )


_OTHER_GRIDS = {
    "int() for floor()": (
        "((points - origin) / voxel).astype(int)",
        "numbers cut off towards zero, so that the cubes on both sides of the origin become one: use np.floor",
    ),
    "rounding for floor()": (
        "np.rint((points - origin) / voxel)",
        "numbers rounded to the nearest: that is another grid, half a voxel beside; round down with np.floor",
    ),
    "origin forgotten": (
        "np.floor(points / voxel)",
        "a grid that begins at the zero of the frame: subtract the origin before you divide",
    ),
    "grid from the lowest point": (
        "np.floor((points - points.min(axis=0)) / voxel)",
        "a grid that begins at the lowest point of the cloud: it begins at `origin`",
    ),
    "height left out": (
        "np.floor((points - origin) / voxel)[:, :2]",
        "columns in the place of cubes, which merge the floor with what stands on it: number the cubes along z, too",
    ),
}
_OTHER_CHOICES = {
    "more than for at least": (
        "count > least",
        "cubes with exactly `least` points left out: at least means count >= least",
    ),
    "nearly empty cubes kept": (
        "count >= 1",
        "every cube that holds a point, so that a stray one counts as much as a full cube: keep count >= least",
    ),
}
_OTHER_RESULTS = {
    "centres of the cubes": (
        "(cubes[full] + 0.5) * voxel + origin",
        "the middle of each cube in the place of the mean of its points: nothing was measured there",
    ),
    "first point of each cube": (
        "np.array([points[which == i][0] for i in np.flatnonzero(full)])",
        "one point of each cube and not their mean: noise is not averaged then",
    ),
    "sums not divided": (
        "total[full]",
        "the sum of the points of each cube: divide it by how many there are",
    ),
}


_WITH_OTHER_RESULTS = ("int() for floor()", "origin forgotten")


def _one_point(choice: str) -> str:
    return f"np.array([(lambda p: p[{choice}])(points[which == i]) for i in np.flatnonzero(full)])"


def _two_at_once() -> tuple[Misconception, ...]:
    """Another grid, and another choice of its cubes or another point of each."""
    made = []
    for grid, (index, first) in _OTHER_GRIDS.items():
        for others, part in ((_OTHER_CHOICES, "full"), (_OTHER_RESULTS, "result")):
            if grid == "grid from the lowest point" or (part == "result" and grid not in _WITH_OTHER_RESULTS):
                continue
            for name, (code, second) in others.items():
                message = f"two mistakes: {first}; and {second}"
                made.append(Misconception(f"{grid} and {name}", message, _wrong_grid(index, **{part: code})))
    for name, (code, first) in _OTHER_RESULTS.items():
        short = name.removesuffix(" cube")
        for choice, (full, second) in _OTHER_CHOICES.items():
            source = _wrong_grid(result=code, full=full)
            made.append(Misconception(f"{short} and {choice}", f"two mistakes: {first}; and {second}", source))
    return tuple(made)


GRID_MISTAKES = (
    *(Misconception(name, says, _wrong_grid(index)) for name, (index, says) in _OTHER_GRIDS.items()),
    *(Misconception(name, says, _wrong_grid(full=full)) for name, (full, says) in _OTHER_CHOICES.items()),
    *(
        Misconception(
            name,
            says,
            _wrong_grid(result=result),
            variants=(_wrong_grid(result=_one_point("-1")),) if name.startswith("first") else (),
        )
        for name, (result, says) in _OTHER_RESULTS.items()
    ),
    *_two_at_once(),
    Misconception(
        "few for many",
        "the cubes kept that hold few points, and the full ones left out: keep count >= least",
        _wrong_grid(full="count < least"),
        variants=(_wrong_grid(full="count <= least"),),
    ),
    Misconception(
        "median for mean",
        "the median of each coordinate in a cube: the centroid is the mean",
        _wrong_grid(result="np.array([np.median(points[which == i], axis=0) for i in np.flatnonzero(full)])"),
    ),
    Misconception(
        "a corner of the points",
        "the smallest, or largest, coordinates of the points of each cube: take their mean",
        _wrong_grid(result="np.array([points[which == i].min(axis=0) for i in np.flatnonzero(full)])"),
        variants=(_wrong_grid(result="np.array([points[which == i].max(axis=0) for i in np.flatnonzero(full)])"),),
    ),
    Misconception(
        "a measured point for the mean",
        "the measured point nearest to the middle of each cube or of its points: return their mean itself",
        _wrong_grid(result=_one_point("np.linalg.norm(p - p.mean(axis=0), axis=1).argmin()")),
        variants=(
            _wrong_grid(
                result=_one_point("np.linalg.norm(p - (cubes[i] + 0.5) * voxel - origin, axis=1).argmin()").replace(
                    "(lambda p:", "(lambda p, i=i:"
                )
            ),
        ),
    ),
    Misconception(
        "one number for three",
        "the three numbers of a cube made one, which different cubes share (1 + 2 is 2 + 1): tell cubes apart by all "
        "three, with axis=0 or a tuple",
        _wrong_grid("np.floor((points - origin) / voxel).sum(axis=1, keepdims=True)"),
        variants=(_wrong_grid("np.floor((points - origin) / voxel).prod(axis=1, keepdims=True)"),),
    ),
    Misconception(
        "another axis left out",
        "cubes told apart along two axes only, so that all along the third becomes one: number them along x, y and z",
        _wrong_grid("np.floor((points - origin) / voxel)[:, 1:]"),
        variants=(_wrong_grid("np.floor((points - origin) / voxel)[:, [0, 2]]"),),
    ),
    Misconception(
        "halves of halves",
        "the middle between the mean so far and the next point: the last points count most; add up, then divide once",
        "def voxel_centroids(points, voxel, origin, least):\n"
        "    mean, count = {}, {}\n"
        "    for p in points:\n"
        "        cube = tuple(np.floor((p - origin) / voxel))\n"
        "        mean[cube] = (mean[cube] + p) / 2 if cube in mean else p\n"
        "        count[cube] = count.get(cube, 0) + 1\n"
        "    return np.array([mean[cube] for cube in mean if count[cube] >= least])\n",
    ),
    Misconception(
        "only neighbours in the list",
        "points put together only where they follow each other in the list: those of a cube lie anywhere in it; sort "
        "first, or use np.unique or a dict",
        "from itertools import groupby\n"
        "def voxel_centroids(points, voxel, origin, least):\n"
        "    numbers = lambda p: tuple(np.floor((p - origin) / voxel))\n"
        "    held = [np.array(list(one)) for _, one in groupby(points, numbers)]\n"
        "    return np.array([one.mean(axis=0) for one in held if len(one) >= least]).reshape(-1, 3)\n",
    ),
    Misconception(
        "origin not added back",
        "centroids counted from the origin of the grid: take the mean of the points as they were given",
        _wrong_grid(result="total[full] / count[full][:, None] - origin"),
    ),
    Misconception(
        "divided by another number",
        "the sum of the points of each cube divided by another number than how many points this cube holds",
        _wrong_grid(result="total[full] / least"),
        variants=tuple(
            _wrong_grid(result=f"total[full] / {number}")
            for number in ("len(points)", "len(cubes)", "(count[full][:, None] - 1)", "(count[full][:, None] + 1)")
        ),
    ),
    Misconception(
        "numbers of the cubes",
        "the numbers of the cubes: return the mean of the points in each, in metres",
        _wrong_grid(result="cubes[full]"),
    ),
    Misconception(
        "one for each point",
        "a row for each point: return each cube once",
        _wrong_grid(result="(total / count[:, None])[which]"),
        variants=(_wrong_grid(result="(total / count[:, None])[which][full[which]]"),),
    ),
    Misconception(
        "corners of the cubes",
        "the numbers of the cubes times the voxel, which are their corners: return the mean of the points in each cube",
        _wrong_grid(result="cubes[full] * voxel + origin"),
    ),
    Misconception(
        "middle of the extremes",
        "the middle between smallest and largest coordinates of each cube: the centroid is the mean of all its points",
        _wrong_grid(
            result="np.array([(points[which == i].min(axis=0) + points[which == i].max(axis=0)) / 2 "
            "for i in np.flatnonzero(full)])"
        ),
    ),
    Misconception(
        "+= with repeated indices",
        "total[which] += points, which adds only one of the points of a cube: use np.add.at(total, which, points)",
        _wrong_grid(result="last[full] / count[full][:, None]"),
    ),
    Misconception(
        "the lesson's own code",
        "the lesson's voxel_grid as it stands: here cubes that hold fewer than `least` points are left out, and the "
        "centroids come back alone, without the counts",
        "def voxel_centroids(points, voxel, origin, least):\n"
        "    index = np.floor((points - origin) / voxel).astype(int)\n"
        "    cubes, which, count = np.unique(index, axis=0, return_inverse=True, return_counts=True)\n"
        "    total = np.zeros((len(cubes), 3))\n"
        "    np.add.at(total, which.ravel(), points)\n"
        "    return total / count[:, None], count\n",
    ),
    Misconception(
        "counts returned as well",
        "the centroids and the counts in one answer: return the centroids alone",
        _wrong_grid(result="(total[full] / count[full][:, None], count[full])"),
    ),
)
