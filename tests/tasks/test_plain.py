"""Plain data: what crosses, what is refused, and that the wire changes nothing."""

from __future__ import annotations

import json
import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from course_lib.tasks import from_wire, plain, to_wire
from course_lib.tasks.plain import describe, same

POINT = np.dtype({"names": ["x", "rgb"], "formats": ["<f4", ("<u1", (3,))], "offsets": [0, 16], "itemsize": 32})
DTYPES = st.sampled_from(["bool", "i1", "<i2", ">i4", "<i8", "u1", ">u2", "<u4", "<f2", "<f4", ">f8"])
SCALARS = (
    st.none() | st.booleans() | st.integers(-(2**62), 2**62) | st.floats() | st.text(max_size=8) | st.binary(max_size=8)
)
ARRAYS = DTYPES.flatmap(lambda dtype: hnp.arrays(dtype, hnp.array_shapes(max_dims=3, max_side=4, min_side=0)))
KEYS = st.text(max_size=5) | st.integers(-9, 9)
PLAIN = st.recursive(
    SCALARS | ARRAYS,
    lambda part: st.lists(part, max_size=3) | st.dictionaries(KEYS, part, max_size=3),
    max_leaves=6,
)


@settings(deadline=None)
@given(PLAIN)
def test_the_wire_changes_nothing(value: object) -> None:
    kept = plain(value)
    back = from_wire(to_wire(value))
    assert same(back, kept, 0.0)
    assert to_wire(back) == to_wire(value)


def test_records_keep_their_layout() -> None:
    points = np.zeros(3, POINT)
    points["x"], points["rgb"][1] = [1, 2, 3], (7, 8, 9)
    back = from_wire(to_wire({"points": points}))["points"]
    assert back.dtype.itemsize == 32
    assert back.dtype.fields["rgb"][1] == 16
    assert same(back, points)
    assert back["rgb"][1].tolist() == [7, 8, 9]


def test_plain_copies_and_normalises() -> None:
    image = np.arange(6, dtype=">u2").reshape(2, 3)
    copied = plain({"image": image, "pair": (1, np.float32(0.5)), "flag": np.bool_(True), "one": np.array(7)})
    image[:] = 0
    assert copied["image"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert copied["image"].dtype == np.dtype("=u2")
    assert copied["pair"] == [1, 0.5]
    assert copied["flag"] is True
    assert copied["one"] == 7 and type(copied["one"]) is int
    assert plain(np.array(["a", "b"])) == ["a", "b"]


def _endless() -> list:
    value: list = []
    value.append(value)
    return value


class Silly:
    def __len__(self) -> int:
        raise RuntimeError("never asked")


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (object(), "object of type object: return plain data"),
        (Silly(), "object of type Silly: np.asarray"),
        ((n for n in "ab"), "generator"),
        (len, "brackets of a call"),
        (int, "brackets of a call"),
        (1j, "complex"),
        ({1, 2}, "set, which has no order"),
        ({(1, 2): 3}, "as a key"),
        ({True: 3}, "as a key"),
        (np.array([object()]), "rows of different lengths"),
        (np.array([1j]), "dtype complex128"),
        (np.array(["2026-11-21"], "M8[D]"), "dtype datetime64"),
        (np.zeros(2, np.longdouble), "cannot be judged"),
        (np.ma.masked_all(3), "masked"),
        (np.zeros(2, [("a", "O")]), "dtype object"),
        (np.broadcast_to(0.0, (10_000, 10_000)), "64 MB"),
        ([b"x" * 40_000_000] * 2, "64 MB"),
        ([0] * 200_000, "return a NumPy array"),
        (_endless(), "nested more than 6 deep"),
        (2**64, "64 bits"),
        (-(10**5000), "64 bits"),
        ("x" * 30_000, "text of 30,000 letters"),
    ],
    ids=lambda value: value[:30] if isinstance(value, str) else "",
)
def test_refusals_are_one_sentence(value: object, words: str) -> None:
    with pytest.raises(ValueError, match="the answer") as caught:
        plain(value)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


def _message(tree: object, sizes: object, body: bytes = b"") -> bytes:
    head, text = json.dumps(sizes).encode(), json.dumps(tree).encode()
    return b"course-plain-1\n" + struct.pack("<II", len(head), len(text)) + head + text + body


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x80\x04N.",
        b"course-plain-1\n",
        to_wire(np.zeros(9))[:-1],
        to_wire(np.zeros(9)) + b"x",
        _message({"array": 0, "dtype": "O", "shape": [1]}, [8], b"12345678"),
        _message({"array": 0, "dtype": "<f8", "shape": [2]}, [8], b"12345678"),
        _message({"array": 0, "dtype": "<f8", "shape": [-1]}, [7], b"1234567"),
        _message({"array": 5, "dtype": "<f8", "shape": [1]}, [8], b"12345678"),
        _message({"array": 0, "dtype": "nonsense", "shape": [1]}, [8], b"12345678"),
        _message(
            {"array": 0, "dtype": {"names": ["a"], "formats": ["O"], "offsets": [0], "itemsize": 8}, "shape": [1]},
            [8],
            b"12345678",
        ),
        _message({"list": 3}, []),
        _message({"dict": [["a"]]}, []),
        _message({"dict": [[[1], 2]]}, []),
        _message([1, 2], []),
        _message({"other": 1}, []),
        _message(1, [-5, 5]),
        _message(1, ["a"]),
        _message(1, {"a": 1}),
        _message(1, 7),
        b"course-plain-1\n" + struct.pack("<II", 2**31, 2**31),
        b"course-plain-1\n" + struct.pack("<II", 2, 100_000) + b"[]" + b'{"list":[' * 11_111 + b"x",
    ],
    ids=lambda data: str(len(data)),
)
def test_the_wire_refuses_what_it_did_not_make(data: bytes) -> None:
    with pytest.raises(ValueError) as caught:
        from_wire(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (np.zeros((480, 640), np.float32), "a (480, 640) float32 array"),
        (1500, "1500"),
        (0.1 + 0.2, "0.3"),
        (None, "None"),
        (True, "True"),
        ("hi", "the text 'hi'"),
        ("x" * 50, "a text of 50 letters"),
        ([1, 2], "2 things in a tuple or list"),
        ({"a": 1}, "a dict with 1 entry"),
        (b"abc", "3 bytes"),
        (np.zeros(2, POINT), "a (2,) record array"),
    ],
)
def test_describe(value: object, words: str) -> None:
    assert describe(value) == words


def test_same_is_up_to_rounding() -> None:
    assert same(np.array([1.0, np.nan]), np.array([1.0 + 1e-9, np.nan]))
    assert same([1, {"a": 2.0}], [1, {"a": 2.0 + 1e-9}])
    assert same(math.nan, math.nan) and same(0.0, 0.0)
    assert not same(np.array([1.0]), np.array([1.1]))
    assert not same(np.zeros(3), np.zeros((3, 1)))
    assert not same(True, 1) and not same("a", 1) and not same(None, 0) and not same([1], [1, 2])
    assert not same(np.zeros(2), [0, 0])
