"""Plain data: the only thing that crosses between a task, a learner's function and a judge.

Plain is: None, bool, int, float, str, bytes, NumPy arrays of booleans, whole numbers or floats (also records of
these, the point types of lab 02), and lists and dicts of plain things. `plain` normalises what a function returned (a
tuple becomes a list, a NumPy scalar a number) or says in one sentence why it cannot be judged. `to_wire` and
`from_wire` carry plain data to another process and back as bytes: a JSON header and raw buffers, never pickle.
"""

from __future__ import annotations

import json
import math
import struct
from typing import Any, TypeAlias

import numpy as np

Plain: TypeAlias = Any
"""None | bool | int | float | str | bytes | ndarray | list[Plain] | dict[str | int, Plain]."""

MAX_BYTES = 64_000_000
MAX_ITEMS = 100_000
MAX_DEPTH = 6
MAX_TEXT = 20_000
MAX_FIELDS = 64
_KINDS = {"b": "True/False", "i": "whole numbers", "u": "whole numbers", "f": "floats"}
_MAGIC = b"course-plain-1\n"


def plain(value: Any, what: str = "the answer") -> Plain:
    """Copy a value into plain data, or refuse it.

    Parameters
    ----------
    value : anything.
    what : how the sentence of a refusal calls it.

    Returns
    -------
    Plain data that shares no memory with `value`: tuples as lists, NumPy scalars and 0-d arrays as numbers, arrays in
    native byte order and C order.

    Raises
    ------
    ValueError
        With one sentence, if the value is of another type, or too big.
    """
    return _Copier(what).copy(value, 0)


