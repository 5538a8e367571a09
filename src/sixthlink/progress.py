"""How does long work tell how far it is, without knowing any console?"""

from __future__ import annotations

from typing import Protocol

__all__ = ["Progress", "Silent"]


class Progress(Protocol):
    """Receives news of long work. It may raise :class:`sixthlink.errors.Cancelled` to stop it."""

    def step(self, stage: str, done: int, total: int) -> None:
        """``done`` of ``total`` units of ``stage`` are finished."""
        ...


class Silent:
    """Listens and says nothing."""

    def step(self, stage: str, done: int, total: int) -> None:
        """Ignore the news."""
