"""Numbers as people read them, rounded to what repeats on any machine. Used by every text that a cell prints."""

from __future__ import annotations

import math
from numbers import Integral, Real

import numpy as np

SMALLEST = 1e-9
"""Below this a floating-point result is the rounding error of one machine; it is printed as "below ..."."""


def number(value: object, digits: int = 3, smallest: float | None = None) -> str:
    """Write one number.

    Parameters
    ----------
    value : an int (written in full, with thousands separators), a float, a bool or a string.
    digits : significant digits of a float. Trailing zeros are kept: they say how far the number is known.
    smallest : floats closer to zero than this are written "below ...": also 0, which another machine misses by a
        rounding. None: SMALLEST, and 0 is "0".

    Returns
    -------
    str
        Such as "35,947", "0.0120", "yes"; NaN is "not measured".
    """
    value = value.item() if isinstance(value, (np.generic, np.ndarray)) and np.size(value) == 1 else value
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Integral):
        return f"{int(value):,}"
    if not isinstance(value, Real):
        raise ValueError(
            f"A number was expected, and this is a {type(value).__name__}: pass an int, a float or a text."
        )
    value = float(value)
    if math.isnan(value):
        return "not measured"
    if math.isinf(value):
        return "infinite" if value > 0 else "minus infinite"
    if value == 0 and not smallest:
        return "0"
    limit = SMALLEST if smallest is None else smallest
    if abs(value) < limit:
        return f"below {_plain(limit, 1)}"
    return _plain(value, digits)


def _plain(value: float, digits: int) -> str:
    """Round to significant digits, without an exponent for sizes that people meet."""
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    if power < -6 or power > 12:
        return f"{mantissa} × 10^{power}"
    return f"{float(f'{mantissa}e{power}'):,.{max(0, digits - 1 - power)}f}"


def amount(value: float, unit: str = "", digits: int = 3, smallest: float | None = None) -> str:
    """Write a number with its unit: "3.10 mm", "98 %"."""
    text = number(value, digits, smallest)
    return f"{text} {unit}" if unit and text != "not measured" else text


def count(n: int, thing: str, about: bool = False) -> str:
    """Write "35,947 points" or, where the count may differ between machines, "about 36,000 points"."""
    plural = {"mesh": "meshes", "vertex": "vertices"}.get(thing, f"{thing}s")
    if about and n >= 100:
        return f"about {number(float(n), 2)} {plural}"
    return f"{n:,} {thing if n == 1 else plural}"


def sentence_list(parts: list[str]) -> str:
    """Join as in a sentence: "a, b and c"."""
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1] if parts else ""


def sentence(text: str) -> str:
    """End a text with a full stop."""
    text = text.strip()
    return text if text.endswith((".", "!", "?")) else f"{text}."
