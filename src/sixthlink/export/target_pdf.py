"""How does a target get on to paper at its true size?

A PDF of one page, written here because the format is small: filled rectangles, discs of four Bézier curves, thin lines
and Helvetica. Its coordinates are millimetres from the page's upper left corner, x to the right and y down. Beside the
target stand a line of known length, to be measured on the print, the target's name, and its frame. Nothing in the file
depends on when or where it was written.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from sixthlink.geometry import Floats
from sixthlink.target import Drawing
from sixthlink.units import MM

__all__ = ["PAPERS_MM", "Page", "page_for", "target_pdf"]

POINT_MM = 25.4 / 72.0
"""Length of one PDF point [mm]."""

PAPERS_MM = {
    "A5": (148.0, 210.0),
    "A4": (210.0, 297.0),
    "A3": (297.0, 420.0),
    "A2": (420.0, 594.0),
    "A1": (594.0, 841.0),
    "A0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
}
"""Short and long side of each paper [mm]; one that is not asked for is one of the A series."""

EDGE_MM = 5.0
"""Printers leave this much at the edges of the paper."""

LEGEND_MM, FRAME_MM = 15.0, 7.0
"""Room below the target for its name and the check length; room at its left and above it for its frame."""

CHECKS_MM = (100.0, 50.0, 20.0, 10.0)
"""Check lengths, of which the longest that fits is printed."""

TEXT_MM, LINE_MM, ARROW_MM = 2.8, 0.1, 15.0
"""Size of the letters, width of the lines, length of the arrows."""

LETTER_WIDTH, WIDE_LETTER = 0.5, 0.58
"""Mean width of a letter of Helvetica in its size; the same on the safe side."""

HANDLE = 4.0 * (np.sqrt(2.0) - 1.0) / 3.0
"""Length of a Bézier curve's handles in radii: with it the curve is a quarter of a circle within 0.03 %."""


@dataclass(frozen=True)
class Page:
    """Where a target stands on which paper.

    Attributes:
        paper: Name of the paper.
        width_mm: Width of the page, upright or across as the target needs it [mm].
        height_mm: Height of the page [mm].
        left_mm: Distance of the target's white sheet from the page's left edge [mm].
        top_mm: Its distance from the upper edge [mm].
        check_mm: Length of the line that is to be measured on the print [mm].
    """

    paper: str
    width_mm: float
    height_mm: float
    left_mm: float
    top_mm: float
    check_mm: float


def page_for(drawing: Drawing, paper: str | None) -> Page:
    """The page on which a target stands in the middle, with room for what is printed beside it.

    Args:
        drawing: What is printed.
        paper: Name of the paper; None for the smallest of the A series that holds it.

    Raises:
        ValueError: The paper is unknown or too small.
    """
    x0, y0, x1, y1 = (drawing.paper / MM).tolist()
    width, height = x1 - x0, y1 - y0
    needed = (width + FRAME_MM + 2.0 * EDGE_MM, height + FRAME_MM + LEGEND_MM + 2.0 * EDGE_MM)
    if paper is not None and paper not in PAPERS_MM:
        raise ValueError(f"paper {paper!r} is unknown, expected one of {', '.join(PAPERS_MM)}")
    for name in [paper] if paper else [k for k in PAPERS_MM if k.startswith("A")]:
        short, long = PAPERS_MM[name]
        for across, down in ((short, long), (long, short)):
            if across >= needed[0] and down >= needed[1]:
                left = float(np.clip(0.5 * (across - width), EDGE_MM + FRAME_MM, across - EDGE_MM - width))
                lowest = down - EDGE_MM - LEGEND_MM - height
                top = float(np.clip(0.5 * (down - height), EDGE_MM + FRAME_MM, lowest))
                check = next(length for length in CHECKS_MM if length <= across - 2.0 * EDGE_MM)
                return Page(name, across, down, left, top, check)
    raise ValueError(
        f"target of {width:.6g} x {height:.6g} mm with its white margin needs {needed[0]:.6g} x {needed[1]:.6g} mm, "
        f"more than paper {paper or 'A0'} has; choose a larger paper or a smaller target"
    )


def target_pdf(drawing: Drawing, *, title: str, paper: str | None) -> bytes:
    """A PDF with one page that shows a target at true scale.

    Args:
        drawing: What is printed.
        title: Name and numbers of the target, for people.
        paper: Name of the paper; None for the smallest of the A series that holds it.

    Raises:
        ValueError: The paper is unknown or too small.
    """
    page = page_for(drawing, paper)
    low = drawing.paper[:2] / MM
    origin = np.array([page.left_mm, page.top_mm]) - low
    bottom = page.top_mm + float(drawing.paper[3] / MM - low[1])
    scale = 1.0 / POINT_MM
    ink = [
        f"{_numbers(scale, 0.0, 0.0, -scale, 0.0, page.height_mm * scale)} cm",
        *_shapes(drawing, origin),
        *_frame(origin, page),
        *_legend(title, bottom, page),
    ]
    return _file("\n".join(ink), title, page)


def _numbers(*values: float) -> str:
    """Numbers as PDF writes them, to a hundred-thousandth of their unit."""
    return " ".join(f"{round(value, 5) + 0.0:.5f}".rstrip("0").rstrip(".") for value in values)


