"""The wrong answers of lab 07's step of ICP, as learner code: what is left of the given mistakes, and new ones."""

from __future__ import annotations

from course_lib.tasks.core import Misconception
from course_lib.tasks.mistakes import left_in, mended

_GIVEN_MISTAKES = {
    "pairs": ("source", "moved", "partners looked for where the source began: look from where T has moved it"),
    "order": ("T @ step", "step @ T", "T @ step, which applies the new step before the old ones: it stands leftmost"),
    "fitness": (
        "near[keep].size / max(keep.sum(), 1)",
        "keep.sum() / len(source)",
        "a fitness that is 1 always: divide the pairs kept by all source points",
    ),
}


def _wrong_step(
    left: tuple[str, ...] = (),
    *,
    reject: str = "distance <= radius",
    share: str = "",
    moved: str = "source @ T[:3, :3].T + T[:3, 3]",
    p: str = "moved[keep]",
    q: str = "target[near[keep]]",
    rotation: str = "Vt.T @ guard @ U.T",
    shift: str = "q.mean(axis=0) - step[:3, :3] @ p.mean(axis=0)",
    centred: str = "(p - p.mean(axis=0)).T @ (q - q.mean(axis=0))",
    after: str = "",
    again: str = "keep",
) -> str:
    """The given code with some of its three mistakes still in it, or with others; `again` is kept for the fitness."""
    pairs, order, fitness = mended(_GIVEN_MISTAKES, left)
    return (
        "def icp_step(source, target, T, radius):\n"
        f"    moved = {moved}\n"
        f"    distances = np.linalg.norm({pairs}[:, None] - target[None], axis=2)\n"
        "    near, distance = distances.argmin(axis=1), distances.min(axis=1)\n"
        f"    keep = {reject}\n"
        f"    p, q = {p}, {q}\n"
        f"    U, _, Vt = np.linalg.svd({centred})\n"
        "    guard = np.diag([1, 1, np.linalg.det(Vt.T @ U.T)])\n"
        "    step = np.eye(4)\n"
        f"    step[:3, :3] = {rotation}\n"
        f"    step[:3, 3] = {shift}\n"
        f"    keep = {again}\n"
        f'    return {{"T": {after or order}, "fitness": float({share or fitness})}}\n'
    )


