"""State of a town's driver, so that a copy in another process answers and decides alike."""

from __future__ import annotations

from dataclasses import dataclass

from chauffeur.geometry import LaneId, Route, Turn
from chauffeur.worlds.town.foresight import Meeting


@dataclass(frozen=True, slots=True)
class Course:
    """Route and state of a driver.

    Attributes:
        route: Where to.
        goal: Whether that is somewhere to be, and not just the way on.
        turn, turning_at: The way wished at the next junction with a choice, and that junction.
        layer, lanes: The lanes of the line that is followed, and the first one's place on the route.
        ends: Whether the line leads to the end of the route.
        led_m: The beginning of the line where it changes lanes: points.
        station_m: How far along the line the rear axle is.
        changing_to_m: Up to where it changes lanes; None where it does not.
        ahead: Who is ahead on the line.
        sign: The next stop sign that is not served.
    """

    route: Route
    goal: bool
    turn: Turn | None
    turning_at: str
    layer: int
    lanes: tuple[LaneId, ...]
    ends: bool
    led_m: tuple[tuple[float, float], ...]
    station_m: float
    changing_to_m: float | None
    ahead: Meeting | None
    sign: tuple[int, float] | None
