"""Does an image file say that its picture should be turned?

Cameras note how they were held (EXIF, orientation 1 to 8): in a block of its own in JPEG and PNG, among the other tags
in TIFF, the format of that block. Nothing else is read of it, and whatever is not as it should be says nothing.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Protocol, overload

__all__ = ["Data", "Turn", "noted_turn", "unturned"]

UPRIGHT = 1
_ORIENTATION, _SHORT = 0x0112, 3
_MOST_ENTRIES = 4096
_JPEG, _PNG = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n"
_ORDERS = {b"II*\0": "<", b"MM\0*": ">"}
_EXIF, _APP1, _LONE, _SCAN = b"Exif\0\0", 0xE1, (0x01, *range(0xD0, 0xD9)), (0xD9, 0xDA)


class Data(Protocol):
    """Bytes in memory, or those of a file that is looked into without reading it as a whole."""

    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, index: int, /) -> int: ...
    @overload
    def __getitem__(self, index: slice, /) -> bytes: ...


@dataclass(frozen=True)
class Turn:
    """How a picture should be turned.

    Attributes:
        orientation: EXIF's number, 1 (not at all) to 8.
        at: Where its two bytes stand in the file.
        order: ``<`` or ``>``, the order of the bytes as :mod:`struct` names it.
    """

    orientation: int
    at: int
    order: str


def noted_turn(data: Data) -> Turn | None:
    """The turn that a JPEG, PNG or TIFF file notes; None where it notes none."""
    try:
        start = _tags_begin(data)
        return None if start is None else _turn(data, start)
    except (struct.error, IndexError):
        return None  # the file ends before it has said it


def unturned(data: bytes) -> bytes:
    """The same TIFF file with the note taken back: OpenCV's reader would follow it."""
    turn = noted_turn(data)
    if turn is None or turn.orientation == UPRIGHT:
        return data
    return data[: turn.at] + struct.pack(f"{turn.order}H", UPRIGHT) + data[turn.at + 2 :]


def _tags_begin(data: Data) -> int | None:
    """Where the block with the tags begins; None where there is none."""
    if data[:4] in _ORDERS:
        return 0
    if data[:8] == _PNG:
        return _in_png(data)
    return _in_jpeg(data) if data[:3] == _JPEG else None


def _in_jpeg(data: Data) -> int | None:
    at = 2
    while data[at] == 0xFF and data[at + 1] not in _SCAN:
        kind = data[at + 1]
        if kind == 0xFF or kind in _LONE:
            at += 1 if kind == 0xFF else 2
            continue
        if kind == _APP1 and data[at + 4 : at + 10] == _EXIF:
            return at + 10
        at += 2 + max(_number(data, at + 2, ">H"), 2)
    return None


def _in_png(data: Data) -> int | None:
    at = len(_PNG)
    while data[at + 4 : at + 8] != b"IEND":
        if data[at + 4 : at + 8] == b"eXIf":
            return at + 8
        at += 12 + _number(data, at, ">I")
    return None


def _turn(data: Data, start: int) -> Turn | None:
    order = _ORDERS.get(data[start : start + 4])
    if order is None:
        return None
    first = start + _number(data, start + 4, f"{order}I")
    for entry in range(min(_number(data, first, f"{order}H"), _MOST_ENTRIES)):
        at = first + 2 + 12 * entry
        if _number(data, at, f"{order}H") == _ORIENTATION:
            orientation = _number(data, at + 8, f"{order}H")
            sound = _number(data, at + 2, f"{order}H") == _SHORT and UPRIGHT <= orientation <= 8
            return Turn(orientation, at + 8, order) if sound else None
    return None


def _number(data: Data, at: int, form: str) -> int:
    (value,) = struct.unpack(form, data[at : at + struct.calcsize(form)])
    return int(value)
