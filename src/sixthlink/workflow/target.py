"""How does a target become a page to print?"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any, cast

from sixthlink.errors import Finding, InputError
from sixthlink.export import Page, page_for, target_pdf
from sixthlink.files import atomic_write_bytes
from sixthlink.target import TARGET_KINDS, Target
from sixthlink.units import MM
from sixthlink.workflow.outcome import Outcome

__all__ = ["print_target", "target_keys"]


def print_target(target: Target, out: Path, *, paper: str | None) -> tuple[Page, Outcome]:
    """Write a PDF that shows a target at true scale.

    Args:
        target: The target.
        out: The file.
        paper: Name of the paper; None for the smallest that holds the target.

    Raises:
        InputError: The paper is unknown or too small; nothing is written.
        OSError: The file cannot be written.
    """
    try:
        page = page_for(target.drawing, paper)
    except ValueError as problem:
        raise InputError([Finding("--paper", "paper", str(problem), "", "")]) from problem
    title = ", ".join(_in_words(key, value) for key, value in target_keys(target).items())
    content = target_pdf(target.drawing, title=title, paper=page.paper)
    out.parent.mkdir(parents=True, exist_ok=True)
    atomic_write_bytes(out, content)
    return page, Outcome({"pdf": out})


def target_keys(target: Target) -> dict[str, str | float | bool]:
    """What ``recording.yaml`` says of a target, by key; lengths in millimetres, and no defaults."""
    kind = next((kind for kind, class_ in TARGET_KINDS.items() if isinstance(target, class_)), type(target).__name__)
    keys: dict[str, str | float | bool] = {"kind": kind}
    for field in fields(cast("Any", target)):  # a kind is a dataclass, which no protocol can say
        value = getattr(target, field.name)
        key = field.name.removesuffix("_m")
        if key != field.name:
            keys[key] = round(value / MM, 9)
        elif value != field.default:
            keys[key] = value
    return keys


def _in_words(key: str, value: str | float | bool) -> str:
    """A key and its value for people."""
    if isinstance(value, float):
        return f"{key} {value:g} mm"
    if value is True:
        return key
    return str(value) if key == "kind" else f"{key} {value}"
