"""What are the lenses, once the robot has told which end of the target each shot was read from?

A target that looks the same after a turn is called by other names from shot to shot. Until its corners are surely the
same ones, a bend that is not as symmetric and misprints can neither be seen nor corrected. In shots of one placement
the robot tells the ends apart (:mod:`sixthlink.calibrate.turns`); between placements nobody can.
"""

from __future__ import annotations

from sixthlink.calibrate.cameras import calibrate_rig
from sixthlink.calibrate.rig_calibration import RigCalibration
from sixthlink.calibrate.turns import renamed
from sixthlink.calibrate.usable import SolveOptions, usable_shots
from sixthlink.errors import TooFewShotsError
from sixthlink.progress import Progress, Silent
from sixthlink.recording import Detections, Recording, shots_of_kind
from sixthlink.target import turn_names

__all__ = ["calibrate_cameras"]


def calibrate_cameras(
    recording: Recording,
    detections: Detections,
    *,
    progress: Progress | None = None,
    flat: bool = False,
) -> RigCalibration:
    """Calibrate what the recording does not give of its cameras, with the robot's help where ends look alike.

    Args:
        recording: The recording with its robot poses.
        detections: What the cameras saw.
        progress: Listener.
        flat: Whether the target counts as flat, whatever the images show.

    Raises:
        TooFewShotsError: As :func:`~.cameras.calibrate_rig`.
        CalibrationError: As :func:`~.cameras.calibrate_rig`.
    """
    target = recording.target
    placements = {recording.placements[shot] for shot in shots_of_kind(recording, "calibrate")}
    if target is None or target.turn is None or len(placements) != 1:
        return calibrate_rig(recording, detections, progress=progress, flat=flat)
    first = calibrate_rig(recording, detections, progress=Silent(), flat=True)
    try:
        usable = usable_shots(recording, first, SolveOptions(), ())
    except TooFewShotsError:  # whoever looks for the head tells why
        return first
    named = renamed(detections, usable.shots, usable.turns, turn_names(target.turn, len(target.points_m)))
    return calibrate_rig(recording, named, progress=progress, flat=flat, named=True)
