"""Slips that a program can make by itself: of the answer, and of what the function was given.

They are the same for every task. A slip of the answer is made of the truth; a slip of an input is what the reference
answers when it is given something else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from course_lib.tasks.plain import Plain

MILLIMETRES = "millimetres and metres are a factor of 1000"
FACTORS = (
    (1000.0, "times 1000", f"1000 times the right value: {MILLIMETRES}"),
    (0.001, "divided by 1000", f"a thousandth of the right value: {MILLIMETRES}"),
    (100.0, "times 100", "100 times the right value: percent for a share, or centimetres for metres"),
    (0.01, "divided by 100", "a hundredth of the right value: a share for percent, or metres for centimetres"),
    (2.0, "doubled", "twice the right value: is something counted twice, or a half angle or half width taken whole?"),
    (0.5, "halved", "half of the right value: is something halved twice, or a whole angle or width taken half?"),
    (180 / np.pi, "degrees for radians", "degrees where radians are asked"),
    (np.pi / 180, "radians for degrees", "radians where degrees are asked"),
    (-1.0, "the sign", "the right value with the other sign: look at what is subtracted from what"),
)
WHOLE = (
    (np.floor, "rounded down", "rounded down"),
    (np.ceil, "rounded up", "rounded up"),
    (np.rint, "rounded", "rounded to whole numbers"),
    (np.trunc, "cut to whole numbers", "cut to whole numbers, as int() does: it goes towards 0, not down"),
)
TYPES = (
    (np.uint8, "8-bit overflow", "numbers of 8 bits that overflowed: 255 + 1 is 0 in them"),
    (np.int8, "signed 8-bit overflow", "signed numbers of 8 bits that overflowed: 127 + 1 is −128 in them"),
    (np.int16, "16-bit overflow", "numbers of 16 bits that overflowed"),
    (np.uint16, "unsigned 16-bit overflow", "unsigned numbers of 16 bits that overflowed: 0 − 1 is 65,535 in them"),
    (np.int32, "32-bit overflow", "numbers of 32 bits that overflowed"),
    (np.uint32, "unsigned 32-bit overflow", "unsigned numbers that overflowed: 0 − 1 is 4,294,967,295 in them"),
)
FEW = 4
"""A last axis of at most so many entries is taken for coordinates."""


@dataclass(frozen=True)
class Slip:
    """A slip: its name for reports, how "This looks like …" goes on, and what it makes of a value."""

    name: str
    message: str
    apply: Callable[[Any], Any]


def answer_slips(truth: Plain, axes: str = "xyz") -> Iterator[Slip]:
    """Slips that could have been made of a true answer; each applies to the truth of every case of the task."""
    if isinstance(truth, bool):
        yield Slip("turned round", "True where False is right, and the other way round", lambda t: not t)
    elif isinstance(truth, (int, float)):
        yield from (_of_number(slip) for slip in _numeric(np.zeros(())))
    elif isinstance(truth, np.ndarray) and truth.dtype.kind in "biuf":
        yield from _of_mask() if truth.dtype.kind == "b" else _numeric(truth)
        yield from _of_list(truth)
        if truth.ndim == 2:
            yield from _of_table(truth)
        if truth.ndim and 2 <= truth.shape[-1] <= FEW and truth.dtype.kind != "b" and truth.shape != (4, 4):
            yield from _of_components(truth.shape[-1], axes)
    elif isinstance(truth, Mapping):
        if all(isinstance(value, str) for value in truth.values()):
            yield from _exchanged_choices(truth)
        else:
            for key, value in truth.items():
                yield from (_of_entry(key, slip) for slip in answer_slips(value, axes))
    elif isinstance(truth, list) and truth and all(isinstance(one, (int, float)) for one in truth):
        yield from (_of_sequence(slip) for slip in answer_slips(np.asarray(truth), axes))


def _of_number(slip: Slip) -> Slip:
    return Slip(slip.name, slip.message, lambda t: slip.apply(np.asarray(t, float)).item())


def _of_sequence(slip: Slip) -> Slip:
    return Slip(slip.name, slip.message, lambda t: np.asarray(slip.apply(np.asarray(t))).tolist())


def _of_entry(key: str | int, slip: Slip) -> Slip:
    return Slip(f"{slip.name} in {key!r}", f"{slip.message}, in {key!r}", lambda t: {**t, key: slip.apply(t[key])})


def _exchanged_choices(truth: Mapping[Any, str]) -> Iterator[Slip]:
    for a, b in combinations(sorted(set(truth.values())), 2):
        other = {a: b, b: a}
        words = f"{a!r} and {b!r} exchanged: look once more at what tells these two apart"
        yield Slip(f"{a} and {b} exchanged", words, lambda t, o=other: {k: o.get(v, v) for k, v in t.items()})


def _numeric(truth: np.ndarray) -> Iterator[Slip]:
    for factor, name, words in FACTORS:
        yield Slip(name, words, lambda t, f=factor: t * f)
    for step, name in ((1.0, "one too many"), (-1.0, "one too few"), (0.5, "half too many"), (-0.5, "half too few")):
        size = "1" if abs(step) == 1 else "a half"
        words = f"{size} {'more' if step > 0 else 'less'} than right: is something counted from 1, or from an edge?"
        yield Slip(name, words, lambda t, s=step: t + s)
    for cut, name, words in WHOLE if truth.dtype.kind == "f" else ():
        yield Slip(name, words, lambda t, c=cut: c(t))
    for kind, name, words in TYPES:
        yield Slip(name, words, lambda t, k=kind: np.asarray(t, float).astype(np.int64).astype(k))
    yield Slip("squared", "the square of the right value", lambda t: t * t)
    yield Slip("the root", "the square root of the right value", lambda t: np.sqrt(np.abs(t)))
    yield Slip("upside down", "1 divided by the right value: a quotient is upside down", lambda t: 1 / t)
    yield Slip("1 minus it", "1 minus the right value: the opposite share", lambda t: 1 - t)
    yield Slip("the size only", "the right value without its sign: abs() took it away", np.abs)
    if truth.dtype.kind == "f":
        yield Slip("16-bit floats", "floats of 16 bits, which keep three digits", lambda t: np.asarray(t, np.float16))


def _of_mask() -> Iterator[Slip]:
    yield Slip("turned round", "True where False is right, and the other way round", lambda t: ~t)


def _of_list(truth: np.ndarray) -> Iterator[Slip]:
    if truth.ndim == 0 or truth.shape[0] < 3:
        return
    yield Slip("the first left out", "the first one left out: does a loop or a slice begin at 1?", lambda t: t[1:])
    yield Slip("the last left out", "the last one left out: a slice or a range ends before its end", lambda t: t[:-1])
    yield Slip("the first twice", "the first one twice", lambda t: np.concatenate([t[:1], t]))
    yield Slip("the last twice", "the last one twice", lambda t: np.concatenate([t, t[-1:]]))
    yield Slip("back to front", "the right values in the opposite order", lambda t: t[::-1])
    yield Slip("moved by one", "the right values, one place too late", lambda t: np.roll(t, 1, axis=0))
    yield Slip("moved back by one", "the right values, one place too early", lambda t: np.roll(t, -1, axis=0))
    if truth.ndim == 1:
        yield Slip("sorted", "the right values sorted: their order is lost", np.sort)


def _of_table(truth: np.ndarray) -> Iterator[Slip]:
    yield Slip("transposed", "rows and columns exchanged (transposed)", lambda t: t.T)
    if truth.shape[1] > FEW:
        yield Slip("mirrored", "left and right exchanged", lambda t: t[:, ::-1])
    if truth.shape[0] == truth.shape[1] and truth.shape[0] in (2, 3, 4) and truth.dtype.kind == "f":
        yield Slip("the inverse", "the inverse of the right matrix: it leads the other way", np.linalg.inv)
    if truth.shape == (4, 4):
        yield from _of_motion()


def _of_motion() -> Iterator[Slip]:
    def but(rotation: Callable[..., Any], shift: Callable[..., Any]) -> Callable[[np.ndarray], np.ndarray]:
        def made(t: np.ndarray) -> np.ndarray:
            R, p = t[:3, :3], t[:3, 3]
            out = np.eye(4)
            out[:3, :3], out[:3, 3] = rotation(R, p), shift(R, p)
            return out

        return made

    right, same = (lambda R, p: R), (lambda R, p: p)
    for name, words, rotation, shift in (
        ("rotation transposed", "a rotation the wrong way round: transposed", lambda R, p: R.T, same),
        ("rotation negated", "the rotation with the other sign: a mirror image", lambda R, p: -R, same),
        ("shift negated", "the shift with the other sign", right, lambda R, p: -p),
        ("shift forgotten", "the right rotation without its shift", right, lambda R, p: 0 * p),
        ("rotation forgotten", "the right shift without its rotation", lambda R, p: np.eye(3), same),
        ("shift not turned", "a shift that was not turned with the rotation", right, lambda R, p: R.T @ p),
        ("shift not turned, other sign", "a shift not turned, and negated", right, lambda R, p: -R.T @ p),
        ("shift turned twice", "a shift that was turned once more", right, lambda R, p: R @ p),
        ("both undone", "the rotation transposed and the shift negated", lambda R, p: R.T, lambda R, p: -p),
    ):
        yield Slip(name, words, but(rotation, shift))


def _of_components(count: int, axes: str) -> Iterator[Slip]:
    names = axes[:count] if len(axes) >= count else ["the first", "the second", "the third", "the fourth"][:count]
    for i in range(count):
        sign = np.ones(count)
        sign[i] = -1
        yield Slip(f"the sign of {names[i]}", f"{names[i]} with the other sign", lambda t, s=sign: t * s)
        for step in (1.0, -1.0, 0.5, -0.5):
            shift = np.zeros(count)
            shift[i] = step
            size = "1" if abs(step) == 1 else "a half"
            words = f"{names[i]} {size} too {'large' if step > 0 else 'small'}"
            yield Slip(words, f"{words}: counted from 1, or from an edge", lambda t, s=shift: t + s)
    for i, j in combinations(range(count), 2):
        order = list(range(count))
        order[i], order[j] = j, i
        words = f"{names[i]} and {names[j]} exchanged"
        yield Slip(words, words, lambda t, o=order: t[..., o])
    if count > 2:
        for move in (1, -1):
            words = f"the numbers of each row moved {'on' if move > 0 else 'back'} by one"
            yield Slip(words, words, lambda t, m=move: np.roll(t, m, axis=-1))


def input_slips(given: Mapping[str, Plain]) -> Iterator[Slip]:
    """Slips that could have been made of what a function is given; each applies to the given of every case."""
    for name, value in given.items():
        for slip in _of_input(value):
            words = slip.message.format(name=f"`{name}`")
            yield Slip(f"{name} {slip.name}", words, lambda g, n=name, s=slip: {**g, n: s.apply(g[n])})
    for a, b in combinations(given, 2):
        yield from _of_pairs(a, b, given)
        if _alike(given[a], given[b]):
            words = f"`{a}` and `{b}` exchanged"
            yield Slip(f"{a} and {b} exchanged", words, lambda g, a=a, b=b: {**g, a: g[b], b: g[a]})
            for one, other in ((a, b), (b, a)):
                words = f"`{one}` in the place of `{other}`"
                yield Slip(f"{one} for {other}", words, lambda g, one=one, other=other: {**g, other: g[one]})


def _of_pairs(a: str, b: str, given: Mapping[str, Plain]) -> Iterator[Slip]:
    """Two whole numbers: both counted from 1, or one from the end that the other is."""
    if not all(isinstance(given[name], int) and not isinstance(given[name], bool) for name in (a, b)):
        return
    for step, words in ((-1, "counted from 1 (one too small)"), (1, "one too large")):
        slip = f"`{a}` and `{b}` both {words}"
        yield Slip(f"{a} and {b} {words}", slip, lambda g, s=step: {**g, a: g[a] + s, b: g[b] + s})
    for one, other in ((a, b), (b, a)):
        slip = f"`{one}` counted from the other end, as `{other}` − 1 − `{one}`"
        yield Slip(f"{one} from the other end of {other}", slip, lambda g, x=one, y=other: {**g, x: g[y] - 1 - g[x]})


def _alike(a: Plain, b: Plain) -> bool:
    """Whether one could stand in the place of the other."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.ndim == b.ndim and a.dtype.kind == b.dtype.kind
    numbers = all(isinstance(one, (int, float)) and not isinstance(one, bool) for one in (a, b))
    return numbers or (isinstance(a, bool) and isinstance(b, bool))