class _Copier:
    """Copies one value, counting what it holds."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.bytes = 0
        self.items = 0

    def copy(self, value: Any, depth: int) -> Plain:
        if value is None or isinstance(value, (bool, np.bool_)):
            return None if value is None else bool(value)
        if isinstance(value, (int, np.integer)):
            self._weigh(8)
            return self._whole(int(value))
        if isinstance(value, (float, np.floating)):
            self._weigh(8)
            return float(value)
        if isinstance(value, str):
            if len(value) > MAX_TEXT:
                raise ValueError(f"{self.what} holds a text of {len(value):,} letters: {MAX_TEXT:,} is the most.")
            self._weigh(len(value))
            return str(value)
        if isinstance(value, bytes):
            self._weigh(len(value))
            return bytes(value)
        if isinstance(value, np.ndarray):
            return self._array(value, depth)
        if isinstance(value, (list, tuple)):
            self._enter(len(value), depth)
            return [self.copy(item, depth + 1) for item in value]
        if isinstance(value, dict):
            self._enter(len(value), depth)
            return {self._key(key): self.copy(item, depth + 1) for key, item in value.items()}
        raise ValueError(self._refusal(value))

    def _array(self, value: np.ndarray, depth: int) -> Plain:
        if isinstance(value, np.ma.MaskedArray):
            raise ValueError(f"{self.what} is a masked array: fill it (np.nan where nothing is) to make a plain one.")
        if value.dtype.kind == "U" or (value.ndim == 0 and value.dtype.kind in _KINDS):
            self._weigh(value.nbytes)
            return self.copy(value.tolist(), depth)
        _check_dtype(value.dtype, self.what)
        self._weigh(value.nbytes)
        if value.size == 0 and max(value.shape) > MAX_BYTES:
            raise ValueError(f"{self.what} is an empty array of shape {value.shape}, far larger than this task.")
        return np.array(value, dtype=value.dtype.newbyteorder("="), order="C", copy=True, subok=False)

    def _key(self, key: Any) -> str | int:
        if isinstance(key, str) and len(key) <= 200:
            return str(key)
        if isinstance(key, (int, np.integer)) and not isinstance(key, bool):
            return self._whole(int(key))
        raise ValueError(f"{self.what} is a dict with {_a(key)} as a key: use short strings or whole numbers.")

    def _whole(self, number: int) -> int:
        if abs(number) >= 2**63:
            raise ValueError(f"{self.what} holds a whole number that needs more than 64 bits.")
        return number

    def _enter(self, length: int, depth: int) -> None:
        self.items += length
        if depth >= MAX_DEPTH:
            raise ValueError(f"{self.what} is nested more than {MAX_DEPTH} deep: return it flatter.")
        if self.items > MAX_ITEMS:
            raise ValueError(
                f"{self.what} holds more than {MAX_ITEMS:,} separate things: return a NumPy array instead."
            )

    def _weigh(self, size: int) -> None:
        self.bytes += size
        if self.bytes > MAX_BYTES:
            raise ValueError(
                f"{self.what} needs more than {MAX_BYTES // 1_000_000} MB of memory: far more than this task."
            )

    def _refusal(self, value: Any) -> str:
        if hasattr(value, "__next__") or hasattr(value, "send"):
            return f"{self.what} is a generator, which holds no values yet: return a list or an array."
        if callable(value):
            return f"{self.what} is a function or a class, not a value: perhaps the brackets of a call are missing."
        if isinstance(value, (complex, np.complexfloating)):
            return f"{self.what} is a complex number: expected real ones."
        if isinstance(value, (set, frozenset)):
            return f"{self.what} is a set, which has no order: return a sorted list."
        if hasattr(type(value), "__array__") or hasattr(type(value), "__len__"):
            return f"{self.what} is {_a(value)}: np.asarray(…) makes it a NumPy array."
        return f"{self.what} is {_a(value)}: return plain data (numbers, text, NumPy arrays, lists or dicts of these)."


def _check_dtype(dtype: np.dtype, what: str, fields: int = 0) -> int:
    """Refuse arrays of anything but booleans, whole numbers, floats, and records of these; their fields, counted on."""
    if dtype.names is not None:
        for name in dtype.names[: MAX_FIELDS + 1]:
            fields = _check_dtype(dtype[name].base, what, fields + 1)
        if fields > MAX_FIELDS:
            raise ValueError(f"{what} is an array of records of more than {MAX_FIELDS} fields: that is too many.")
        return fields
    if dtype.kind not in _KINDS or dtype.itemsize > 8:
        hint = "are its rows of different lengths?" if dtype.kind == "O" else "use bool, int or float."
        raise ValueError(f"{what} is an array of dtype {dtype}, which cannot be judged: {hint}")
    return fields


def _a(value: Any) -> str:
    return f"an object of type {type(value).__name__[:60]}"


def describe(value: Plain) -> str:
    """Say what a plain value is, short enough for a sentence: 'a (480, 640) float32 array', '1500', 'None'."""
    if isinstance(value, np.ndarray):
        dtype = "record" if value.dtype.names is not None else str(value.dtype)
        return f"a {value.shape} {dtype} array"
    if isinstance(value, bool) or value is None:
        return str(value)
    if isinstance(value, (int, float)):
        return f"{value:.6g}" if isinstance(value, float) else str(value)
    if isinstance(value, str):
        return f"the text {value!r}" if len(value) <= 40 else f"a text of {len(value)} letters"
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    if isinstance(value, dict):
        return f"a dict with {_count(len(value), 'entry', 'entries')}"
    if isinstance(value, (list, tuple)):
        return f"{_count(len(value), 'thing', 'things')} in a tuple or list"  # a tuple crosses as a list
    return _a(value)


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def same(a: Plain, b: Plain, relative: float = 1e-6) -> bool:
    """Whether two plain values are equal up to rounding; NaN equals NaN."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape != b.shape or (a.dtype.names or b.dtype.names) and a.dtype != b.dtype:
            return False
        if a.dtype.names is not None:
            return all(same(a[name], b[name], relative) for name in a.dtype.names)
        finite = np.abs(b[np.isfinite(b)]) if b.dtype.kind == "f" else np.abs(b.astype(float))
        scale = float(finite.max()) if finite.size else 0.0
        return bool(
            np.allclose(a.astype(float), b.astype(float), rtol=relative, atol=relative * scale * 1e-3, equal_nan=True)
        )
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(same(x, y, relative) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key], relative) for key in a)
    if isinstance(a, (int, float)) and isinstance(b, (int, float)) and not isinstance(a, bool) | isinstance(b, bool):
        return (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=relative, abs_tol=1e-15)
    return type(a) is type(b) and not isinstance(a, (np.ndarray, list, dict)) and a == b