def _shapes(drawing: Drawing, origin: Floats) -> list[str]:
    """The rectangles in their order, then the discs."""
    ink = []
    black = np.asarray(drawing.black).tolist()
    rectangles = drawing.rectangles / MM + np.tile(origin, 2)
    # Shapes of one colour are one path: no light shines through the seams between them.
    for dark, run in groupby(zip(black, rectangles.tolist(), strict=True), key=lambda shape: shape[0]):
        ink.append("0 g" if dark else "1 g")
        ink += [f"{_numbers(x0, y0, x1 - x0, y1 - y0)} re" for _, (x0, y0, x1, y1) in run]
        ink.append("f")
    ink.append("0 g")
    for x, y, radius in (drawing.discs / MM + np.r_[origin, 0.0]).tolist():
        ink += _disc(x, y, radius)
    return ink


def _disc(x: float, y: float, radius: float) -> list[str]:
    """A filled disc."""
    ring = radius * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
    path = [f"{_numbers(x + radius, y)} m"]
    for start, end in pairwise(ring):
        # Each quarter sets out towards where the next one ends, and arrives along the way it came.
        points = np.array([x, y]) + np.stack([start + HANDLE * end, end + HANDLE * start, end])
        path.append(f"{_numbers(*points.ravel().tolist())} c")
    return [*path, "f"]


def _line(*points: tuple[float, float]) -> str:
    """A thin line through points."""
    first, *others = points
    return " ".join([f"{_numbers(*first)} m", *(f"{_numbers(*p)} l" for p in others), "S"])


def _text(x: float, y: float, words: str, size: float = TEXT_MM) -> str:
    """Words whose first letter stands at x on the line y."""
    escaped = words.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")
    return f"BT /F1 {_numbers(size)} Tf 1 0 0 -1 {_numbers(x, y)} Tm ({escaped}) Tj ET"


def _frame(origin: Floats, page: Page) -> list[str]:
    """Arrows along x and y, and beside the sheet a tick each where they begin: at the origin's column and row."""
    x, y = origin.tolist()
    above, beside, tip = page.top_mm - 3.0, page.left_mm - 3.0, 0.8
    return [
        f"{_numbers(LINE_MM)} w",
        _line((x, above - 1.5), (x, page.top_mm - 0.5)),
        _line((x, above), (x + ARROW_MM, above)),
        _line((x + ARROW_MM - 2.0, above - tip), (x + ARROW_MM, above), (x + ARROW_MM - 2.0, above + tip)),
        _text(x + ARROW_MM + 1.0, above + 0.9, "x"),
        _line((beside - 1.5, y), (page.left_mm - 0.5, y)),
        _line((beside, y), (beside, y + ARROW_MM)),
        _line((beside - tip, y + ARROW_MM - 2.0), (beside, y + ARROW_MM), (beside + tip, y + ARROW_MM - 2.0)),
        _text(beside - 0.7, y + ARROW_MM + 2.8, "y"),
        _text(x - 2.5, above + 0.9, "0"),
        _text(beside - 0.8, y - 1.0, "0"),
    ]


def _legend(title: str, bottom: float, page: Page) -> list[str]:
    """The target's name, a line of known length with a tick at each end, and what to do with it."""
    room = page.width_mm - 2.0 * EDGE_MM
    size = min(TEXT_MM, room / (WIDE_LETTER * max(len(title), 1)))
    left, right, y = 0.5 * (page.width_mm - page.check_mm), 0.5 * (page.width_mm + page.check_mm), bottom + 8.0
    advice = f"check: {page.check_mm:g} mm, print at 100 %, no scaling"
    return [
        _text(max(EDGE_MM, 0.5 * (page.width_mm - LETTER_WIDTH * size * len(title))), bottom + 4.0, title, size),
        _line((left, y), (right, y)),
        _line((left, y - 1.5), (left, y + 1.5)),
        _line((right, y - 1.5), (right, y + 1.5)),
        _text(0.5 * (page.width_mm - LETTER_WIDTH * TEXT_MM * len(advice)), y + 4.0, advice),
    ]


def _file(content: str, title: str, page: Page) -> bytes:
    """The file around a page's content: its objects, where each begins, and which is the first to read."""
    stream = content.encode("cp1252", errors="replace")
    size = _numbers(page.width_mm / POINT_MM, page.height_mm / POINT_MM)
    name = title.encode("utf-16-be").hex().upper()
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
        b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents 4 0 R "
        "/Resources << /Font << /F1 5 0 R >> >> >>".encode(),
        f"<< /Length {len(stream)} >>\nstream\n".encode() + stream + b"\nendstream",
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        f"<< /Title <FEFF{name}> /Producer (sixthlink) >>".encode(),
    ]
    written = b"%PDF-1.6\n"
    places = []
    for number, body in enumerate(objects, start=1):
        places.append(len(written))
        written += f"{number} 0 obj\n".encode() + body + b"\nendobj\n"
    entries = [b"0000000000 65535 f \n", *(f"{place:010d} 00000 n \n".encode() for place in places)]
    head = f"xref\n0 {len(entries)}\n".encode()
    tail = f"trailer\n<< /Size {len(entries)} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{len(written)}\n%%EOF\n"
    return written + head + b"".join(entries) + tail.encode()
