"""Does a path that a recording names stay inside the recording?

A recording is handed on, packed and opened elsewhere, perhaps by someone who does not trust its author: it
may name its own files and no others.
"""

from __future__ import annotations

from pathlib import Path, PureWindowsPath

__all__ = ["file_inside"]


def file_inside(folder: Path, name: str) -> Path:
    """File ``name`` of the folder.

    Args:
        folder: Folder of the recording.
        name: Relative path as the recording writes it, with ``/`` between its parts.

    Raises:
        ValueError: The path is absolute, leaves the folder (also through a link), or no file is there.
    """
    if name.startswith("/") or PureWindowsPath(name).anchor:
        raise ValueError(f"'{name}' is an absolute path")
    path = folder / name
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        exists = path.is_file()
    except (OSError, RuntimeError, ValueError) as error:  # a loop of links, a name too long, a zero byte
        raise ValueError(f"'{name}' is not a usable path") from error
    if not inside:
        raise ValueError(f"'{name}' leaves the folder of the recording")
    if not exists:
        raise ValueError(f"'{name}' does not exist")
    return path
