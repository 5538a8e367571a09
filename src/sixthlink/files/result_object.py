"""How does one JSON object come from a result file, and go into one?"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from sixthlink.errors import Finding, InputError
from sixthlink.files.atomic import atomic_write_text

__all__ = ["made_from", "result_fault", "result_object", "write_object"]

Made = TypeVar("Made")

MAXIMUM_BYTES = 64 * 1024 * 1024


def write_object(path: Path, data: Mapping[str, Any]) -> None:
    """Write a result; an older file stays whole until the new one is complete."""
    atomic_write_text(path, json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def result_object(path: Path, schema: str) -> dict[str, Any]:
    """The JSON object of a result file of one schema.

    Raises:
        InputError: The file is missing, too large, not JSON or of another schema.
    """
    if not path.is_file():
        raise result_fault(path, "", "no such file", "a result.json written by sixthlink calibrate", "run it first")
    if path.stat().st_size > MAXIMUM_BYTES:
        raise result_fault(path, "", f"larger than {MAXIMUM_BYTES} bytes", "a result.json", "check the path")
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError, RecursionError) as problem:
        cure = "run sixthlink calibrate again"
        raise result_fault(path, "", f"not JSON ({problem})", "a result.json", cure) from None
    if not isinstance(data, dict) or data.get("schema") != schema:
        found = data.get("schema") if isinstance(data, dict) else type(data).__name__
        raise result_fault(path, "schema", f"is {found!r}", repr(schema), "read it with the release that wrote it")
    return data


def made_from(path: Path, data: dict[str, Any], make: Callable[[dict[str, Any]], Made]) -> Made:
    """What a result's JSON object stands for.

    Raises:
        InputError: The object is incomplete or of the wrong shape.
    """
    try:
        return make(data)
    except (KeyError, TypeError, ValueError) as problem:
        cure = "the file was edited or cut; run sixthlink calibrate again"
        raise result_fault(path, str(problem), "missing or of the wrong shape", "a complete result", cure) from None


def result_fault(path: Path, field: str, what: str, expected: str, cure: str) -> InputError:
    """The error for a result file that cannot be used."""
    return InputError([Finding(str(path), field or "file", what, expected, cure)])
