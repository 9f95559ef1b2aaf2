"""Hand-made observations for tests of Leaderboard 1.0's rules: a straight two-way street and poses on it."""

from __future__ import annotations

from collections.abc import Iterable

from chauffeur.bench.leaderboard.criteria import Infraction, RouteReferee
from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.concept import Observation, Sign, Signal, VehicleState
from chauffeur.geometry import Lane, Polyline, RoadGraph

WIDTH_M = 3.5


def street(length_m: float = 400.0) -> RoadGraph:
    """East-bound lane on y = 0, west-bound one on y = 3.5, a junction lane and a lane behind it going on east."""
    east = Lane("east", Polyline.of([(0.0, 0.0), (length_m, 0.0)]), WIDTH_M, 13.9, road="e", successors=("cross",))
    cross = Lane(
        "cross", Polyline.of([(length_m, 0.0), (length_m + 20.0, 0.0)]), WIDTH_M, 13.9, successors=("on",), junction="j"
    )
    on = Lane("on", Polyline.of([(length_m + 20.0, 0.0), (length_m + 120.0, 0.0)]), WIDTH_M, 13.9, road="o")
    west = Lane("west", Polyline.of([(length_m, 3.5), (0.0, 3.5)]), WIDTH_M, 13.9, road="w")
    return RoadGraph((east, cross, on, west))


ROAD = street()


def track(end_m: int = 400, start_m: int = 0) -> RouteTrack:
    """Along the east-bound lane, a point every metre."""
    return RouteTrack.straight([(float(x), 0.0) for x in range(start_m, end_m + 1)])


def car(
    id: int, x: float, y: float = 0.0, speed: float = 10.0, kind: str = "car", heading: float = 0.0
) -> VehicleState:
    """A road user of a usual size."""
    size = (0.6, 0.6) if kind == "pedestrian" else (4.9, 2.1)
    return VehicleState(id, kind, x, y, heading, speed, *size, None)  # type: ignore[arg-type]


def seen(
    time_s: float,
    ego: VehicleState,
    others: Iterable[VehicleState] = (),
    signals: Iterable[Signal] = (),
    signs: Iterable[Sign] = (),
    road: RoadGraph = ROAD,
) -> Observation:
    """An instant."""
    return Observation(
        time_s=time_s,
        tick=round(time_s * 20),
        kind="town",
        ego=ego,
        others=tuple(others),
        objects=(),
        front=None,
        stop_sign_m=None,
        off_road=False,
        ended=False,
        road=road,
        signals=tuple(signals),
        signs=tuple(signs),
    )


def judged(way: RouteTrack, instants: Iterable[Observation]) -> tuple[RouteReferee, list[Infraction]]:
    """What the referee says of a drive, from its first instant to the end of the route."""
    referee = RouteReferee(way)
    last = None
    for instant in instants:
        last = instant
        referee.update(instant)
        if referee.done:
            break
    assert last is not None
    referee.finish(last)
    return referee, referee.infractions
