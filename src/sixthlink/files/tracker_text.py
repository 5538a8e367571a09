"""Which lines does a table of an instrument have?

Bytes become lines: UTF-8 or UTF-16 as the file says itself, another encoding only when it is named. Blank lines and
comments are left out; every line keeps its number.
"""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np

from sixthlink.errors import Finding
from sixthlink.files.csv_table import MOST_BYTES
from sixthlink.geometry import Ints

__all__ = ["guarded_name", "kept_lines", "shown_name", "table_text"]

COMMENTS = ("#", "//", "%")
"""What a comment begins with: SpatialAnalyzer writes ``//``, NumPy and many loggers ``#``, Matlab ``%``."""

_BLANK = " \t,;"
_FORMULA = tuple("=+-@\t")


def table_text(path: Path, encoding: str | None, findings: list[Finding]) -> str | None:
    """Text of a table, or None when it cannot be read; findings are appended.

    Args:
        path: The file.
        encoding: Its encoding, or None for UTF-8, or UTF-16 with a byte order mark.
        findings: Grows.
    """
    where = str(path)
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            what = f"has {size} bytes"
            findings.append(Finding(where, "file", what, f"at most {MOST_BYTES}", "check that it is the right file"))
            return None
        data = path.read_bytes()
    except OSError as error:
        cure = "check the rights of the file and its folder"
        findings.append(Finding(where, "file", f"cannot be read ({error.strerror})", "", cure))
        return None
    by_itself = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    name = encoding or ("utf-16" if by_itself else "utf-8")
    try:
        text = data.decode("utf-8-sig" if name == "utf-8" else name)
    except UnicodeDecodeError as error:
        what = f"byte {error.start + 1} is not {name.upper()}"
        cure = "save it as UTF-8, or name its encoding, for example encoding: cp1252"
        findings.append(Finding(where, "file", what, f"{name.upper()} text", cure))
        return None
    if "\0" in text:
        cure = "save it as UTF-8, or write encoding: utf-16"
        findings.append(Finding(where, "file", "has zero bytes", "text", cure))
        return None
    return text.removeprefix("\ufeff")


def kept_lines(text: str, first: int) -> tuple[list[str], Ints, list[int]]:
    """Lines that are neither blank nor comments, the number of each in the file, and the numbers of the comments.

    Rows of separators alone, which spreadsheets leave at the end, are blank.

    Args:
        text: The text, with any line ends.
        first: Number of the first line to look at; what stands above it is not part of the table.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    filled = [k for k in range(first - 1, len(lines)) if lines[k].strip(_BLANK)]
    comments = [k for k in filled if lines[k].lstrip().startswith(COMMENTS)]
    if comments:
        filled = sorted(set(filled) - set(comments))
    return [lines[k] for k in filled], np.array(filled, dtype=np.int64) + 1, [k + 1 for k in comments]


def guarded_name(name: str) -> str:
    """A name as a cell that no spreadsheet takes for a formula: with an apostrophe before what begins one."""
    return f"'{name}" if name.lstrip("'")[:1] in _FORMULA else name


def shown_name(cell: str) -> str:
    """The name that a cell holds, without the apostrophe that guards it."""
    name = cell.strip()
    return name[1:] if name[:1] == "'" and name.lstrip("'")[:1] in _FORMULA else name
