"""The wrong answers of task 2 of lab 06, a fit to points of unequal noise, as learner code: one thing wrong each."""

from __future__ import annotations

from course_lib.tasks.core import Misconception

_MEAN = "(w[:, None] * points).sum(axis=0) / w.sum()"
_SCATTER = "(w[:, None] * (points - middle)).T @ (points - middle)"


def _wrong_fit(
    w: str = "1 / sigma**2",
    middle: str = _MEAN,
    scatter: str = _SCATTER,
    pick: str = "vectors[:, 0]",
    offset: str = "-normal @ middle",
) -> str:
    return (
        f"def fit_plane(points, sigma):\n    w = {w}\n    middle = {middle}\n"
        f"    values, vectors = np.linalg.eigh({scatter})\n"
        f"    normal = {pick}\n"
        f"    return np.append(normal, {offset})\n"
    )


def _through(rows: str) -> str:
    """The plane through three points, by their numbers."""
    return (
        f"def fit_plane(points, sigma):\n    a, b, c = points[{rows}]\n    normal = np.cross(b - a, c - a)\n"
        "    normal = normal / np.linalg.norm(normal)\n    return np.append(normal, -normal @ a)\n"
    )


def _along(axis: int, weighted: bool = True) -> str:
    """Least squares with errors along one axis, weighted or not."""
    by = " / sigma" if weighted else ""
    return (
        f"def fit_plane(points, sigma):\n    others = np.delete(points, {axis}, axis=1)\n"
        "    columns = np.column_stack([others, np.ones(len(points))])\n"
        f"    fitted = np.linalg.lstsq((columns.T{by}).T, points[:, {axis}]{by}, rcond=None)[0]\n"
        f"    plane = np.append(np.insert(fitted[:2], {axis}, -1.0), fitted[2])\n"
        "    return plane / np.linalg.norm(plane[:3])\n"
    )


_ALONG = "errors measured along {0}, not across the plane{1}: use the scatter matrix, which knows no axis"

