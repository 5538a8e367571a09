"""Lines and circles in space: the algebra that does not depend on where one stands."""

from __future__ import annotations

import numpy as np
import pytest

from sixthlink.geometry import (
    Circle,
    Line,
    across_axes,
    axis_of_circle,
    beside_circle,
    circle_through,
    common_normal,
    distances_to_line,
    exp_rotation,
    feet_on_line,
    moved_circle,
    moved_line,
    phases_on_circle,
    points_on_circle,
    transform,
    transform_points,
)

RNG = np.random.default_rng(3)
T = transform(exp_rotation(RNG.uniform(-2, 2, (50, 3))), RNG.uniform(-3, 3, (50, 3)))


def lines(seed: int) -> Line:
    rng = np.random.default_rng(seed)
    return Line(rng.uniform(-2, 2, (50, 3)), rng.normal(size=(50, 3)))


def test_the_common_normal_is_across_both_lines_and_as_long_as_it_says():
    first, second = lines(1), lines(2)
    normal = common_normal(first, second)
    bridge = normal.feet_second_m - normal.feet_first_m
    assert np.abs(np.sum(bridge * first.direction, axis=1)).max() < 1e-12
    assert np.abs(np.sum(bridge * second.direction, axis=1)).max() < 1e-12
    assert np.linalg.norm(bridge, axis=1) == pytest.approx(normal.distance_m, abs=1e-12)
    assert distances_to_line(first, normal.feet_first_m).max() < 1e-12
    assert distances_to_line(second, normal.feet_second_m).max() < 1e-12


def test_no_other_points_of_two_lines_are_closer():
    first, second = lines(3), lines(4)
    shortest = common_normal(first, second).distance_m
    for along in RNG.uniform(-3, 3, (200, 2)):
        gap = first.point_m + along[0] * first.direction - second.point_m - along[1] * second.direction
        assert (np.linalg.norm(gap, axis=1) >= shortest - 1e-12).all()


def test_common_normals_move_with_the_lines_and_do_not_care_for_their_points():
    first, second = lines(5), lines(6)
    here = common_normal(first, second)
    slid = Line(first.point_m + 0.7 * first.direction, first.direction)
    there = common_normal(moved_line(T, slid), moved_line(T, second))
    assert np.abs(there.feet_first_m - transform_points(T, here.feet_first_m)).max() < 1e-11
    assert there.distance_m == pytest.approx(here.distance_m, abs=1e-12)
    assert there.angle_rad == pytest.approx(here.angle_rad, abs=1e-12)


def test_parallel_and_opposite_lines_have_their_distance():
    first = Line(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    for sense, angle in ((1.0, 0.0), (-1.0, np.pi)):
        normal = common_normal(first, Line(np.array([0.3, 0.4, 7.0]), np.array([0.0, 0.0, sense])))
        assert normal.distance_m == pytest.approx(0.5, abs=1e-15)
        assert normal.angle_rad == pytest.approx(angle, abs=1e-15)
        assert np.abs(normal.feet_first_m).max() == 0.0


def test_feet_are_the_nearest_points():
    line, points = lines(7), RNG.uniform(-2, 2, (50, 3))
    feet = feet_on_line(line, points)
    assert np.abs(np.sum((points - feet) * line.direction, axis=1)).max() < 1e-12
    assert np.linalg.norm(points - feet, axis=1) == pytest.approx(distances_to_line(line, points), abs=1e-12)


def test_frames_across_any_direction_are_right_handed():
    for direction in (np.eye(3), -np.eye(3), RNG.normal(size=(50, 3))):
        frames = across_axes(direction)
        assert np.abs(frames @ np.swapaxes(frames, -1, -2) - np.eye(3)).max() < 1e-14
        assert np.linalg.det(frames) == pytest.approx(1.0)


def test_points_of_a_circle_lie_on_it_at_their_phases():
    circle = Circle(RNG.uniform(-2, 2, (50, 3)), RNG.normal(size=(50, 3)), RNG.uniform(0.1, 2.0, 50))
    phases = RNG.uniform(-np.pi, np.pi, 50)
    points = points_on_circle(circle, phases)
    assert np.abs(beside_circle(circle, points)).max() < 1e-14
    assert phases_on_circle(circle, points) == pytest.approx(phases, abs=1e-13)


def test_a_circle_through_three_points_moves_with_them():
    triples = RNG.uniform(-1, 1, (50, 3, 3))
    circle = circle_through(triples)
    batch = Circle(circle.centre_m[:, None], circle.normal[:, None], circle.radius_m[:, None])
    assert np.abs(beside_circle(batch, triples)).max() < 1e-11
    moved = circle_through(transform_points(T[:, None], triples))
    same = moved_circle(T, circle)
    assert np.abs(moved.centre_m - same.centre_m).max() < 1e-9
    assert moved.normal == pytest.approx(same.normal, abs=1e-11)
    assert axis_of_circle(same).direction == pytest.approx(moved_line(T, axis_of_circle(circle)).direction)


def test_what_is_no_line_and_no_circle_is_refused():
    with pytest.raises(ValueError, match="length 0"):
        Line(np.zeros(3), np.zeros(3))
    with pytest.raises(ValueError, match="negative"):
        Circle(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array(-1.0))
    with pytest.raises(ValueError, match="one line"):
        circle_through(np.outer([0.0, 1.0, 2.0], [1.0, 1.0, 0.0]))
