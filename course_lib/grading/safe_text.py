"""Words that learners wrote, made safe to show: cleaned, quoted against spreadsheets, and turned into file names."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from typing import Any

MOST = 600
TURNS = "\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"
"""Marks that turn the direction of what follows."""
_RUNS = re.compile(r"^[\s\u00a0\u200b\ufeff]*[=+\-@\uff1d\uff0b\uff0d\uff20\t\r\n|%]")
_HIDDEN = re.compile(r"(;[\s\u00a0\u200b\ufeff\"']*)(?=[=+\-@\uff1d\uff0b\uff0d\uff20|%])")
"""A formula behind a semicolon, which is where a spreadsheet of many countries begins a new cell."""
_NUMBER = re.compile(r"^-?\d+(\.\d+)?$")


def clean(text: Any, most: int = MOST) -> str:
    """Text that shows what it says: no control characters, nothing that turns the direction of what follows, not long.

    Right-to-left letters stay; lone surrogates, which no file can hold, become a visible mark.
    """
    kept = []
    for letter in str(text):
        kind = unicodedata.category(letter)
        if letter in "\n\t" or kind in ("Zl", "Zp"):
            kept.append(" ")
        elif kind == "Cs":
            kept.append(f"\\x{ord(letter) & 0xFF:02x}")
        elif kind in ("Cc", "Co") or letter in TURNS:
            kept.append("\N{REPLACEMENT CHARACTER}" if kind == "Co" else "")
        else:
            kept.append(letter)
    said = "".join(kept)
    return said if len(said) <= most else said[: most - 1] + "…"


def shown(text: str) -> str:
    """A path or an id that can be typed as it is shown: what cannot be seen is written as \\xNN, \\uNNNN or longer.

    Letters are composed (é is one letter, as a keyboard makes it); bytes that are no UTF-8 are \\xNN, too.
    """
    text = text.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    return "".join(map(_visible, unicodedata.normalize("NFC", text)))


def _visible(letter: str) -> str:
    if letter == " " or unicodedata.category(letter)[0] not in "CZ":
        return letter
    return letter.encode("unicode_escape").decode()


def safe_cell(value: Any) -> str:
    """A cell of a CSV file that no spreadsheet runs: numbers as they are, words that look like a formula quoted."""
    if value is None:
        return ""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:g}"
    text = _HIDDEN.sub(r"\1'", clean(value, 5000))
    return f"'{text}" if _RUNS.match(text) and not _NUMBER.match(text) else text


def page_name(student: str, lab: str) -> str:
    """A file name that a student cannot choose: letters of the id, and a hash that keeps two apart."""
    plain = unicodedata.normalize("NFKD", student).encode("ascii", "ignore").decode()
    slug = "-".join(re.findall(r"[A-Za-z0-9]+", plain))[:40].lower() or "student"
    digest = hashlib.sha256(student.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    return f"{slug}-{digest}-lab{lab}.html"
