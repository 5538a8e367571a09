"""Where do the reflectors sit on their links, and which direction of a place do the points not show?

Without a prior, an unseen direction shows as a vanishing singular value of the whole triangular factor: its vector says
which reflector moves where, together with what. Such a place keeps its first value along that direction and gets no
uncertainty, rather than a wrong one.
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.joint import Estimate, names_of
from sixthlink.calibrate.tracked_arm.measured import TrackerData
from sixthlink.calibrate.tracked_arm.tracked_arm import ReflectorPlace
from sixthlink.geometry import Floats
from sixthlink.recording import TrackerRecord

__all__ = ["reflector_places"]

UNSEEN = 1e-9
"""Singular value of the scaled factor, over the largest, below which a direction is not seen."""

UNCERTAIN_M = 0.01
"""Standard deviation from which a direction counts as not seen: nobody measures a reflector so badly with a ruler."""

NOTABLE = 0.05


def reflector_places(record: TrackerRecord, seen: TrackerData, found: Estimate) -> tuple[ReflectorPlace, ...]:
    """Place of every reflector with its standard deviations, and what is not seen of it."""
    columns = found.problem.columns
    at = columns.reflectors_slice
    stds = np.sqrt(np.diag(found.covariance)[at]).reshape(-1, 3)
    nothing = _unseen(found)
    names = names_of(columns, ())
    places = []
    for k, index in enumerate(seen.reflectors.tolist()):
        reflector, own = record.reflectors[index], slice(at.start + 3 * k, at.start + 3 * k + 3)
        std_m, words = stds[k].copy(), []
        for direction in nothing:
            if np.linalg.norm(direction[own]) > NOTABLE:
                std_m[np.abs(direction[own]) > NOTABLE * np.linalg.norm(direction[own])] = np.inf
                others = [
                    n for n, v in zip(names, direction, strict=True) if abs(v) > NOTABLE and _other(n, reflector.name)
                ]
                words.append(_in_words(direction[own]) + (f" together with {', '.join(others[:4])}" if others else ""))
        loose = [axis for axis, std in zip("xyz", std_m.tolist(), strict=True) if UNCERTAIN_M < std < np.inf]
        if loose:
            words.append(f"along {', '.join(loose)} (uncertain by more than {UNCERTAIN_M * 1e3:g} mm)")
        place = found.fit.state.reflectors_m[k]
        places.append(ReflectorPlace(reflector.name, reflector.link, place, std_m, "; ".join(words)))
    return tuple(places)


def _unseen(found: Estimate) -> Floats:
    """Directions ``(K, G)`` of the shared unknowns, in units that the data scale, that nothing determines."""
    factor = found.fit.reduced.factor
    sizes = np.maximum(np.linalg.norm(factor, axis=0), np.finfo(np.float64).tiny)
    _, s, Vt = np.linalg.svd(factor / sizes)
    directions = Vt[s < UNSEEN * s[0]] / sizes
    return np.asarray(directions / np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), 1e-300))


def _in_words(direction: Floats) -> str:
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    return f"along ({x:.2f}, {y:.2f}, {z:.2f})"


def _other(name: str, reflector: str) -> bool:
    return not name.startswith(f"reflector.{reflector}.")
