"""How are arrays kept honest inside frozen nouns?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Floats", "Ints", "frozen_floats", "frozen_ints"]

Floats = npt.NDArray[np.float64]
"""Float64 array; the docstring beside it gives shape and unit."""

Ints = npt.NDArray[np.int64]
"""Int64 array; the docstring beside it says what it indexes."""


def frozen_floats(values: npt.ArrayLike, shape: Sequence[int | None], name: str) -> Floats:
    """Read-only float64 copy of ``values`` after checking its shape and that every entry is finite.

    Args:
        values: Numbers.
        shape: Expected shape; ``None`` accepts any size on that axis.
        name: Name for the error message.

    Raises:
        ValueError: The shape differs or an entry is not finite.
    """
    array = np.array(values, dtype=np.float64)
    _check_shape(array, shape, name)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has {np.count_nonzero(~np.isfinite(array))} entries that are not finite")
    array.flags.writeable = False
    return array


def frozen_ints(values: npt.ArrayLike, shape: Sequence[int | None], name: str) -> Ints:
    """Read-only int64 copy of ``values`` after checking its shape.

    Raises:
        ValueError: The shape differs.
    """
    array = np.array(values, dtype=np.int64)
    _check_shape(array, shape, name)
    array.flags.writeable = False
    return array


def _check_shape(array: npt.NDArray[Any], shape: Sequence[int | None], name: str) -> None:
    fits = array.ndim == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        raise ValueError(f"{name} has shape {array.shape}, expected {tuple(shape)}")
