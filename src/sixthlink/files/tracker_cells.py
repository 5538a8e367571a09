"""How does a line fall into cells?"""

from __future__ import annotations

import csv

__all__ = ["open_line", "padded", "separator_word", "split_rows", "trimmed"]


def split_rows(lines: list[str], separator: str) -> list[list[str]]:
    """Cells of each line; a quoted cell may hold the separator, but no line end."""
    if not any('"' in line for line in lines):
        if separator == " ":  # not str.split(): a hard blank may stand within a number, between its thousands
            return [[cell for cell in line.replace("\t", " ").split(" ") if cell] for line in lines]
        return [line.split(separator) for line in lines]
    blank = separator == " "
    rows = list(csv.reader((line.strip() for line in lines) if blank else lines, delimiter=separator, strict=True))
    if len(rows) != len(lines):
        raise csv.Error("a quote is not closed in its line")
    return [[cell for cell in row if cell] for row in rows] if blank else rows


def open_line(lines: list[str], separator: str) -> int:
    """Index of the first line that is no row by itself."""
    for i, line in enumerate(lines):
        try:
            split_rows([line], separator)
        except csv.Error:
            return i
    return 0


def trimmed(row: list[str]) -> list[str]:
    """The row without empty cells at its end: many exports end each line with a separator."""
    count = len(row)
    while count > 1 and not row[count - 1].strip():
        count -= 1
    return row[:count]


def padded(row: list[str], width: int) -> list[str]:
    """The row without empty cells beyond the width."""
    return row[:width] if len(row) > width and not any(cell.strip() for cell in row[width:]) else row


def separator_word(separator: str) -> str:
    """A separator in words."""
    return {",": "commas", ";": "semicolons", "\t": "tabs", " ": "blanks"}[separator]
