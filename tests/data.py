"""Where the real recordings are, and what to do when they are not."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

DATA = Path(__file__).parents[2] / "shared" / "data"


def real(name: str) -> Path:
    """Folder of a real recording; skips where it is missing, except in CI, where it must be there."""
    folder = DATA / name
    if not folder.is_dir():
        if os.environ.get("CI"):
            pytest.fail(f"real recording {name} is missing under {DATA}")
        pytest.skip(f"real recording {name} is not under {DATA}")
    return folder
