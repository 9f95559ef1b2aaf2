"""Pure pursuit: where it looks, how it steers, and that it comes to the path and stays on it."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chauffeur.control.pure_pursuit import (
    chord_curvature,
    kept_within,
    look_ahead_distance,
    look_ahead_point,
    pursuit_curvature,
    pursuit_steering,
    steering_angle,
)
from chauffeur.geometry import Polyline, Pose

WHEELBASE_M = 2.8
MOST_RAD = 0.6
STRAIGHT = Polyline.of([(0.0, 0.0), (4000.0, 0.0)])

speeds = st.floats(0.0, 40.0)
places = st.floats(-200.0, 200.0)
angles = st.floats(-10.0, 10.0)


def _circle(radius_m: float, side: int = 1, step_m: float = 0.25, turns: float = 1.5) -> Polyline:
    """A circle that is entered at the origin along +x and turns where headings grow (`side` 1) or fall."""
    count = math.ceil(2.0 * math.pi * radius_m * turns / step_m)
    angle = [2.0 * math.pi * turns * i / count for i in range(count + 1)]
    return Polyline.of([(radius_m * math.sin(a), side * radius_m * (1.0 - math.cos(a))) for a in angle])


def _roll(rear: Pose, curvature: float, way_m: float) -> Pose:
    """The pose after driving a circle exactly."""
    turned = curvature * way_m
    if abs(turned) < 1e-9:
        return rear.ahead(way_m)
    forward, sideways = math.sin(turned) / curvature, (1.0 - math.cos(turned)) / curvature
    c, s = math.cos(rear.heading_rad), math.sin(rear.heading_rad)
    return Pose(rear.x_m + c * forward - s * sideways, rear.y_m + s * forward + c * sideways, rear.heading_rad + turned)


def _follow(
    rear: Pose, path: Polyline, look_ahead_m: float, speed_mps: float, seconds: float
) -> list[tuple[float, float]]:
    """(offset, curvature driven) every 0.1 s."""
    rows, station = [], path.nearest(rear.x_m, rear.y_m)
    for _ in range(round(seconds / 0.1)):
        station = path.nearest(rear.x_m, rear.y_m, station - 1.0, station + 10.0)
        angle = pursuit_steering(rear, path, look_ahead_m, station, WHEELBASE_M, MOST_RAD)
        curvature = math.tan(angle) / WHEELBASE_M
        rows.append((path.offset(rear.x_m, rear.y_m, station), curvature))
        rear = _roll(rear, curvature, speed_mps * 0.1)
    return rows


@pytest.mark.parametrize(
    ("speed", "ratio", "least", "distance"),
    [
        (11.1, 2.0, 6.0, 22.2),  # Autoware.AI's own ratio and least distance
        (2.0, 2.0, 6.0, 6.0),
        (0.0, 2.0, 6.0, 6.0),
        (11.1, 0.0, 16.0, 16.0),  # dialog mode: Talk2Drive's constant 16 m
        (5.0, 20.0, 6.0, 50.0),  # no further than the way of 10 s
        (0.5, 20.0, 8.0, 5.0),  # where the bounds cross, as Autoware.AI has it
    ],
)
def test_the_look_ahead_is_autowares(speed: float, ratio: float, least: float, distance: float) -> None:
    assert look_ahead_distance(speed, ratio, least) == pytest.approx(distance)


@given(speeds, st.floats(0.0, 20.0), st.floats(0.1, 60.0))
def test_the_look_ahead_is_bounded(speed: float, ratio: float, least: float) -> None:
    distance = look_ahead_distance(speed, ratio, least)
    assert distance <= max(least, 10.0 * speed)
    assert distance >= min(least, 10.0 * speed)


@given(st.floats(-6.0, 6.0), st.floats(-0.5, 0.5), st.floats(3.0, 25.0), st.floats(0.35, 2.0))
@settings(max_examples=60, deadline=None)
def test_it_comes_to_a_straight_path(offset: float, heading: float, speed: float, seconds_ahead: float) -> None:
    distance = max(4.0, seconds_ahead * speed)
    rows = _follow(Pose(0.0, offset, heading), STRAIGHT, distance, speed, 12.0 * distance / speed + 3.0)
    assert abs(rows[-1][0]) < 0.05
    assert abs(rows[-1][1]) < 0.005


@given(places, places, angles, st.floats(1e-3, 80.0), st.floats(-50.0, 300.0))
def test_steering_is_finite_bounded_and_symmetric(x: float, y: float, heading: float, ahead: float, at: float) -> None:
    points = [(0.0, 0.0), (40.0, 3.0), (90.0, -12.0), (120.0, 30.0)]
    path, mirrored = Polyline.of(points), Polyline.of([(px, -py) for px, py in points])
    forward, sideways = Pose(x, y, heading).sees(*look_ahead_point(path, x, y, ahead, at))
    assume(forward >= 0.0 or abs(sideways) > 1e-9)  # straight behind, either side is as good
    angle = pursuit_steering(Pose(x, y, heading), path, ahead, at, WHEELBASE_M, MOST_RAD)
    other = pursuit_steering(Pose(x, -y, -heading), mirrored, ahead, at, WHEELBASE_M, MOST_RAD)
    assert math.isfinite(angle)
    assert abs(angle) <= MOST_RAD
    assert other == pytest.approx(-angle, abs=1e-9)


@given(st.floats(8.0, 200.0), st.floats(2.0, 12.0), st.sampled_from([-1, 1]))
@settings(max_examples=40, deadline=None)
def test_on_a_circle_the_curvature_is_the_circles(radius: float, ahead: float, side: int) -> None:
    path = _circle(radius, side)
    rows = _follow(Pose(0.0, 0.0, 0.0), path, ahead, 4.0, 10.0)
    assert rows[-1][1] == pytest.approx(side / radius, rel=0.02)
    assert abs(rows[-1][0]) < 0.05


def test_a_point_on_the_circle_asks_for_that_circle() -> None:
    for angle in (0.1, 0.7, 1.5):
        assert chord_curvature(20.0 * math.sin(angle), 20.0 * (1.0 - math.cos(angle))) == pytest.approx(1.0 / 20.0)
    assert chord_curvature(0.0, 0.0) == 0.0
    assert steering_angle(1.0 / 20.0, WHEELBASE_M, MOST_RAD) == pytest.approx(math.atan(WHEELBASE_M / 20.0))


def test_the_look_ahead_point_lies_on_the_path_and_the_circle() -> None:
    path = Polyline.of([(0.0, 0.0), (10.0, 0.0), (10.0, 20.0)])
    assert look_ahead_point(path, 4.0, 1.0, math.hypot(6.0, 4.0), 4.0) == pytest.approx((10.0, 5.0))
    assert look_ahead_point(path, 9.0, 19.0, 5.0, 29.0)[0] == pytest.approx(10.0)  # beyond the end: straight on
    assert look_ahead_point(path, 9.0, 19.0, 5.0, 29.0)[1] > 20.0
    assert look_ahead_point(path, 4.0, 30.0, 5.0, 4.0) == pytest.approx((4.0, 0.0))  # too far away: its nearest point
    with pytest.raises(ValueError, match="two different points"):
        Polyline.of([(1.0, 1.0), (1.0, 1.0)])
    with pytest.raises(ValueError, match="nan"):
        Polyline.of([(1.0, 1.0), (math.nan, 1.0)])


@given(places, places, st.floats(-30.0, 60.0), st.floats(0.0, 40.0))
def test_the_nearest_point_is_nearest(x: float, y: float, low: float, wide: float) -> None:
    path = Polyline.of([(0.0, 0.0), (10.0, 0.0), (14.0, 9.0), (2.0, 12.0)])
    found = path.nearest(x, y, low, low + wide)
    assert low <= found <= low + wide
    here = path.at(found)
    least = min(
        math.dist((there.x_m, there.y_m), (x, y)) for i in range(101) for there in [path.at(low + wide * i / 100)]
    )
    assert math.dist((here.x_m, here.y_m), (x, y)) <= least + 1e-9


def test_a_path_behind_is_turned_to_as_hard_as_can_be() -> None:
    away = Pose(50.0, 2.0, math.pi)
    assert math.isinf(pursuit_curvature(away, STRAIGHT, 5.0, 50.0))
    rows = _follow(away, STRAIGHT, 5.0, 3.0, 30.0)
    assert abs(rows[-1][0]) < 0.05


@given(st.floats(3.0, 40.0), st.floats(0.2, 1.5), st.floats(5.5, 30.0), st.floats(0.5, 2.9))
@settings(max_examples=40, deadline=None)
def test_corners_are_cut_by_no_more_than_the_room(ahead: float, room: float, radius: float, turn: float) -> None:
    """Straight, an arc of up to almost a half circle, straight: with whatever look-ahead is left of a long one."""
    angles = [turn * i / 60 for i in range(61)]
    arc = [(20.0 + radius * math.sin(a), radius * (1.0 - math.cos(a))) for a in angles]
    end = Pose(*arc[-1], turn).ahead(30.0)
    path = Polyline.of([(0.0, 0.0), *arc, (end.x_m, end.y_m)])
    rear, station, worst = Pose(0.0, 0.0, 0.0), 0.0, 0.0
    while station < path.length_m - 5.0:
        station = path.nearest(rear.x_m, rear.y_m, station - 1.0, station + 3.0)
        distance = kept_within(rear, path, ahead, station, room, 2.0)
        assert distance <= ahead
        angle = pursuit_steering(rear, path, distance, station, WHEELBASE_M, MOST_RAD)
        worst = max(worst, abs(path.offset(rear.x_m, rear.y_m, station)))
        rear = _roll(rear, math.tan(angle) / WHEELBASE_M, 0.3)
    assert worst <= room + 0.15