def _of_input(value: Plain) -> Iterator[Slip]:
    if isinstance(value, bool):
        for fixed in (True, False):
            yield Slip(f"always {fixed}", f"{{name}} taken for {fixed} always", lambda v, f=fixed: f)
        yield Slip(
            "turned round", "{name} turned round: what is done when it is True belongs to False", lambda v: not v
        )
    elif isinstance(value, (int, float)):
        yield from _of_input_number(value)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iuf" and value.size:
        yield from _of_input_array(value)


def _of_input_number(value: float) -> Iterator[Slip]:
    yield Slip("ignored", "{name} never used (as if it were 1)", lambda v: type(v)(1))
    yield Slip("taken for 0", "{name} never used (as if it were 0)", lambda v: type(v)(0))
    yield Slip("counted from one", "{name} counted from 1 (one too small)", lambda v: v - 1)
    yield Slip("one too large", "{name} one too large", lambda v: v + 1)
    yield Slip("doubled", "{name} doubled", lambda v: v * 2)
    yield Slip("negated", "{name} with the other sign", lambda v: -v)
    yield Slip("squared", "{name} squared", lambda v: v * v)
    if isinstance(value, int):
        for kind, name, words in TYPES:
            yield Slip(name, f"{{name}} in {words}", lambda v, k=kind: np.int64(v).astype(k))
        yield Slip("divided by 4", "{name} in steps of 4 bytes instead of bytes", lambda v: v // 4)
        yield Slip("times 4", "{name} in bytes instead of steps of 4 bytes", lambda v: v * 4)
    else:
        yield Slip("rooted", "the square root of {name}", lambda v: float(np.sqrt(abs(v))))
        yield Slip("halved", "{name} halved", lambda v: v / 2)
        yield Slip("half too large", "{name} half a step too large", lambda v: v + 0.5)
        yield Slip("half too small", "{name} half a step too small", lambda v: v - 0.5)
        yield Slip("times 1000", f"{{name}} 1000 times too large: {MILLIMETRES}", lambda v: v * 1000)
        yield Slip("divided by 1000", f"{{name}} 1000 times too small: {MILLIMETRES}", lambda v: v / 1000)
        yield Slip("times 100", "{name} in percent instead of a share", lambda v: v * 100)
        yield Slip("1 minus it", "1 − {name} in the place of {name}", lambda v: 1 - v)
        yield Slip("upside down", "1 / {name} in the place of {name}", lambda v: 1 / v)
        yield Slip("in radians", "{name} converted to radians where it is not to be", lambda v: float(np.radians(v)))
        yield Slip("in degrees", "degrees taken for radians in {name}", lambda v: float(np.degrees(v)))
        yield Slip("cut to a whole number", "{name} cut to a whole number", lambda v: float(int(v)))


def _of_input_array(value: np.ndarray) -> Iterator[Slip]:
    if value.shape == (4, 4):
        yield Slip("ignored", "{name} never used", lambda v: np.eye(4))
        yield Slip("inverted", "the inverse of {name} in its place: it leads the other way", np.linalg.inv)
        for slip in _of_motion():
            yield Slip(slip.name, f"{{name}} with {slip.message}", slip.apply)
        return
    if value.ndim == 2 and value.shape[1] > FEW:
        yield Slip("read by columns", "rows and columns of {name} exchanged", lambda v: np.ascontiguousarray(v.T))
        yield Slip("upside down", "{name} read from its last row up", lambda v: v[::-1].copy())
        yield Slip("mirrored", "{name} read from right to left", lambda v: v[:, ::-1].copy())
    if value.dtype.kind == "f":
        yield Slip("times 1000", f"{{name}} 1000 times too large: {MILLIMETRES}", lambda v: v * 1000)
        yield Slip("divided by 1000", f"{{name}} 1000 times too small: {MILLIMETRES}", lambda v: v / 1000)
        yield Slip("negated", "{name} with the other sign", lambda v: -v)
        yield Slip("with 0 for NaN", "NaN in {name} taken for 0", lambda v: np.nan_to_num(v, nan=0.0))
        yield Slip("in 16-bit floats", "{name} in floats of 16 bits", lambda v: v.astype(np.float16).astype(v.dtype))
    if value.ndim >= 1 and len(value) > 3:
        yield Slip("without the first", "the first of {name} left out", lambda v: v[1:].copy())
        yield Slip("without the last", "the last of {name} left out", lambda v: v[:-1].copy())
    if value.ndim == 2 and value.shape[1] == 3 and value.dtype.kind == "f":
        for i, axis in enumerate("xyz"):
            sign = np.where(np.arange(3) == i, -1.0, 1.0)
            yield Slip(f"with {axis} negated", f"{axis} of {{name}} with the other sign", lambda v, s=sign: v * s)
        for i, j in combinations(range(3), 2):
            order = [0, 1, 2]
            order[i], order[j] = j, i
            words = f"{'xyz'[i]} and {'xyz'[j]} of {{name}} exchanged"
            yield Slip(words.replace("{name} ", ""), words, lambda v, o=order: v[:, o].copy())
