"""Notebooks as they really come: what can be read is read, what cannot is refused in one sentence."""

from __future__ import annotations

import json

import pytest
from grading_helpers import submission
from how_thorough import sample
from hypothesis import given, settings
from hypothesis import strategies as st

from course_lib.grading.intake.untrusted_notebook import IntakeLimits, Unreadable, notebook_of

CELL = {"cell_type": "code", "source": "x = 1", "metadata": {}, "outputs": []}


def text(**changed) -> bytes:
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [CELL]} | changed).encode()


def read(data: bytes, **limits: int):
    return notebook_of(data, IntakeLimits(**limits))


BAD = {
    "empty": (b"", "empty"),
    "only blanks": (b" \n ", "empty"),
    "a script": (b"import numpy as np\nx = 1\n", "not a notebook"),
    "a log-in page": (b"<!DOCTYPE html><html><body>log in</body></html>", "a web page"),
    "a zip renamed": (b"PK\x03\x04" + bytes(50), "not a notebook"),
    "a PDF renamed": (b"%PDF-1.7\n\xff\xfe\x00", "not a notebook"),
    "cut off": (submission("00")[:2000], "cut off"),
    "a list": (b"[1, 2]", "not a notebook"),
    "null": (b"null", "not a notebook"),
    "no cells": (b'{"nbformat": 4}', "not a notebook"),
    "cells of another kind": (text(cells={"a": 1}), "not a notebook"),
    "only text": (text(cells=[{"cell_type": "markdown", "source": "hi", "metadata": {}}]), "no code"),
    "cells that are no cells": (text(cells=[1, None, "x", []]), "no code"),
    "a bomb of brackets": (b"[" * 100_000, "too deep"),
    "a bomb of braces": (b'{"a":' * 5000 + b"1" + b"}" * 5000, "too deep"),
    "UTF-16 cut in the middle": (text().decode().encode("utf-16")[:-31], "encoding"),
    "a trailing comma": (b'{"cells": [1, ], "nbformat": 4, "metadata": {"a": 1}}', "not JSON"),
}


@pytest.mark.parametrize("kind", sorted(BAD))
def test_refused_in_one_sentence(kind):
    data, code = BAD[kind]
    with pytest.raises(Unreadable) as refused:
        read(data)
    assert refused.value.code == code
    sentence = refused.value.sentence
    assert sentence.endswith(".") and "\n" not in sentence and len(sentence) < 200


def test_limits_are_named():
    with pytest.raises(Unreadable, match="2000 is the most"):
        read(text(cells=[CELL] * 2001))
    with pytest.raises(Unreadable, match="may have 1 "):
        read(text(cells=[{**CELL, "source": "x" * 2_000_000}]), notebook_bytes=1_000_000)


GOOD = {
    "as saved": text(),
    "BOM": b"\xef\xbb\xbf" + text(),
    "UTF-16": text().decode().encode("utf-16"),
    "source as a list": text(cells=[{**CELL, "source": ["x ", "= 1"]}]),
    "no metadata": text(cells=[{"cell_type": "code", "source": "x = 1"}]),
    "metadata of another kind": text(cells=[{**CELL, "metadata": 7, "id": 9}]),
    "outputs of another kind": text(cells=[{**CELL, "outputs": {"a": "b"}}]),
    "tags of another kind": text(cells=[{**CELL, "metadata": {"tags": "task"}}]),
    "NaN": text().replace(b'"metadata": {}', b'"metadata": {"a": NaN, "b": Infinity}', 1),
    "a number of 5000 digits": text().replace(b'"metadata": {}', b'"metadata": {"a": ' + b"9" * 5000 + b"}", 1),
    "a key twice": text().replace(b'"nbformat": 4', b'"nbformat": 3, "nbformat": 4', 1),
    "strange cells beside": text(cells=[None, {"cell_type": "raw", "source": "r"}, {"cell_type": "code"}, CELL]),
    "cp1252": text(metadata={"author": "XX"}).replace(b"XX", "Zoë".encode("cp1252")),
    "null bytes": text(cells=[{**CELL, "source": "x\0 = 1"}]),
}


@pytest.mark.parametrize("kind", sorted(GOOD))
def test_what_can_be_read_is_read(kind):
    cells = [cell for cell in read(GOOD[kind]).cells if cell.source]
    assert [cell.source for cell in cells] == ["x = 1"]
    assert all(isinstance(cell.id, str) and cell.metadata.tags == [] and cell.outputs == [] for cell in cells)


@settings(max_examples=sample(150, 30), deadline=None)
@given(st.binary(max_size=300))
def test_random_bytes_are_refused_and_nothing_else(data):
    with pytest.raises(Unreadable):
        read(data)


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=sample(150, 30), deadline=None)
@given(st.fixed_dictionaries({"cells": VALUES, "metadata": VALUES}))
def test_random_json_is_read_or_refused(tree):
    try:
        nb = read(json.dumps(tree).encode())
    except Unreadable as refused:
        assert refused.code
    else:
        assert all(isinstance(cell.source, str) for cell in nb.cells)
