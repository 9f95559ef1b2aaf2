"""Perception and driver from observation and road graph alone."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from chauffeur.concept import Lane, Lead, Observation, RoadGraph, Setpoints, VehicleState
from chauffeur.geometry import Polyline
from chauffeur.worlds.base import EGO, Driver, Perception
from chauffeur.worlds.over_graph import LaneDriver, ObservedPerception

ARC = [(10.0 * math.cos(a), -10.0 + 10.0 * math.sin(a)) for a in (math.pi / 2 - i * math.pi / 40 for i in range(21))]
"""A bend to the right, from (0, 0) to (10, -10)."""


def _lane(name: str, *points: tuple[float, float], **more: object) -> Lane:
    return Lane(name, Polyline.of(points), 4.0, 15.0, **more)  # type: ignore[arg-type]


ROAD = RoadGraph(
    (
        _lane("in.0", (-100.0, 4.0), (0.0, 4.0), road="in", index=0),
        _lane("in.1", (-100.0, 0.0), (0.0, 0.0), road="in", index=1, successors=("on", "right")),
        _lane("on", (0.0, 0.0), (30.0, 0.0), junction="j", successors=("out",)),
        _lane("right", *ARC, junction="j", turn="right", successors=("south",)),
        _lane("out", (30.0, 0.0), (200.0, 0.0)),
        _lane("south", (10.0, -10.0), (10.0, -100.0)),
        _lane("from-left", (20.0, 80.0), (20.0, 20.0), successors=("down",)),
        _lane("down", (20.0, 20.0), (20.0, -20.0), junction="j"),
        _lane("from-right", (24.0, -80.0), (24.0, -20.0), successors=("up",)),
        _lane("up", (24.0, -20.0), (24.0, 20.0), junction="j"),
    )
)


def car(number: int, x: float, y: float, lane: str, speed: float = 10.0, kind: str = "car") -> VehicleState:
    return VehicleState(number, kind, x, y, 0.0, speed, 5.0, 2.0, lane)  # type: ignore[arg-type]


SIGN = car(9, -10.0, 0.0, "in.1", 0.0, "stop_sign")
NOW = Observation(
    0.0, 0, "town", car(EGO, -50.0, 0.0, "in.1"),
    (car(1, 40.0, 0.0, "out", 5.0), car(2, -30.0, 4.0, "in.0"), car(3, -80.0, 4.0, "in.0")),
    (SIGN,), ROAD, Lead(1, 90.0, 5.0), 40.0, False, False,
)  # fmt: skip


def test_questions_are_answered_from_the_graph() -> None:
    asked = ObservedPerception(lambda: NOW)
    assert isinstance(asked, Perception)
    assert (asked.adjacent_lane("in.1", -1), asked.adjacent_lane("in.1", 1)) == ("in.0", None)
    assert asked.neighbours("in.0") == (2, 3)
    assert asked.neighbours("in.1") == (None, None), "a sign is nobody"
    assert asked.distance_along(EGO, 1) == pytest.approx(90.0), "over the junction"
    assert asked.distance_along(EGO, 3) == pytest.approx(-30.0)
    assert asked.cross_traffic_lanes(True) == ("from-left", "down")
    assert asked.cross_traffic_lanes(False) == ("from-right", "up")
    assert asked.stop_sign_ahead(frozenset()) == (9, pytest.approx(40.0))
    assert (asked.front_blocker(frozenset()), asked.front_blocker(frozenset({9}))) == (9, 1)
    assert asked.idm_entering(EGO, 1, 3.0) < asked.idm_entering(EGO, 1, 0.5)
    with pytest.raises(KeyError):
        asked.vehicle(77)


@pytest.mark.parametrize(("turn", "ends"), [("straight", "out"), ("right", "south")])
def test_it_drives_over_the_junction_the_way_that_is_wished(turn: str, ends: str) -> None:
    now = replace(NOW, others=(), objects=(), front=None)
    shown = [now]
    perception = ObservedPerception(lambda: shown[-1])
    driver = LaneDriver(lambda: shown[-1], perception)
    assert isinstance(driver, Driver)
    setpoints = replace(driver.initial_setpoints(), target_speed_mps=5.0, turn=turn)  # type: ignore[arg-type]
    off: list[float] = []
    for _ in range(260):
        setpoints = driver.settle(setpoints)
        command, ego = driver.command(setpoints), shown[-1].ego
        speed = max(0.0, ego.speed_mps + 0.1 * command.acceleration_mps2)
        heading = ego.heading_rad + speed * math.tan(command.steering_rad) / ego.length_m * 0.1
        x, y = ego.x_m + 0.1 * speed * math.cos(heading), ego.y_m + 0.1 * speed * math.sin(heading)
        moved = replace(ego, x_m=x, y_m=y, heading_rad=heading, speed_mps=speed, lane=setpoints.target_lane)
        off.append(abs(ROAD[setpoints.target_lane or ""].centre.project(x, y)[1]))
        shown.append(replace(now, ego=moved))
    assert setpoints.target_lane == ends
    assert max(off) < 0.8
    assert shown[-1].ego.speed_mps == pytest.approx(5.0, abs=0.1)


def test_it_stops_before_a_sign_until_it_is_served() -> None:
    near = replace(NOW, others=(), front=None, ego=car(EGO, -18.0, 0.0, "in.1", 6.0))
    driver = LaneDriver(lambda: near, ObservedPerception(lambda: near))
    assert driver.command(Setpoints(10.0)).acceleration_mps2 < -2.0
    assert driver.command(Setpoints(10.0, served_stops=frozenset({9}))).acceleration_mps2 > 0.5
