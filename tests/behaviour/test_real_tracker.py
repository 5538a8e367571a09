"""A real two-axis positioner without any drawing: its arm comes from its circles."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from data import real
from sixthlink.calibrate.tracked_arm import TrackedArm, calibrate_arm_by_tracker
from sixthlink.files import read_tracker_record
from sixthlink.progress import Silent

RECORD = """\
schema: sixthlink-tracker/1
name: two-axis positioner
instrument: not known
units: {length: mm, angle: rad}
robot: {kinematics: none, label: two-axis positioner, joints: [turning, turning], joints_confirmed: true}
sigma: unknown
reflectors: {probe: 2}
sweeps: {grid: free}
tables:
  - file: measurements.csv
    sweep: grid
    reflector: probe
    orientation: quaternion-xyzw
    direction: T_tracker_reflector
    columns: {x: x_mm, y: y_mm, z: z_mm, joints: [j1_rad, j2_rad], orientation: [qx, qy, qz, qw]}
"""


@pytest.fixture(scope="module")
def positioner(tmp_path_factory) -> TrackedArm:
    folder: Path = tmp_path_factory.mktemp("positioner")
    shutil.copy(real("rosi_positioner_2axis") / "measurements.csv", folder)
    (folder / "tracker.yaml").write_text(RECORD, encoding="utf-8")
    return calibrate_arm_by_tracker(read_tracker_record(folder), Silent())


def test_unseen_poses_are_met_as_well_as_anybody_has(positioner):
    """Its README: 0.41 mm and 0.053° on held-out poses with a free chain of frames."""
    assert positioner.accepted, [g.message for g in positioner.gates if not g.passed]
    assert positioner.heldout.rms_m <= 0.41e-3
    assert positioner.heldout.rms_rad is not None
    assert np.rad2deg(positioner.heldout.rms_rad) <= 0.053


def test_the_grid_holds_sweeps_of_both_joints(positioner):
    sweeps = [s for s in positioner.sweeps if s.implied and s.fit is not None]
    assert {s.joint for s in sweeps} == {0, 1}
    second = [s for s in sweeps if s.joint == 1]
    assert len(second) == 13
    assert all(abs(float(s.fit.circles[0].radius_m) - 0.660) < 5e-4 for s in second)
    off = np.concatenate([s.fit.deviations_m[s.fit.kept, 0] for s in second])
    assert round(1e3 * float(np.sqrt(np.mean(off**2))), 1) <= 0.2


def test_nothing_of_a_drawing_is_claimed(positioner):
    assert not positioner.drawn
    assert "axes of two-axis positioner" in positioner.nominal.source
    assert {b.block for b in positioner.joint.blocks} <= {"scale", "harmonics"}
