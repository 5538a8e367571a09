"""How does a file change so that a reader, or a power cut, never meets half of it?

The new content goes to a temporary file in the same folder, reaches the disk, and takes the old name in one
step.
"""

from __future__ import annotations

import contextlib
import os
import secrets
from pathlib import Path

__all__ = ["atomic_write_bytes", "atomic_write_text"]


def atomic_write_text(path: Path, text: str) -> None:
    """Replace or create a file with UTF-8 text, all of it or nothing; line ends stay as they are in ``text``.

    Raises:
        OSError: The folder cannot be written; the old file, if any, is untouched and nothing is left behind.
    """
    atomic_write_bytes(path, text.encode("utf-8"))


def atomic_write_bytes(path: Path, data: bytes) -> None:
    """Replace or create a file with ``data``, all of it or nothing.

    Raises:
        OSError: The folder cannot be written; the old file, if any, is untouched and nothing is left behind.
    """
    temporary = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with temporary.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Make the new name durable too, where folders can be synchronised."""
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