def to_wire(value: Plain) -> bytes:
    """Bytes of a plain value, for another process. Raises ValueError for what is not plain."""
    buffers: list[bytes] = []
    tree = json.dumps(_pack(plain(value, "the value"), buffers), ensure_ascii=True).encode()
    sizes = [len(buffer) for buffer in buffers]
    head = json.dumps(sizes).encode()
    return b"".join([_MAGIC, struct.pack("<II", len(head), len(tree)), head, tree, *buffers])


def _pack(value: Plain, buffers: list[bytes]) -> Any:
    if isinstance(value, np.ndarray):
        buffers.append(value.tobytes())
        return {"array": len(buffers) - 1, "dtype": _dtype_to_json(value.dtype), "shape": list(value.shape)}
    if isinstance(value, bytes):
        buffers.append(value)
        return {"bytes": len(buffers) - 1}
    if isinstance(value, list):
        return {"list": [_pack(item, buffers) for item in value]}
    if isinstance(value, dict):
        return {"dict": [[key, _pack(item, buffers)] for key, item in value.items()]}
    return value


def from_wire(data: bytes) -> Plain:
    """The plain value of bytes made by `to_wire`; safe on bytes made by anybody.

    Raises
    ------
    ValueError
        With one sentence, if the bytes are not such a message or hold more than plain data may.
    """
    damaged = ValueError(
        "these bytes are not a plain value of this course: they were cut off or made by something else."
    )
    start = len(_MAGIC) + 8
    if len(data) > 2 * MAX_BYTES or data[: len(_MAGIC)] != _MAGIC or len(data) < start:
        raise damaged
    head_size, tree_size = struct.unpack("<II", data[len(_MAGIC) : start])
    try:
        head, text = data[start : start + head_size], data[start + head_size : start + head_size + tree_size]
        if sum(part.count(mark) for part in (head, text) for mark in (b"[", b"{", b",")) > 10 * MAX_ITEMS:
            raise damaged
        sizes, tree = json.loads(head), json.loads(text)
        offsets = [start + head_size + tree_size]
        for size in sizes:
            if type(size) is not int or size < 0:
                raise damaged
            offsets.append(offsets[-1] + size)
        if offsets[-1] != len(data):
            raise damaged
        buffers = [data[begin:end] for begin, end in zip(offsets[:-1], offsets[1:], strict=True)]
        return plain(_unpack(tree, buffers), "the value")
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise damaged from error
    except ValueError:
        raise
    except Exception as error:  # whatever json and NumPy make of bytes that anybody made: OverflowError, SyntaxError …
        raise damaged from error


def _unpack(tree: Any, buffers: list[bytes]) -> Plain:
    if not isinstance(tree, dict):
        if isinstance(tree, list):
            raise TypeError("a bare list")
        return tree
    if "array" in tree:
        dtype = _dtype_from_json(tree["dtype"])
        return np.frombuffer(buffers[tree["array"]], dtype=dtype).reshape([int(n) for n in tree["shape"]])
    if "bytes" in tree:
        return buffers[tree["bytes"]]
    if "list" in tree:
        return [_unpack(item, buffers) for item in tree["list"]]
    return {key: _unpack(item, buffers) for key, item in tree["dict"]}


def _dtype_to_json(dtype: np.dtype) -> Any:
    if dtype.subdtype is not None:
        return {"of": _dtype_to_json(dtype.base), "shape": list(dtype.shape)}
    if dtype.names is None:
        return dtype.str
    formats = [_dtype_to_json(dtype[name]) for name in dtype.names]
    offsets = [dtype.fields[name][1] for name in dtype.names]  # type: ignore[index]
    return {"names": list(dtype.names), "formats": formats, "offsets": offsets, "itemsize": dtype.itemsize}


def _dtype_from_json(tree: Any) -> np.dtype:
    if len(json.dumps(tree)) > (10 if isinstance(tree, str) else 300) * MAX_FIELDS:
        raise ValueError(f"the value is an array of records of more than {MAX_FIELDS} fields.")
    if isinstance(tree, str):
        dtype = np.dtype(tree)
    elif "of" in tree:
        dtype = np.dtype((_dtype_from_json(tree["of"]), tuple(int(n) for n in tree["shape"])))
    else:
        dtype = np.dtype({**tree, "formats": [_dtype_from_json(item) for item in tree["formats"]]})
    _check_dtype(dtype.base, "the value")
    return dtype