_AFTER = "np.linalg.norm((moved @ step[:3, :3].T + step[:3, 3])[:, None] - target[None], axis=2).min(axis=1) <= radius"
MEND_MISTAKES = (
    *left_in(_GIVEN_MISTAKES, _wrong_step),
    *(
        Misconception(
            f"{' and '.join(left)} left in, share of the target",
            f"{'; and '.join(_GIVEN_MISTAKES[name][2] for name in left)}; and a fitness divided by the target's points",
            _wrong_step(left, share="keep.sum() / len(target)"),
        )
        for left in (("pairs",), ("order",), ("pairs", "order"))
    ),
    Misconception(
        "share of the target",
        "a fitness that divides by the target's points: it is a share of the source's",
        _wrong_step(share="keep.sum() / len(target)"),
    ),
    Misconception(
        "a count for the fitness",
        "the number of pairs where their share is asked: divide by the number of source points",
        _wrong_step(share="keep.sum()"),
    ),
    Misconception(
        "fitness after the step",
        "the fitness after the step, where the one before it is asked: count the pairs that the step was made from",
        _wrong_step(again=_AFTER),
    ),
    Misconception(
        "different partners counted",
        "a count of different target points, each once: count the source points that found a partner",
        _wrong_step(share="len(np.unique(near[keep])) / len(source)"),
        variants=(_wrong_step(share="len(np.unique(near[keep])) / len(target)"),),
    ),
    Misconception(
        "target points counted",
        "the share of the target points that have a source point near: look from each source point",
        _wrong_step(share="(distances.min(axis=0) <= radius).mean()"),
        variants=(_wrong_step(share="(distances.min(axis=0) <= radius).sum() / len(source)"),),
    ),
    Misconception(
        "a distance for the fitness",
        "a distance where a share is asked: the fitness counts the pairs and does not measure them",
        _wrong_step(share="distance[keep].mean()"),
        variants=(
            _wrong_step(share="np.sqrt(np.mean(distance[keep] ** 2))"),
            _wrong_step(share="distance.mean()"),
            _wrong_step(share="np.sqrt(np.mean(distance ** 2))"),
        ),
    ),
    Misconception(
        "the lesson's own code",
        "every pair kept, however far, as in the lesson's first loop: keep those within the radius, and count them",
        _wrong_step(reject="distance >= 0"),
    ),
    Misconception(
        "every pair in the fit",
        "a step made from every pair, although the fitness counts only the kept: the fit takes the same pairs",
        _wrong_step(p="moved", q="target[near]"),
    ),
    Misconception(
        "keep turned round",
        "the far pairs kept and the near ones rejected: keep is distance <= radius",
        _wrong_step(reject="distance > radius"),
    ),
    Misconception(
        "squared distance against the radius",
        "a squared distance compared with the radius, which lets far pairs in: take the root, or square the radius",
        _wrong_step(reject="distance**2 <= radius"),
    ),
    Misconception(
        "step alone",
        "the newest step alone: T is all of the motion so far, so step @ T",
        _wrong_step(after="step"),
    ),
    Misconception(
        "T as it was",
        "T as it came in: the step was never put onto it",
        _wrong_step(after="T"),
    ),
    Misconception(
        "step the wrong way",
        "the inverse of the step: it moves the points away from their partners, as q belongs to the target",
        _wrong_step(after="np.linalg.inv(step) @ T"),
    ),
    Misconception(
        "old motion inverted",
        "the inverse of the old motion: T maps the source to the target already, so step @ T",
        _wrong_step(after="step @ np.linalg.inv(T)"),
        variants=(_wrong_step(after="np.linalg.inv(T) @ step"),),
    ),
    Misconception(
        "step added or multiplied by *",
        "step and T added, or multiplied entry by entry: two motions one after the other are the product step @ T",
        _wrong_step(after="step + T"),
        variants=(_wrong_step(after="step * T"),),
    ),
    Misconception(
        "fitted from where the source began",
        "a step fitted to the source as given and then put onto T as well, so that T counts twice: fit p = moved[keep]",
        _wrong_step(p="source[keep]"),
        variants=(_wrong_step(p="source[keep]", after="T @ step"),),
    ),
    Misconception(
        "partners of other points",
        "points laid on the partners of others: p and q need the same rows, moved[keep] and target[near[keep]]",
        _wrong_step(q="target[near][: keep.sum()]"),
        variants=(
            _wrong_step(q="target[np.sort(near[keep])]"),
            _wrong_step(q="target[: keep.sum()]"),
            _wrong_step(q="target[: len(source)][keep]"),
        ),
    ),
    Misconception(
        "moved by the transposed rotation",
        "points as rows moved by R in the place of its transpose: the given source @ T[:3, :3].T was right",
        _wrong_step(moved="source @ T[:3, :3] + T[:3, 3]"),
    ),
    Misconception(
        "moved without the shift",
        "a source that was turned but not shifted: moved needs + T[:3, 3]",
        _wrong_step(moved="source @ T[:3, :3].T"),
    ),
    Misconception(
        "rotation of the step transposed",
        "the step's rotation transposed, or p and q exchanged in its SVD: (U G Vᵀ)ᵀ = V G Uᵀ was right as given, so put "
        "`.T` back",
        _wrong_step(rotation="U @ guard @ Vt"),
    ),
    Misconception(
        "step not centred",
        "a step from points that were not centred: the given p − its mean and q − its mean were right",
        _wrong_step(centred="p.T @ q"),
    ),
    Misconception(
        "step without a turn",
        "a step that only shifts: the given rotation from the SVD was right",
        _wrong_step(rotation="np.eye(3)"),
    ),
    Misconception(
        "shift of the step without R",
        "the step's shift as the difference of the means: the given q mean − R · p mean was right",
        _wrong_step(shift="q.mean(axis=0) - p.mean(axis=0)"),
    ),
)
