"""From which fisheye does the refinement of a camera start?

Either from a pinhole lens that explains the views well: the fisheye that bends their rays alike. Or, where the field is
so wide that no pinhole lens does, from a few guesses of the field of view, each refined on the camera's own views; the
best one wins.
"""

from __future__ import annotations

import numpy as np

from sixthlink.calibrate.rig_refinement import RigProblem, refine_rig
from sixthlink.calibrate.target_poses import locate_targets
from sixthlink.camera import FISHEYE, FISHEYE_TERMS, LENS_NAMES, Camera, CameraRig, RigUnknowns, rays_from_pixels
from sixthlink.errors import CalibrationError
from sixthlink.geometry import Floats
from sixthlink.recording import CameraDescription, Detections, selected

__all__ = ["FISHEYE_FREE", "bending_alike", "guessed_fisheye"]

FISHEYE_FREE = np.isin(LENS_NAMES, ["fx", "fy", "cx", "cy", *FISHEYE_TERMS])
"""``(16,)`` which intrinsics a fisheye has."""

HALF_FIELDS_RAD = np.deg2rad([40.0, 55.0, 70.0, 85.0, 100.0])
"""Guesses of the angle between the axis and the corners of the image."""

WIDEST_GUESS_RAD = np.deg2rad(75.0)
"""Points that a guess sees farther from the axis do not count for it: a little error would put them behind."""

TERM_SIGMA = 0.1
"""How large lens terms may grow about zero while a guess is refined."""


def bending_alike(camera: Camera, pixels: Floats) -> Camera:
    """The fisheye without k3 and k4 that sees the rays of ``(M, 2)`` pixels where a pinhole camera sees them."""
    rays = rays_from_pixels(camera, pixels)
    r = np.hypot(rays[:, 0], rays[:, 1])
    theta = np.arctan(r)
    distance = np.linalg.norm((pixels - camera.centre_px) / camera.focal_px, axis=1)
    scale, first, second = np.linalg.lstsq(theta[:, None] ** np.array([1, 3, 5]), distance)[0]
    terms = np.array([first / scale, second / scale, 0.0, 0.0])
    return Camera(camera.width_px, camera.height_px, scale * camera.focal_px, camera.centre_px, terms, FISHEYE)


def guessed_fisheye(
    description: CameraDescription, points_m: Floats, seen: Detections, shots: list[int]
) -> tuple[Camera, Floats] | None:
    """The fisheye that explains the views best, and the RMS of each view per coordinate [pixel].

    Args:
        description: What is known of the camera.
        points_m: ``(P, 3)`` points of the target [m].
        seen: What this camera saw.
        shots: The views that count.

    Returns:
        None where no guess leads to an answer for all views.
    """
    seen = selected(seen, np.isin(seen.shots, shots))
    tried = [_from_guess(description, points_m, seen, float(half)) for half in HALF_FIELDS_RAD]
    answers = [answer for answer in tried if answer is not None and len(answer[1]) == len(shots)]
    return min(answers, key=lambda answer: float(np.median(answer[1])), default=None)


def _from_guess(
    description: CameraDescription, points_m: Floats, seen: Detections, half_field_rad: float
) -> tuple[Camera, Floats] | None:
    size = np.array([description.width_px, description.height_px])
    centre = 0.5 * (size - 1)
    focal = float(np.linalg.norm(size)) / 2.0 / half_field_rad
    camera = Camera(int(size[0]), int(size[1]), np.full(2, focal), centre, np.zeros(4), FISHEYE)
    counting = np.linalg.norm(seen.pixels - centre, axis=1) < WIDEST_GUESS_RAD * focal
    for rows in (counting, np.ones(len(seen), dtype=bool)):  # first the inner points, then all
        try:
            refined = _refined(description.name, camera, points_m, selected(seen, rows))
        except (CalibrationError, ValueError):
            return None
        if refined is None:
            return None
        camera, rms = refined
    return camera, rms


def _refined(name: str, camera: Camera, points_m: Floats, seen: Detections) -> tuple[Camera, Floats] | None:
    rig = CameraRig((name,), (camera,), np.eye(4)[None])
    first = Detections(seen.shots, np.zeros(len(seen), dtype=np.int64), seen.points, seen.pixels, seen.sigmas_px)
    located = locate_targets(rig, points_m, first, tuple(str(s) for s in range(int(seen.shots.max(initial=-1)) + 1)))
    if len(located.shots) == 0:
        return None
    first = selected(first, np.isin(first.shots, located.shots))
    order = np.argsort(first.shots, kind="stable")
    slots = np.searchsorted(located.shots, first.shots[order])
    terms = np.isin(LENS_NAMES, FISHEYE_TERMS)
    problem = RigProblem(
        slots=slots,
        cameras=np.zeros(len(slots), dtype=np.int64),
        points=first.points[order],
        points_target=points_m[first.points[order]],
        pixels=first.pixels[order],
        sigmas_px=first.sigmas_px[order],
        unknowns=RigUnknowns(FISHEYE_FREE[None], np.zeros(1, dtype=bool)),
        lens_prior=np.where(terms, TERM_SIGMA, np.inf)[None],
    )
    fit = refine_rig(problem, rig, located.Ts_head_target)
    squares = np.bincount(slots, weights=np.sum(fit.residuals_px**2, axis=1))
    return fit.rig.cameras[0], np.sqrt(squares / (2.0 * np.bincount(slots)))
