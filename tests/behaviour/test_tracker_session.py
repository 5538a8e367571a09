"""The simulated tracker writes what a tracker would: circles about the true axes, with the noise that it says."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.geometry import inverse, transform_points
from sixthlink.robot import link_poses
from sixthlink.simulate import chain_link_poses, chain_of_arm
from tracking import irb1400, session


def test_links_stand_where_the_arms_own_kinematics_put_them():
    """Two independent forward kinematics agree link by link."""
    arm = irb1400()
    q = np.random.default_rng(0).uniform(*arm.limits.T, (8, 6))
    for link in range(1, 7):
        assert chain_link_poses(chain_of_arm(arm), q, link) == pytest.approx(link_poses(arm, q, link), abs=1e-12)


def test_every_sweep_turns_about_its_true_axis():
    """Without noise, differences of points of the rigidly carried reflector are square to the axis."""
    sim = session(range_sigma_m=1e-12, angle_sigma_rad=1e-12)
    record = sim.record
    for j, axis in enumerate(sim.truth.axes):
        own = [k for k, r in enumerate(record.reflectors) if r.link == (2 if j == 1 else 6)]
        points = record.points[(record.sweep_of == j) & np.isin(record.reflector_of, own)]
        along = (points - points.mean(axis=0)) @ axis
        # What is left is the other joints' repeatability, 50 µrad over 1.5 m.
        assert np.abs(along).max() < 5e-4
        assert np.ptp(points, axis=0).max() > 0.1


def test_noise_is_as_large_as_the_record_says():
    quiet, noisy = session(range_sigma_m=1e-12, angle_sigma_rad=1e-15), session()
    off = noisy.record.points - quiet.record.points
    d2 = np.einsum("ni,nij,nj->n", off, np.linalg.inv(noisy.record.covariances), off)
    assert d2.mean() == pytest.approx(3.0, abs=4 * np.sqrt(6.0 / len(d2)))
    sights = quiet.record.points / np.linalg.norm(quiet.record.points, axis=1, keepdims=True)
    assert np.std(np.sum(off * sights, axis=1)) == pytest.approx(2e-5, rel=0.15)


def test_outliers_and_drift_are_where_the_truth_says():
    plain, sim = session(), session(outliers=5, outlier_m=4e-3)
    assert len(sim.truth.outliers) == 5
    truly = np.empty_like(sim.record.points)
    for k, reflector in enumerate(sim.record.reflectors):
        mine = sim.record.reflector_of == k
        if mine.any():
            truly[mine] = sim.truth.seen_at(sim.record.joints[mine], reflector.name, reflector.link)
    off = np.linalg.norm(sim.record.points - truly, axis=1)
    assert set(np.flatnonzero(off > 3e-3)) == set(sim.truth.outliers)
    moved = session(drift_m=1e-3, drift_before=4)
    shift = (moved.record.references.points - plain.record.references.points)[:, 0]
    assert shift[:12] == pytest.approx(0.0, abs=1e-12)
    assert shift[12:] == pytest.approx(-1e-3, abs=1e-7)


def test_the_ground_is_where_the_truth_puts_it():
    sim = session()
    places = np.array([sim.truth.reflectors_m[n] for n in ("N1", "N2", "N3")])
    seen = transform_points(inverse(sim.truth.T_base_tracker), places)
    assert sim.record.references.points[:3] == pytest.approx(seen, abs=2e-4)
    assert sim.record.references.after.tolist()[:3] == [0, 0, 0]
