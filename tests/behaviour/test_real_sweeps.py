"""A real positioner whose second joint was swept thirteen times."""

from __future__ import annotations

import numpy as np

from data import real
from sixthlink.calibrate.tracker import AxisFit, fit_axis, sweep_of
from sixthlink.geometry import common_normal


def sweeps_of_joint_2() -> list[AxisFit]:
    table = np.genfromtxt(real("rosi_positioner_2axis") / "measurements.csv", delimiter=",", names=True)
    points_m = np.column_stack([table["x_mm"], table["y_mm"], table["z_mm"]]) * 1e-3
    stops = np.round(table["j1_rad"], 2)
    return [
        fit_axis(sweep_of(points_m[stops == stop], angles_rad=table["j2_rad"][stops == stop]))
        for stop in np.unique(stops)
    ]


def test_circles_fit_as_well_as_the_data_is_known_to_allow():
    """Its README: radius 660 mm, 0.2 mm radial, 0.08 to 0.15 mm out of plane."""
    fits = sweeps_of_joint_2()
    assert len(fits) == 13
    assert sum(len(f.kept) for f in fits) == 205
    assert all(f.usable and f.signed and f.kept.all() for f in fits)
    radial = np.concatenate([f.deviations_m[:, 0] for f in fits])
    above = np.concatenate([f.deviations_m[:, 1] for f in fits])
    assert round(1e3 * float(np.sqrt(np.mean(radial**2))), 1) <= 0.2
    assert 1e3 * float(np.sqrt(np.mean(above**2))) <= 0.15
    assert all(abs(float(f.circles[0].radius_m) - 0.660) < 5e-4 for f in fits)


def test_the_axis_turns_with_the_first_joint():
    """The axes of joint 2 at thirteen stops of joint 1 are as far apart as joint 1 has turned, in one sense."""
    fits = sweeps_of_joint_2()
    stops = np.linspace(-30.0, 30.0, 13)
    angles = [np.rad2deg(float(common_normal(fits[0].axis, f.axis).angle_rad)) for f in fits]
    assert np.abs(np.array(angles) - (stops - stops[0])).max() < 0.1


def test_its_joint_turns_true_to_scale():
    for f in sweeps_of_joint_2():
        assert f.turning is not None
        assert abs(f.turning.scale - 1.0) < 2e-4
        assert np.sqrt(np.mean(f.tangential_m**2)) < 4e-4
