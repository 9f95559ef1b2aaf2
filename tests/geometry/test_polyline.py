"""Polylines, poses and boxes: projections, parts, crossings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.geometry import Box, Polyline, Pose, joined, overlap

LINE = Polyline.of([(0.0, 0.0), (10.0, 0.0), (10.0, 20.0), (40.0, 20.0)])
SPIRAL = Polyline.of((0.25 * i * math.cos(0.2 * i), 0.25 * i * math.sin(0.2 * i)) for i in range(80))
places = st.floats(-60.0, 60.0)


def test_what_makes_no_line_is_refused() -> None:
    with pytest.raises(ValueError, match="two different points"):
        Polyline.of([(1.0, 1.0), (1.0, 1.0)])
    with pytest.raises(ValueError, match="nan"):
        Polyline.of([(0.0, 0.0), (math.nan, 1.0)])


@given(places, places)
def test_no_point_of_the_line_is_closer_than_the_projection(x: float, y: float) -> None:
    station, offset = LINE.project(x, y)
    here = LINE.at(station)
    away = math.dist((here.x_m, here.y_m), (x, y))
    dense = np.linspace(0.0, LINE.length_m, 700)
    px, py, _ = LINE.poses(dense)
    assert away <= float(np.hypot(px - x, py - y).min()) + 1e-9
    assert abs(offset) <= away + 1e-9


@given(places, places, st.floats(-30.0, 200.0), st.floats(0.0, 200.0))
def test_the_closest_point_of_a_line_of_many_legs_is_that_of_its_parts(
    x: float, y: float, low: float, span: float
) -> None:
    """Of many legs most are ruled out at once: what is left must hold the closest, also between two stations."""
    found = SPIRAL.nearest(x, y, low, low + span)
    here = SPIRAL.at(found)
    away = math.dist((here.x_m, here.y_m), (x, y))
    px, py, _ = SPIRAL.poses(np.linspace(low, low + span, 900))
    assert low <= found <= low + span
    assert away <= float(np.hypot(px - x, py - y).min()) + 1e-9


def test_left_of_the_line_is_positive() -> None:
    assert LINE.project(5.0, 2.0) == pytest.approx((5.0, 2.0))
    assert LINE.project(12.0, 10.0) == pytest.approx((20.0, -2.0))
    assert LINE.project(45.0, 21.0) == pytest.approx((65.0, 1.0)), "beyond its end it goes on straight"
    assert LINE.project(-3.0, 0.0)[0] == pytest.approx(-3.0)


@given(st.lists(st.floats(-10.0, 80.0), min_size=1, max_size=8))
def test_poses_at_once_equal_poses_one_by_one(stations: list[float]) -> None:
    x, y, heading = LINE.poses(np.array(stations))
    for i, station in enumerate(stations):
        here = LINE.at(station)
        assert (x[i], y[i], heading[i]) == pytest.approx((here.x_m, here.y_m, here.heading_rad))


def test_parts_and_joints() -> None:
    middle = LINE.between(5.0, 25.0)
    assert middle.points_m == ((5.0, 0.0), (10.0, 0.0), (10.0, 15.0))
    assert LINE.reversed().at(0.0) == Pose(40.0, 20.0, pytest.approx(math.pi))
    assert joined([LINE.between(0.0, 20.0), LINE.between(20.0, 60.0)]).length_m == pytest.approx(60.0)
    assert LINE.every(7.0)[-1] == LINE.length_m
    with pytest.raises(ValueError, match="two different points"):
        LINE.between(3.0, 3.0)


def test_where_lines_cross() -> None:
    other = Polyline.of([(-5.0, 10.0), (50.0, 10.0)])
    assert LINE.crossings(other) == [(pytest.approx(20.0), pytest.approx(15.0))]
    assert LINE.crossings(Polyline.of([(0.0, 5.0), (9.0, 5.0)])) == []
    assert LINE.crossings(Polyline.of([(0.0, -1.0), (9.0, -1.0)])) == [], "parallels meet nowhere"


def test_curvature_is_positive_to_the_left() -> None:
    circle = Polyline.of([(20.0 * math.sin(a / 50), 20.0 * (1.0 - math.cos(a / 50))) for a in range(60)])
    assert circle.curvature(5.0, 8.0) == pytest.approx(1.0 / 20.0, rel=0.05)


@given(places, places, st.floats(-7.0, 7.0), places, places)
def test_a_frame_sees_what_it_places(x: float, y: float, heading: float, forward: float, leftward: float) -> None:
    pose = Pose(x, y, heading)
    assert pose.sees(*pose.place(forward, leftward)) == pytest.approx((forward, leftward), abs=1e-9)


@given(places, places, st.floats(-7.0, 7.0))
def test_boxes_overlap_where_they_share_ground(x: float, y: float, heading: float) -> None:
    car, wall = Box(x, y, heading, 5.0, 2.0), Box(0.0, 0.0, 0.3, 12.0, 4.0)
    inside = any(
        wall.holds(*Pose(x, y, heading).place(u, v))
        for u in np.linspace(-2.499, 2.499, 26)
        for v in (-0.999, 0.0, 0.999)
    )
    if inside:
        assert overlap(car, wall)
        assert overlap(wall, car)
    assert overlap(car, car)
    assert car.grown(0.5).contains(car)
