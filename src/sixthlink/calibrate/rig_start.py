"""From which camera poses does the refinement of a head start, and which shots contradict the others?

Camera poses start from what the majority of shots agrees on; a symmetric board that two cameras read from opposite ends
is put right on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sixthlink.calibrate.lens_start import FEWEST_VIEWS
from sixthlink.calibrate.turns import turn_transforms
from sixthlink.errors import CalibrationError, TooFewShotsError
from sixthlink.geometry import Floats, Ints, inverse, mean_transform, rotation_angle
from sixthlink.recording import Detections, Rejection, selected

__all__ = ["PoseStart", "refusals_of", "rejections_of", "start_pose", "without"]

AGREEMENT_RAD, AGREEMENT_SHARE = np.deg2rad(3.0), 0.05
"""Two shots agree on the pose between cameras within this angle and this share of the target's distance."""


@dataclass(frozen=True, eq=False)
class PoseStart:
    """First pose of one camera beside the reference.

    Attributes:
        T_camera_head: ``(4, 4)`` pose of the head frame in the camera.
        turned: Turns of a symmetric target by which the camera's names in a shot must be turned to be the reference's.
        exchanged: Reason per shot in which the two cameras' images look exchanged.
        refused: Reason per shot in which the two cameras contradict the majority in another way.
    """

    T_camera_head: Floats
    turned: dict[int, int]
    exchanged: dict[int, str]
    refused: dict[int, str]


def start_pose(  # noqa: PLR0917 - the two cameras' views, the target twice over and what is given
    names: tuple[str, str],
    Ts_reference_target: dict[int, Floats],
    Ts_camera_target: dict[int, Floats],
    points_m: Floats,
    turn: Ints | None,
    given: Floats | None,
) -> PoseStart:
    """Pose between two cameras that the majority of shots agrees on, or the given one, and who contradicts it.

    Args:
        names: Names of the reference and of the camera.
        Ts_reference_target: ``T_reference_target`` per shot.
        Ts_camera_target: ``T_camera_target`` per shot.
        points_m: ``(P, 3)`` points of the target [m].
        turn: Names of the points after the least turn of a symmetric target.
        given: ``T_camera_head`` that the recording gives, or None.

    Raises:
        TooFewShotsError: Fewer than three shots show the target to both cameras.
        CalibrationError: The shots contradict the given pose, or one another.
    """
    shots = sorted(Ts_reference_target.keys() & Ts_camera_target.keys())
    if given is not None and not shots:
        return PoseStart(given, {}, {}, {})
    if given is None and len(shots) < FEWEST_VIEWS:
        raise TooFewShotsError(
            f"cameras {names[0]!r} and {names[1]!r} see the target together in {len(shots)} shots, expected at least "
            f"{FEWEST_VIEWS}; record shots that both see, or give the pose between them",
            needed=FEWEST_VIEWS,
            usable=len(shots),
        )
    reference = np.stack([Ts_reference_target[s] for s in shots])
    camera = np.stack([Ts_camera_target[s] for s in shots])
    renamed = turn_transforms(points_m, turn)
    candidates = np.stack([camera @ T @ inverse(reference) for T in renamed], axis=1)  # (S, K, 4, 4)
    reach_m = AGREEMENT_SHARE * reference[:, 2, 3]
    votes = candidates[:, 0] if given is None else given[None]
    agreeing = [_agreement(candidates, vote, reach_m) for vote in votes]
    best = int(np.argmax([np.count_nonzero(a >= 0) for a in agreeing]))
    choice = agreeing[best]
    good = np.flatnonzero(choice >= 0)
    exchanged = _agreement(inverse(candidates), votes[best], 2.0 * reach_m) >= 0
    _refuse_contradiction(names, given, len(good), int(np.count_nonzero(exchanged)), len(shots))
    against = np.flatnonzero(choice < 0)
    swapped = {shots[k]: f"the images of {names[0]!r} and {names[1]!r} look exchanged" for k in against if exchanged[k]}
    refused = {shots[k]: _contradiction(names, candidates[k, 0], votes[best]) for k in against if not exchanged[k]}
    turned = {shots[k]: int(choice[k]) for k in good if choice[k]}
    T = given if given is not None else mean_transform(candidates[good, choice[good]])
    return PoseStart(T, turned, swapped, refused)


