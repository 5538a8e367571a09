"""How does a line fall into cells?"""

from __future__ import annotations

import csv

__all__ = ["padded", "separator_word", "split_rows", "trimmed"]


def split_rows(lines: list[str], separator: str) -> list[list[str]]:
    """Cells of each line; a quoted cell may hold the separator, but no line end."""
    if not any('"' in line for line in lines):
        if separator == " ":  # not str.split(): a hard blank may stand within a number, between its thousands
            return [[cell for cell in line.replace("\t", " ").split(" ") if cell] for line in lines]
        return [line.split(separator) for line in lines]
    rows = []
    for line in lines:
        (row,) = csv.reader([line.strip() if separator == " " else line], delimiter=separator, strict=True)
        rows.append([cell for cell in row if cell] if separator == " " else row)
    return rows


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
