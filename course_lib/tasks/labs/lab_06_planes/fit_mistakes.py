"""The wrong answers of task 2 of lab 06, fitting a plane, as learner code: the plain solution with one thing wrong."""

from __future__ import annotations

from course_lib.tasks.core import Misconception


def _wrong_fit(
    scatter: str = "(points - middle).T @ (points - middle)",
    pick: str = "vectors[:, 0]",
    offset: str = "-normal @ middle",
    middle: str = "points.mean(axis=0)",
    solve: str = "eigh",
) -> str:
    return (
        "def fit_plane(points):\n"
        f"    middle = {middle}\n"
        f"    values, vectors = np.linalg.{solve}({scatter})\n"
        f"    normal = {pick}\n"
        f"    return np.append(normal, {offset})\n"
    )


def _through(rows: str) -> str:
    """The plane through three points, by their numbers."""
    return (
        f"def fit_plane(points):\n    a, b, c = points[{rows}]\n    normal = np.cross(b - a, c - a)\n"
        "    normal = normal / np.linalg.norm(normal)\n    return np.append(normal, -normal @ a)\n"
    )


def _along(axis: int, constant: bool = True, end: str = "") -> str:
    """Least squares with errors along one axis, with or without a constant, and what is done at the end."""
    ones = ", np.ones(len(points))" if constant else ""
    return (
        f"def fit_plane(points):\n    others = np.delete(points, {axis}, axis=1)\n"
        f"    columns = np.column_stack([others{ones}])\n"
        f"    fitted = np.linalg.lstsq(columns, points[:, {axis}], rcond=None)[0]\n"
        f"    plane = np.append(np.insert(fitted[:2], {axis}, -1.0), {'fitted[2]' if constant else '0.0'})\n"
        f"{end}    return plane / np.linalg.norm(plane[:3])\n"
    )


FIT_MISTAKES = (
    Misconception(
        "mean not subtracted",
        "a scatter of points about the origin, which mostly says where they lie: subtract their mean first",
        _wrong_fit("points.T @ points"),
        variants=(_wrong_fit("points.T @ points", offset="0.0"),),
    ),
    Misconception(
        "largest eigenvector",
        "the direction in which the points spread most, which lies in the plane: take the eigenvector of the smallest "
        "eigenvalue",
        _wrong_fit(pick="vectors[:, 2]"),
    ),
    Misconception(
        "rows for columns",
        "a row of the matrix of eigenvectors: eigh returns them as columns, vectors[:, 0]",
        _wrong_fit(pick="vectors[0]"),
    ),
    Misconception(
        "least squares in z",
        "errors measured along z, not across the plane, so steep planes come out too flat: use the scatter matrix",
        _along(2),
    ),
    Misconception(
        "least squares in x",
        "errors measured along x, not across the plane: use the scatter matrix, which knows no axis",
        _along(0),
    ),
    Misconception(
        "least squares in y",
        "errors measured along y, not across the plane: use the scatter matrix, which knows no axis",
        _along(1),
    ),
    Misconception(
        "z without a constant",
        "z = a x + b y without a constant, as if the plane went through the origin, and errors along z",
        _along(2, constant=False),
        variants=(_along(2, constant=False, end="    plane[3] = -plane[:3] @ points.mean(axis=0)\n"),),
    ),
    Misconception(
        "n · p = 1",
        "least squares of n · p = 1, which measures no distances: far planes weigh less; use the scatter matrix",
        "def fit_plane(points):\n"
        "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
    ),
    Misconception(
        "columns of Vt",
        "a column of svd's third result: the directions are its rows, and the last one has the smallest spread",
        _wrong_fit("points - middle", "vectors[:, 2]", solve="svd").replace("values, vectors", "_, values, vectors"),
    ),
    Misconception(
        "median for the mean",
        "the median of the points in the place of their mean: the best plane goes through the mean",
        _wrong_fit(middle="np.median(points, axis=0)"),
    ),
    Misconception(
        "middle of the box",
        "the middle of the smallest and the largest coordinates: the best plane goes through the mean of the points",
        _wrong_fit(middle="(points.min(axis=0) + points.max(axis=0)) / 2"),
    ),
    Misconception(
        "mean of all numbers",
        "one mean of all x, y and z together: axis=0 gives one for each coordinate",
        _wrong_fit(middle="np.full(3, points.mean())"),
    ),
    Misconception(
        "offset of one point",
        "the offset of one noisy point: the plane goes through the mean, d = -n · mean",
        _wrong_fit(offset="-normal @ points[0]"),
        variants=(_wrong_fit(offset="-normal @ points[-1]"),),
    ),
    Misconception(
        "the distance of the mean",
        "the distance of the mean from the origin in the place of d: project the mean on the normal, d = -n · mean",
        _wrong_fit(offset="-np.linalg.norm(middle)"),
        variants=(_wrong_fit(offset="np.linalg.norm(middle)"),),
    ),
    Misconception(
        "axis of least spread",
        "the coordinate that spreads least taken for the normal: boards are seldom parallel to an axis",
        _wrong_fit(pick="np.eye(3)[np.argmin(points.std(axis=0))]"),
    ),
    Misconception(
        "mean not subtracted and wrong sign",
        "a scatter about the origin, and d with the wrong sign: subtract the mean first, and d = -n · mean",
        _wrong_fit("points.T @ points", offset="normal @ middle"),
    ),
    Misconception(
        "offset with the wrong sign",
        "a plane on the other side of the origin: n · x + d is 0 at the mean, so d is minus their product",
        _wrong_fit(offset="normal @ middle"),
    ),
    Misconception(
        "offset forgotten",
        "a plane through the origin: it must go through the mean of the points, so d = -n · mean",
        _wrong_fit(offset="0.0"),
    ),
    Misconception(
        "first three points",
        "the plane through three points only, with all their noise: every point has its say",
        _through(":3"),
        variants=(_through("[0, len(points) // 2, -1]"),),
    ),
)