def _agreement(candidates: Floats, T: Floats, reach_m: Floats) -> Ints:
    """Which of the ``(S, K, 4, 4)`` candidates of each shot agrees with T: its number ``(S,)``, -1 for none."""
    angle = rotation_angle(np.swapaxes(candidates[..., :3, :3], -1, -2) @ T[:3, :3])
    shift = np.linalg.norm(candidates[..., :3, 3] - T[:3, 3], axis=-1)
    miss = np.maximum(angle / AGREEMENT_RAD, shift / reach_m[:, None])
    nearest = np.argmin(miss, axis=1)
    return np.where(miss[np.arange(len(miss)), nearest] <= 1.0, nearest, -1).astype(np.int64)


def _refuse_contradiction(
    names: tuple[str, str], given: Floats | None, agreeing: int, exchanged: int, total: int
) -> None:
    if given is not None and exchanged > agreeing:
        raise CalibrationError(
            f"the images of {names[0]!r} and {names[1]!r} look exchanged in {exchanged} of {total} shots: the "
            "given pose between the cameras fits the other way round; exchange their image columns"
        )
    if given is not None and not agreeing:
        raise CalibrationError(
            f"the given pose of camera {names[1]!r} fits none of {total} shots that it sees together with "
            f"{names[0]!r}; correct it, or leave it out to have it calibrated"
        )
    if given is None and agreeing < FEWEST_VIEWS:
        raise CalibrationError(
            f"no {FEWEST_VIEWS} of {total} shots agree on the pose between cameras {names[0]!r} and {names[1]!r}; are "
            "the two images of each shot from the same moment, and the cameras fixed to one another?"
        )


def _contradiction(names: tuple[str, str], T: Floats, expected: Floats) -> str:
    angle = float(np.rad2deg(rotation_angle(T[:3, :3].T @ expected[:3, :3])))
    shift = float(np.linalg.norm(T[:3, 3] - expected[:3, 3]))
    return (
        f"the target's poses in {names[0]!r} and {names[1]!r} contradict the other shots by {angle:.1f}° and "
        f"{1e3 * shift:.0f} mm; are both images from the same moment?"
    )


def refusals_of(single: list[dict[int, str]], pairs: list[PoseStart]) -> dict[int | None, dict[int, str]]:
    """Reason per refused shot: of one camera, or of all under None.

    Exchanged images explain why a camera by itself refused a view; any other contradiction follows from such a view.
    """
    exchanged: dict[int, str] = {}
    contradicting: dict[int, str] = {}
    for between in pairs:
        exchanged |= between.exchanged
        contradicting |= between.refused
    by_one = {s for refused in single for s in refused}
    whole = exchanged | {s: reason for s, reason in contradicting.items() if s not in by_one | exchanged.keys()}
    refusals: dict[int | None, dict[int, str]] = {
        c: {s: reason for s, reason in refused.items() if s not in exchanged} for c, refused in enumerate(single)
    }
    return refusals | {None: whole}


def without(detections: Detections, shots: set[int], camera: int | None = None) -> Detections:
    """The rows that are not in the named shots, of one camera or of all."""
    gone = np.isin(detections.shots, sorted(shots))
    if camera is not None:
        gone &= detections.cameras == camera
    return selected(detections, ~gone)


def rejections_of(refused: dict[int, str], ids: tuple[str, ...], camera: str) -> list[Rejection]:
    """Rejections of the shots that were refused."""
    return [Rejection(ids[s], camera, reason) for s, reason in sorted(refused.items())]
