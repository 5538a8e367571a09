"""How is the truth of a simulated recording kept, beside it but never read by the calibrator?"""

from __future__ import annotations

import json
from pathlib import Path

from sixthlink.files.atomic import atomic_write_text
from sixthlink.simulate import SimulatedCell

__all__ = ["write_truth"]


def write_truth(path: Path, cell: SimulatedCell) -> None:
    """Write the true head, cameras, joints, placements and board points (metres, radians, pixels)."""
    truth = cell.truth
    data = {
        "schema": "sixthlink-truth/1",
        "T_flange_head": truth.T_flange_head.tolist(),
        "cameras": [
            {
                "name": name,
                "focal_px": camera.focal_px.tolist(),
                "centre_px": camera.centre_px.tolist(),
                "model": camera.model,
                "distortion": list(camera.written_distortion),
                "T_camera_head": T.tolist(),
            }
            for name, camera, T in zip(truth.rig.names, truth.rig.cameras, truth.rig.Ts_camera_head, strict=True)
        ],
        "joints_rad": dict(zip(cell.recording.ids, truth.joints.tolist(), strict=True)),
        "Ts_base_placement": {name: T.tolist() for name, T in truth.Ts_base_placement.items()},
        "points_m": truth.points_m.tolist(),
    }
    atomic_write_text(path, json.dumps(data, indent=1, allow_nan=False) + "\n")
