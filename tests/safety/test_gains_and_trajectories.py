"""Checks of action matrices and trajectories: the certified box, what a car can do, the road, who is there."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chauffeur.concept import ActionMatrix, Limits, Observation, Plan, Thoughts, Trajectory, VehicleState
from chauffeur.geometry import Lane, Polyline, RoadGraph
from chauffeur.safety.checks import run_checks
from chauffeur.safety.gain_box import GAIN_NAMES, gain_box
from chauffeur.safety.trajectories import trajectory_faults

ROAD = RoadGraph((Lane("a", Polyline.of(((-50.0, 0.0), (300.0, 0.0))), 3.5, 14.0),))
EGO = VehicleState(0, "car", 0.0, 0.0, 0.0, 10.0, 4.5, 1.8, None)
NOW = Observation(0.0, 0, "track", EGO, (), (), ROAD, None, None, False, False)


def straight(speed: float = 10.0, count: int = 6) -> list[tuple[float, float]]:
    return [(speed * 0.5 * i, 0.0) for i in range(1, count + 1)]


def reasons(points: list[tuple[float, float]], now: Observation = NOW) -> str:
    return " ".join(fault.reason for fault in trajectory_faults(Trajectory(tuple(points), 0.5), now))


@pytest.mark.parametrize("place", range(6))
@pytest.mark.parametrize("side", [-1, 1])
def test_gains_beyond_the_certified_box_are_refused_with_its_ends(place: int, side: int) -> None:
    box = gain_box()
    values = [(box.low[name] + box.high[name]) / 2.0 for name in GAIN_NAMES]
    name = GAIN_NAMES[place]
    values[place] = box.high[name] * 1.1 if side > 0 else box.low[name] - 0.01
    policy = ActionMatrix((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    (verdict,) = (one for one in run_checks(Plan(Thoughts(""), policy), NOW, Limits()) if not one.passed)
    assert verdict.stops
    assert name in verdict.reason or "negative" in verdict.reason
    inside = box.clamped(policy)
    assert all(one.passed for one in run_checks(Plan(Thoughts(""), inside), NOW, Limits()))


def test_the_box_that_ships_is_certified() -> None:
    found = gain_box().certificate
    assert found["sets"] >= 10_000 and found["violations"] <= 0.001 * found["sets"]
    for worst in found["worst"].values():
        over = {name: worst[name] / bound for name, bound in found["bounds"].items() if worst[name] > bound}
        assert set(over) <= {"lateral_mps2"} and all(share < 1.12 for share in over.values()), over


def test_a_drivable_trajectory_passes() -> None:
    assert reasons(straight()) == ""


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ([(9.0, 0.0), (25.0, 0.0)], "acceleration of"),
        ([(1.0, 0.0), (2.0, 0.0)], "braking with"),
        ([(-5.0, 0.0), (-10.0, 0.0)], "backwards"),
        ([(4.0, 0.0), (5.0, 4.0), (1.0, 5.0)], "tighter than a car can turn"),
        ([(5.0, 0.0), (10.0, 0.0), (14.0, 3.0), (17.0, 7.0)], "sideways"),
        ([(5.0, 0.3), (10.0, 1.2), (15.0, 2.6), (20.0, 4.4)], "off the road"),
    ],
)
def test_what_no_car_does_is_said(points: list[tuple[float, float]], words: str) -> None:
    assert words in reasons(points)


def test_who_stands_on_the_way_is_not_driven_through_and_who_drives_on_is_followed() -> None:
    standing = replace(EGO, id=1, x_m=25.0, speed_mps=0.0)
    assert "would touch a car" in reasons(straight(), replace(NOW, others=(standing,)))
    driving = replace(standing, x_m=12.0, speed_mps=10.0)
    assert reasons(straight(), replace(NOW, others=(driving,))) == ""
    walking = replace(standing, kind="pedestrian", length_m=0.5, width_m=0.5, x_m=20.0)
    assert "touch a pedestrian" in reasons(straight(), replace(NOW, others=(walking,)))


STREET = RoadGraph(
    (
        Lane("back", Polyline.of(((300.0, 3.5), (-50.0, 3.5))), 3.5, 14.0, road="back"),
        Lane("left", Polyline.of(((-50.0, 0.0), (300.0, 0.0))), 3.5, 14.0, road="a", index=0),
        Lane("right", Polyline.of(((-50.0, -3.5), (300.0, -3.5))), 3.5, 14.0, road="a", index=1),
        Lane("strip", Polyline.of(((-50.0, -6.25), (300.0, -6.25))), 2.0, 14.0, "emergency", road="a", index=2),
        Lane("walk", Polyline.of(((-50.0, -8.25), (300.0, -8.25))), 2.0, 14.0, "sidewalk", road="a", index=3),
    )
)
IN_STREET = replace(NOW, road=STREET)


def over(*sides: float, speed: float = 5.0) -> list[tuple[float, float]]:
    """A waypoint every half second, so far to the left."""
    return [(speed * 0.5 * i, side) for i, side in enumerate(sides, start=1)]


SLOW = replace(IN_STREET, ego=replace(EGO, speed_mps=5.0, lane="left"))


@pytest.mark.parametrize(
    ("sides", "words"),
    [
        ((0.1, 0.4, 0.9, 1.5, 1.9, 2.0), "in the oncoming lane"),
        ((-0.3, -1.0, -2.0, -3.0, -3.4, -3.5), ""),  # a change of lanes
        ((-0.4, -1.5, -3.0, -4.5, -5.6, -6.0), "on the shoulder"),
        ((0.1, 0.3, 0.0, -0.3, -0.1, 0.0), ""),  # a gentle weave
        ((0.2, 1.2, 1.4, 1.3, 0.3, 0.0), "in the oncoming lane"),  # out and back
    ],
)
def test_all_of_the_car_stays_on_lanes_of_its_way(sides: tuple[float, ...], words: str) -> None:
    found = reasons(over(*sides), SLOW)
    assert words in found if words else found == ""


def test_who_comes_to_a_stand_may_do_so_on_the_shoulder_and_leave_it() -> None:
    kerbside = replace(SLOW, ego=replace(SLOW.ego, y_m=-3.5))
    assert reasons([(2.3, -0.2), (4.2, -0.9), (5.7, -1.7), (6.8, -2.2), (7.5, -2.45), (7.6, -2.45)], kerbside) == ""
    beyond = [(2.3, -0.4), (4.2, -1.4), (5.7, -2.5), (6.8, -3.3), (7.5, -3.8), (7.6, -3.8)]
    assert "on a pavement" in reasons(beyond, kerbside)
    parked = replace(SLOW, ego=replace(SLOW.ego, y_m=-6.0, speed_mps=0.0))
    assert reasons([(0.5, 0.0), (1.8, 0.1), (3.8, 0.5), (6.3, 1.3), (9.3, 2.1), (12.3, 2.5)], parked) == ""


def test_against_the_lane_is_refused() -> None:
    turned = replace(SLOW, ego=replace(SLOW.ego, heading_rad=3.14159))
    assert "oncoming" not in reasons(straight(5.0), SLOW)
    assert reasons(straight(5.0), replace(turned, ego=replace(turned.ego, y_m=3.5))) == ""
    assert "oncoming lane" in reasons([*straight(5.0)[:3], (9.5, 2.4), (11.2, 4.2), (12.0, 6.3)], SLOW)


def test_others_are_met_between_waypoints_and_along_their_lanes() -> None:
    across = replace(EGO, id=1, kind="bicycle", x_m=12.5, y_m=-12.5, heading_rad=1.5708, speed_mps=10.0, lane=None)
    # It crosses at 1.25 s, in the middle between two waypoints.
    small = replace(across, length_m=1.8, width_m=0.6)
    assert "touch a bicycle" in reasons(straight(), replace(IN_STREET, others=(small,)))
    towards = replace(EGO, id=1, x_m=60.0, y_m=3.5, heading_rad=3.14159, lane="back")
    assert reasons(straight(), replace(IN_STREET, others=(towards,))) == ""
    follower = replace(EGO, id=1, x_m=-8.0, speed_mps=12.0, lane="left")
    assert reasons(straight(8.0), replace(IN_STREET, others=(follower,))) == "", "who follows minds the ego"
    beside = replace(EGO, id=1, x_m=-6.0, y_m=-3.5, speed_mps=12.0, lane="right")
    cut_in = [(4.9, -0.3), (9.8, -1.2), (14.6, -2.4), (19.5, -3.2), (24.4, -3.5), (29.3, -3.5)]
    assert "touch a car" in reasons(cut_in, replace(IN_STREET, others=(beside,)))


def test_a_road_of_unknown_shape_refuses_nothing() -> None:
    unknown = RoadGraph((Lane("road", Polyline.of(((0.0, 0.0), (1.0, 0.0))), 0.0, 14.0),))
    assert reasons([(5.0, 0.3), (10.0, 1.2), (15.0, 2.6), (20.0, 4.4)], replace(NOW, road=unknown)) == ""
