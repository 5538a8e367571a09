"""Which numbers do the texts of a table mean?

A decimal comma and a thousands separator look alike: ``1,234`` is one or the other. What the other numbers of the
table do not settle is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from sixthlink.geometry import Floats, Ints

__all__ = ["as_numbers", "decimal_mark", "looks_like_number", "number_words", "undecided"]

_POINT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_COMMA = re.compile(r"[-+]?[0-9]*,[0-9]+([eE][-+]?[0-9]+)?")

_DECIDES = re.compile(r"(?m)^[ \t]*[-+]?(?:0\d*|\d{4,}|)[.,]|[.,]\d{0,2}[ \t]*$|[.,]\d{4}|[.,]\d+[eE]")
"""In texts one a line: a number whose mark cannot be a thousands separator, as it is not three digits from the end,
or four or more digits or a zero stand before it."""

_ALLOWED = b"0123456789+-.eE \t\n"


def looks_like_number(text: str) -> bool:
    """Whether a text is a finite decimal number, with a point or a comma."""
    text = text.strip()
    return _POINT.fullmatch(text) is not None or _COMMA.fullmatch(text) is not None


def number_words(mark: str) -> tuple[str, str]:
    """What is expected of a number, and the cure where there is none."""
    return f"a finite number with a decimal {'point' if mark == '.' else 'comma'}", "correct it, or take the row out"


def decimal_mark(columns: Sequence[Sequence[str]]) -> str:
    """Mark that the numbers of a table have, a point when they have none; the first mark where they have both."""
    joined = "\n".join("\n".join(column) for column in columns)
    comma, point = joined.find(","), joined.find(".")
    if comma < 0:
        return "."
    if point < 0:
        return ","
    for column in zip(*columns, strict=True):
        for text in column:
            if ("," in text) != ("." in text) and looks_like_number(text):
                return "," if "," in text else "."
    return "."


def undecided(columns: Sequence[Sequence[str]], mark: str) -> tuple[int, int] | None:
    """Column and row of the first number whose mark may as well be a thousands separator, if no number tells.

    Args:
        columns: The texts of the numbers, column by column.
        mark: The mark.
    """
    joined = "\n".join("\n".join(column) for column in columns)
    if mark not in joined or _DECIDES.search(joined):
        return None
    for k, column in enumerate(columns):
        for i, text in enumerate(column):
            if mark in text:
                return k, i
    return None


def as_numbers(texts: Sequence[str], mark: str) -> tuple[Floats, Ints]:
    """``(N,)`` numbers, 0 where a text is none, and the rows of those texts.

    Args:
        texts: The texts.
        mark: Decimal point or decimal comma.
    """
    joined = "\n".join(texts)
    if mark == ",":
        joined = joined.replace(".", "\x01").replace(",", ".")
    if joined.isascii() and not joined.encode().translate(None, _ALLOWED):
        try:
            values = np.fromiter(map(float, joined.split("\n")), np.float64, len(texts))
        except ValueError:
            pass
        else:
            if np.isfinite(values).all():
                return values, np.empty(0, dtype=np.int64)
    values = np.zeros(len(texts))
    pattern, wrong = (_COMMA if mark == "," else _POINT), []
    for i, text in enumerate(texts):
        cell = text.strip()
        good = pattern.fullmatch(cell) or (mark == "," and "." not in cell and _POINT.fullmatch(cell))
        value = float(cell.replace(",", ".")) if good else np.inf
        if np.isfinite(value):
            values[i] = value
        else:
            wrong.append(i)
    return values, np.array(wrong, dtype=np.int64)
