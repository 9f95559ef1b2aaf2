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
