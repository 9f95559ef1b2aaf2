"""Observations put together by hand: a highway and a crossing of towns, right-handed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from chauffeur.concept.scene import AgentKind, Observation, Sign, Signal, SignalState, VehicleState
from chauffeur.geometry import Lane, Polyline, Pose, RoadGraph

SIZES: dict[str, tuple[float, float]] = {
    "car": (4.6, 1.85),
    "truck": (10.0, 2.5),
    "bus": (12.0, 2.55),
    "motorcycle": (2.2, 0.8),
    "bicycle": (1.8, 0.6),
    "pedestrian": (0.6, 0.6),
    "static": (0.5, 0.5),
    "obstacle": (2.0, 2.0),
    "stop_sign": (0.5, 0.5),
}


def agent(
    number: int, x: float, y: float, heading: float = 0.0, speed: float = 10.0, kind: AgentKind = "car", **more: Any
) -> VehicleState:
    return VehicleState(number, kind, x, y, heading, speed, *SIZES[kind], None, **more)


def observed(
    road: RoadGraph,
    ego: VehicleState,
    others: Sequence[VehicleState] = (),
    objects: Sequence[VehicleState] = (),
    signals: Sequence[Signal] = (),
    signs: Sequence[Sign] = (),
    tick: int = 0,
) -> Observation:
    return Observation(
        time_s=tick / 10.0,
        tick=tick,
        kind="highway",
        ego=ego,
        others=tuple(others),
        objects=tuple(objects),
        road=road,
        front=None,
        stop_sign_m=None,
        off_road=False,
        ended=False,
        signals=tuple(signals),
        signs=tuple(signs),
    )


def highway(lanes: int = 3, length: float = 500.0) -> RoadGraph:
    """Lanes along x, lane 0 leftmost with its middle at y = 0."""
    return RoadGraph(
        tuple(
            Lane(f"a{i}", Polyline.of([(0.0, -4.0 * i), (length, -4.0 * i)]), 4.0, 31.3, "driving", "a", i)
            for i in range(lanes)
        )
    )


def crossing(arm: float = 110.0, width: float = 3.5, half: float = 12.0, limit: float = 13.9) -> RoadGraph:
    """Four arms with a lane each way; `in0` comes from the east, then counter-clockwise."""
    lanes: list[Lane] = []
    for k in range(4):
        out = Pose(0.0, 0.0, k * math.pi / 2.0)
        onward = tuple(f"t{k}{j}" for j in range(4) if j != k)
        ends = out.place(arm, width / 2.0), out.place(half, width / 2.0)
        lanes.append(Lane(f"in{k}", Polyline.of(ends), width, limit, "driving", f"in{k}", 0, onward))
        ends = out.place(half, -width / 2.0), out.place(arm, -width / 2.0)
        lanes.append(Lane(f"out{k}", Polyline.of(ends), width, limit, "driving", f"out{k}", 0))
        for j in range(4):
            if j != k:
                lanes.append(_turn(k, j, half, width, limit))
    return RoadGraph(tuple(lanes))


def _turn(k: int, j: int, half: float, width: float, limit: float) -> Lane:
    a, b = Pose(0.0, 0.0, k * math.pi / 2.0), Pose(0.0, 0.0, j * math.pi / 2.0)
    p, q = a.place(half, width / 2.0), b.place(half, -width / 2.0)
    reach = math.dist(p, q)
    points: list[tuple[float, float]] = []
    for i in range(13):
        t = i / 12.0
        w = 2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2
        out = -math.cos(a.heading_rad), -math.sin(a.heading_rad)
        into = math.cos(b.heading_rad), math.sin(b.heading_rad)
        x, y = (w[0] * p[n] + w[1] * reach * out[n] + w[2] * q[n] + w[3] * reach * into[n] for n in range(2))
        points.append((x, y))
    return Lane(f"t{k}{j}", Polyline.of(points), width, limit, "driving", f"t{k}{j}", 0, (f"out{j}",), junction="J")


def signals(state: SignalState = "red") -> tuple[Signal, ...]:
    """Lights for all arms; those across show green where `state` is red."""
    found: list[Signal] = []
    for k in range(4):
        arm = Pose(0.0, 0.0, k * math.pi / 2.0)
        shown: SignalState = state if k % 2 == 0 else "green" if state == "red" else "red"
        found.append(Signal(f"s{k}", shown, (f"in{k}",), (arm.place(12.3, 3.4), arm.place(12.3, 0.1))))
    return tuple(found)


def town(state: SignalState = "red", tick: int = 0) -> Observation:
    """The ego comes from the west, 40 m before the crossing."""
    return observed(
        crossing(),
        agent(0, -40.0, -1.75, 0.0, 9.0),
        [
            agent(1, -22.0, -1.75, 0.0, 4.0, acceleration_mps2=-2.0),
            agent(2, 1.75, -30.0, math.pi / 2.0, 5.0, "truck"),
            agent(3, 30.0, 1.75, math.pi, 8.0, "bus"),
            agent(4, -30.0, 1.75, math.pi, 9.0),
            agent(5, -9.5, -4.4, math.pi / 2.0, 1.4, "pedestrian"),
            agent(7, -28.0, -3.0, 0.0, 5.0, "bicycle"),
        ],
        signals=signals(state),
        signs=[Sign("limit", "speed_limit", ("in2",), -25.0, -4.5, None, 13.9)],
        tick=tick,
    )


def open_road(*others: VehicleState, lane: int = 1, tick: int = 0) -> Observation:
    """The ego on a highway of three lanes."""
    return observed(highway(), agent(0, 200.0, -4.0 * lane, 0.0, 28.0), others, tick=tick)
