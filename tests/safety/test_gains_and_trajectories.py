"""Checks of action matrices and trajectories: the certified box, what a car can do, the road, who is there."""

from __future__ import annotations

from dataclasses import replace

import pytest
from golden_sentences import compare

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

KERBSIDE = replace(SLOW, ego=replace(SLOW.ego, y_m=-3.5))
PARKED = replace(SLOW, ego=replace(SLOW.ego, y_m=-6.0, speed_mps=0.0))
TURNED = replace(SLOW, ego=replace(SLOW.ego, heading_rad=3.14159, y_m=3.5))
BICYCLE = replace(
    EGO, id=1, kind="bicycle", x_m=12.5, y_m=-12.5, heading_rad=1.5708, speed_mps=10.0, lane=None, length_m=1.8,
    width_m=0.6,
)  # fmt: skip
STANDS = replace(EGO, id=1, x_m=25.0, speed_mps=0.0)
WALKS = replace(STANDS, kind="pedestrian", length_m=0.5, width_m=0.5, x_m=20.0)
COMES_TOWARDS = replace(EGO, id=1, x_m=60.0, y_m=3.5, heading_rad=3.14159, lane="back")
FOLLOWS = replace(EGO, id=1, x_m=-8.0, speed_mps=12.0, lane="left")
BESIDE = replace(EGO, id=1, x_m=-6.0, y_m=-3.5, speed_mps=12.0, lane="right")
TRAJECTORIES: dict[str, tuple[list[tuple[float, float]], Observation, bool]] = {
    # What a car can do
    "drivable": (straight(), NOW, True),
    "speeds up too hard": ([(9.0, 0.0), (25.0, 0.0)], NOW, False),
    "brakes too hard": ([(1.0, 0.0), (2.0, 0.0)], NOW, False),
    "begins backwards": ([(-5.0, 0.0), (-10.0, 0.0)], NOW, False),
    "bends too tightly": ([(4.0, 0.0), (5.0, 4.0), (1.0, 5.0)], NOW, False),
    "slides sideways": ([(5.0, 0.0), (10.0, 0.0), (14.0, 3.0), (17.0, 7.0)], NOW, False),
    # All of the car stays on lanes of its way.
    "leaves the road": ([(5.0, 0.3), (10.0, 1.2), (15.0, 2.6), (20.0, 4.4)], NOW, False),
    "ends in the oncoming lane": (over(0.1, 0.4, 0.9, 1.5, 1.9, 2.0), SLOW, False),
    "changes lanes": (over(-0.3, -1.0, -2.0, -3.0, -3.4, -3.5), SLOW, True),
    "drives on the shoulder": (over(-0.4, -1.5, -3.0, -4.5, -5.6, -6.0), SLOW, False),
    "weaves gently": (over(0.1, 0.3, 0.0, -0.3, -0.1, 0.0), SLOW, True),
    "swings out over the line and back": (over(0.2, 1.2, 1.4, 1.3, 0.3, 0.0), SLOW, False),
    "comes to a stand on the shoulder": (
        [(2.3, -0.2), (4.2, -0.9), (5.7, -1.7), (6.8, -2.2), (7.5, -2.45), (7.6, -2.45)], KERBSIDE, True,
    ),
    "comes to a stand on the pavement": (
        [(2.3, -0.4), (4.2, -1.4), (5.7, -2.5), (6.8, -3.3), (7.5, -3.8), (7.6, -3.8)], KERBSIDE, False,
    ),
    "leaves the shoulder": (
        [(0.5, 0.0), (1.8, 0.1), (3.8, 0.5), (6.3, 1.3), (9.3, 2.1), (12.3, 2.5)], PARKED, True,
    ),
    "along its lane": (straight(5.0), SLOW, True),
    "along the lane back, turned": (straight(5.0), TURNED, True),
    "turns against the lane": ([*straight(5.0)[:3], (9.5, 2.4), (11.2, 4.2), (12.0, 6.3)], SLOW, False),
    # Others are met between waypoints and along their lanes; who follows minds the ego.
    "through one who stands": (straight(), replace(NOW, others=(STANDS,)), False),
    "behind one who drives on": (straight(), replace(NOW, others=(replace(STANDS, x_m=12.0, speed_mps=10.0),)), True),
    "through one on foot": (straight(), replace(NOW, others=(WALKS,)), False),
    "through a bicycle, between two waypoints": (straight(), replace(IN_STREET, others=(BICYCLE,)), False),
    "past one who comes towards it": (straight(), replace(IN_STREET, others=(COMES_TOWARDS,)), True),
    "before one who follows": (straight(8.0), replace(IN_STREET, others=(FOLLOWS,)), True),
    "in front of one beside": (
        [(4.9, -0.3), (9.8, -1.2), (14.6, -2.4), (19.5, -3.2), (24.4, -3.5), (29.3, -3.5)],
        replace(IN_STREET, others=(BESIDE,)), False,
    ),
}  # fmt: skip


def test_what_is_said_of_trajectories() -> None:
    found = {
        name: [*trajectory_faults(Trajectory(tuple(points), 0.5), now)]
        for name, (points, now, _) in TRAJECTORIES.items()
    }
    assert {name: not faults for name, faults in found.items()} == {
        name: passes for name, (_, _, passes) in TRAJECTORIES.items()
    }
    compare("trajectories", {name: [text for one in faults for text in one] for name, faults in found.items()})


def test_a_road_of_unknown_shape_refuses_nothing() -> None:
    unknown = RoadGraph((Lane("road", Polyline.of(((0.0, 0.0), (1.0, 0.0))), 0.0, 14.0),))
    off = Trajectory(((5.0, 0.3), (10.0, 1.2), (15.0, 2.6), (20.0, 4.4)), 0.5)
    assert not [*trajectory_faults(off, replace(NOW, road=unknown))]
