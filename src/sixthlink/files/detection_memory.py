"""What was found in an image before, so that nobody looks twice?

One small file per image in the user's cache folder, named by the image's content, by what was looked for and by the
code that looked: a changed image, target or finder is looked at again. The folder may be removed at any time.
"""

from __future__ import annotations

import hashlib
import json
import os
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np

from sixthlink.files.atomic import atomic_write_text
from sixthlink.target import Found, NotFound

__all__ = ["DetectionMemory", "cache_folder"]


def cache_folder() -> Path:
    """Where things are kept that can be made again: ``XDG_CACHE_HOME``, or ``~/.cache``."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "sixthlink"


class DetectionMemory:
    """Findings of images by content and by what was looked for."""

    def __init__(self, folder: Path | None = None) -> None:
        """Remember in a folder; in the user's cache when None. A folder that cannot be written is not used."""
        self._folder = (folder or cache_folder()) / "detections"

    def recall(self, digest: str, wanted: str) -> Found | NotFound | None:
        """What was found before.

        Args:
            digest: SHA-256 of the image file.
            wanted: What is looked for, in words that differ where it differs.
        """
        try:
            data = json.loads(self._file(digest, wanted).read_text(encoding="utf-8"))
            if "reason" in data:
                return NotFound(str(data["reason"]))
            return Found(
                np.array(data["points"], dtype=np.int64),
                np.array(data["pixels"], dtype=np.float64).reshape(-1, 2),
                np.array(data["sigmas_px"], dtype=np.float64),
            )
        except (OSError, ValueError, KeyError, TypeError):
            return None  # not there, or not whole: look again

    def remember(self, digest: str, wanted: str, answer: Found | NotFound) -> None:
        """Keep an answer; silently not, where the folder cannot be written: nothing is lost but time."""
        if isinstance(answer, NotFound):
            data: dict[str, object] = {"reason": answer.reason}
        else:
            data = {
                "points": answer.points.tolist(),
                "pixels": answer.pixels.tolist(),
                "sigmas_px": answer.sigmas_px.tolist(),
            }
        file = self._file(digest, wanted)
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            atomic_write_text(file, json.dumps(data))
        except OSError:
            return

    def _file(self, digest: str, wanted: str) -> Path:
        key = hashlib.sha256(f"{digest}\n{wanted}\n{_code()}".encode()).hexdigest()
        return self._folder / key[:2] / f"{key}.json"


@lru_cache(maxsize=1)
def _code() -> str:
    """A digest of the finders' own code and of OpenCV's version: what they find depends on both."""
    from importlib.metadata import version

    digest = hashlib.sha256(version("opencv-python-headless").encode())
    for file in sorted(resources.files("sixthlink.target").iterdir(), key=lambda f: f.name):
        if file.name.endswith(".py"):
            digest.update(file.read_bytes())
    return digest.hexdigest()