FIT_MISTAKES = (
    Misconception(
        "the lesson's own code",
        "a fit in which all points weigh alike: divide by sigma, so that a noisy point has less of a say",
        _wrong_fit("np.ones(len(points))"),
    ),
    Misconception(
        "weights in the mean alone",
        "a weighted mean, and a scatter in which all points weigh alike: the same weights belong into both",
        _wrong_fit(scatter="(points - middle).T @ (points - middle)"),
    ),
    Misconception(
        "weights in the scatter alone",
        "a weighted scatter about the plain mean: the best plane goes through the weighted mean",
        _wrong_fit(middle="points.mean(axis=0)"),
    ),
    Misconception(
        "weights of 1 / sigma",
        "weights of 1 / sigma: the distance is divided by sigma and then squared, so the weight is 1 / sigma**2",
        _wrong_fit("1 / sigma"),
    ),
    Misconception(
        "weights of 1 / sigma in the mean",
        "the right scatter about a mean weighted with 1 / sigma: the same weight, 1 / sigma**2, belongs in both, and "
        "(off * w).T @ (off * w) counts w twice",
        _wrong_fit("1 / sigma", scatter="((points - middle) * w[:, None]).T @ ((points - middle) * w[:, None])"),
    ),
    Misconception(
        "weights squared",
        "weights that come in twice: with 1 / sigma**2 in both factors of the scatter its weight is 1 / sigma**4",
        _wrong_fit(scatter="(w[:, None] * (points - middle)).T @ (w[:, None] * (points - middle))"),
        variants=(_wrong_fit("1 / sigma**4"),),
    ),
    Misconception(
        "noise for weight",
        "points weighted by their noise, so that the worst say most: the weight is 1 / sigma**2",
        _wrong_fit("sigma**2"),
        variants=(_wrong_fit("sigma"),),
    ),
    Misconception(
        "divided by sigma before the mean",
        "points divided by sigma, and only then their mean taken away: subtract the weighted mean first, then divide",
        "def fit_plane(points, sigma):\n"
        "    scaled = points / sigma[:, None]\n"
        "    centred = scaled - scaled.mean(axis=0)\n"
        "    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]\n"
        "    w = 1 / sigma**2\n"
        f"    return np.append(normal, -normal @ ({_MEAN}))\n",
        variants=(
            "def fit_plane(points, sigma):\n"
            "    scaled = points / sigma[:, None]\n"
            "    centred = scaled - scaled.mean(axis=0)\n"
            "    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]\n"
            "    return np.append(normal, -normal @ points.mean(axis=0))\n",
        ),
    ),
    Misconception(
        "weights not divided by their sum",
        "a weighted mean divided by the number of points: divide by the sum of the weights",
        _wrong_fit(middle="(w[:, None] * points).mean(axis=0)"),
        variants=(_wrong_fit(middle="(w[:, None] * points).sum(axis=0)"),),
    ),
    Misconception(
        "only the best points",
        "a fit to the points of least noise alone: the others know less, not nothing; give them less weight",
        _wrong_fit("(sigma <= np.median(sigma)).astype(float)"),
        variants=(_wrong_fit("(sigma < sigma.mean()).astype(float)"),),
    ),
    Misconception(
        "mean not subtracted",
        "a scatter of points about the origin, which mostly says where they lie: subtract their weighted mean first",
        _wrong_fit(scatter="(w[:, None] * points).T @ points"),
        variants=(
            _wrong_fit(scatter="(w[:, None] * points).T @ points", offset="0.0"),
            _wrong_fit(scatter="points.T @ points"),
        ),
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
        "columns of Vt",
        "a column of svd's third result: the directions are its rows, and the last one has the smallest spread",
        _wrong_fit(scatter="(points - middle) / sigma[:, None]", pick="vectors[:, 2]")
        .replace("eigh", "svd")
        .replace("values, vectors", "_, values, vectors"),
    ),
    Misconception("least squares in z", _ALONG.format("z", ", so steep planes come out too flat"), _along(2)),
    Misconception("least squares in x", _ALONG.format("x", ""), _along(0)),
    Misconception("least squares in y", _ALONG.format("y", ""), _along(1)),
    Misconception(
        "least squares in z, unweighted",
        "errors measured along z, not across the plane, and all points weighing alike: use the weighted scatter matrix",
        _along(2, weighted=False),
    ),
    Misconception(
        "n · p = 1",
        "least squares of n · p = 1, which measures no distances: far planes weigh less; use the scatter matrix",
        "def fit_plane(points, sigma):\n"
        "    normal = np.linalg.lstsq(points / sigma[:, None], 1 / sigma, rcond=None)[0]\n"
        "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
        variants=(
            "def fit_plane(points, sigma):\n"
            "    normal = np.linalg.lstsq(points, np.ones(len(points)), rcond=None)[0]\n"
            "    return np.append(normal, -1.0) / np.linalg.norm(normal)\n",
        ),
    ),
    Misconception(
        "median for the mean",
        "the median of the points in the place of their mean: the best plane goes through the weighted mean",
        _wrong_fit(middle="np.median(points, axis=0)"),
    ),
    Misconception(
        "mean of all numbers",
        "one mean of all x, y and z together: axis=0 gives one for each coordinate",
        _wrong_fit(middle="np.full(3, (w[:, None] * points).sum() / (3 * w.sum()))"),
        variants=(_wrong_fit(middle="np.full(3, points.mean())"),),
    ),
    Misconception(
        "offset by the plain mean",
        "the right normal, and an offset by the mean in which all points weigh alike: d = -n · weighted mean",
        _wrong_fit(offset="-normal @ points.mean(axis=0)"),
    ),
    Misconception(
        "offset of one point",
        "the offset of one noisy point: the plane goes through the weighted mean, d = -n · mean",
        _wrong_fit(offset="-normal @ points[0]"),
        variants=(_wrong_fit(offset="-normal @ points[-1]"), _wrong_fit(offset="-normal @ points[sigma.argmin()]")),
    ),
    Misconception(
        "the distance of the mean",
        "the distance of the mean from the origin in the place of d: project the mean on the normal, d = -n · mean",
        _wrong_fit(offset="-np.linalg.norm(middle)"),
        variants=(_wrong_fit(offset="np.linalg.norm(middle)"),),
    ),
    Misconception(
        "offset with the wrong sign",
        "a plane on the other side of the origin: n · x + d is 0 at the mean, so d is minus their product",
        _wrong_fit(offset="normal @ middle"),
    ),
    Misconception(
        "offset forgotten",
        "a plane through the origin: it must go through the weighted mean of the points, so d = -n · mean",
        _wrong_fit(offset="0.0"),
    ),
    Misconception(
        "first three points",
        "the plane through three points only, with all their noise: every point has its say",
        _through(":3"),
        variants=(_through("[0, len(points) // 2, -1]"), _through("np.argsort(sigma)[:3]")),
    ),
)
