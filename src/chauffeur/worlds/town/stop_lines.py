"""Stop lines: where a car stops for lights and stop signs, and keeps its tail off the line.

Who stands on a line when its light turns red has run it, by the rules of the leaderboard.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Observation, Sign, Signal
from chauffeur.worlds.town.foresight import Meeting
from chauffeur.worlds.town.way import Stretch, astride_m

SIGHT_M: Final = 80.0
"""Lines, and junctions, are looked at so far ahead of the front bumper."""
STANDING_MPS: Final = 0.08
_YELLOW_MPS2: Final = 3.0
_HARD_MPS2: Final = 5.0
_GONE_S: Final = 2.5
"""A car that stands astride a line needs so long to have all of itself behind it."""
_LINE_M: Final = 0.7
"""The front bumper stops so far before a stop line."""
OVER_M: Final = 1.0
_ROOM_BEHIND_M: Final = 5.0
"""Between a stop line and who stands ahead, beside its own length: a car stops up to 4 m behind, and is clear by 1."""
_CLEAR_M: Final = 1.2
_TO_A_STAND: Final = 5.0
"""Twice the comfortable braking, 2.5 m/s2, by which the vehicle ahead may stop, m/s2."""
_SERVED_S: Final = 0.7
_AT_SIGN_M: Final = 3.0
FIRST_SIGN: Final = 30_001
"""Number of the first sign of a town, as driving programs name it."""


@dataclass(frozen=True, slots=True)
class StopPoint:
    """A place where the front bumper has to stop (station of the stretch), and why."""

    at_m: float
    why: str


class StopLineRules:
    """The lines of one trip.

    Attributes:
        sign: (number, distance from the ego's centre) of the next stop sign that is not served; None without.
        tail_over: Whether the car stands, or will, with its tail over a line.
    """

    def __init__(self, length_m: float, dt_s: float) -> None:
        """Args: length of the car; control period."""
        self.sign: tuple[int, float] | None = None
        self.tail_over = False
        self._length_m, self._dt_s = length_m, dt_s
        self._yellow_m: float | None = None
        self._served: frozenset[str] = frozenset()
        self._stood_s = 0.0
        self._lines: dict[tuple[str, float], tuple[Stretch, float]] = {}
        self._lights_m: list[float] = []
        """Stations of the lines ahead, or under the car, whose lights may turn red."""

    def stops(
        self, seen: Observation, stretch: Stretch, station: float, nose: float, meetings: Sequence[Meeting]
    ) -> list[StopPoint]:
        """Stop points for lights and signs.

        Args:
            seen: The instant.
            stretch: The line that is followed.
            station, nose: Of the rear axle and of the front bumper along it, m.
            meetings: Who is ahead.
        """
        speed, length = seen.ego.speed_mps, self._length_m
        self.sign, self._yellow_m, self.tail_over = None, None, False
        self._lights_m.clear()
        stops: list[StopPoint] = []
        lights = {lane: signal for signal in seen.signals for lane in signal.lanes}
        signs = {lane: (n, sign) for n, sign in enumerate(seen.signs) if sign.kind == "stop" for lane in sign.lanes}
        at, _ = stretch.lane_at(station - 2.0)
        for i in range(at, len(stretch.lanes)):
            start, end = stretch.span(i)
            if start > nose + SIGHT_M:
                break
            lane = stretch.lanes[i]
            if lane.id in lights:
                light = lights[lane.id]
                line = self.line_m(stretch, light, start, end)
                self.tail_over |= line + astride_m(length) < nose < line + length + _CLEAR_M
                if light.state != "off":
                    self._lights_m.append(line)
                if light.state == "yellow" and line > nose:
                    self._yellow_m = line
                if self._light_stops(light, line, nose, speed):
                    stops.append(StopPoint(line - _LINE_M, f"light {light.state}"))
                elif self._no_room_behind(line, nose, speed, meetings):
                    stops.append(StopPoint(line - _LINE_M, "no room behind the stop line"))
                elif self._waits_astride(light, line, nose, speed, meetings):
                    stops.append(StopPoint(line + astride_m(length), "its tail before the stop line"))
            if lane.id in signs and signs[lane.id][1].id not in self._served:
                number, sign = signs[lane.id]
                line = self.line_m(stretch, sign, start, end)
                if not self._serves(sign, line, nose, speed):
                    stops.append(StopPoint(line - _LINE_M, "stop sign"))
                    if self.sign is None:
                        self.sign = FIRST_SIGN + number, line - nose + length / 2.0
        return stops

    def clear_of_lines(self, stop: StopPoint, nose: float, speed: float) -> StopPoint:
        """A stop for something else, moved to where the tail stands on no line of a light: before the line where the
        car can still stop there, else with its tail before the line, else beyond it."""
        for line in self._lights_m:
            astride, clear = line + astride_m(self._length_m), line + self._length_m + _CLEAR_M
            if not astride < stop.at_m < clear:
                continue
            rooms = (line - _LINE_M - nose, _HARD_MPS2), (astride - nose, _YELLOW_MPS2)
            places = [nose + room for room, braking in rooms if room > 0.0 and speed * speed <= 2.0 * braking * room]
            return StopPoint(places[0] if places else clear, f"{stop.why}; its tail on no stop line")
        return stop

    def line_m(self, stretch: Stretch, what: Signal | Sign, start: float, end: float) -> float:
        """Station of a stop line on the stretch; the end of the lane where none is given."""
        if what.stop_line_m is None:
            return end
        known = self._lines.get((what.id, start))
        if known is None or known[0] is not stretch:
            (ax, ay), (bx, by) = what.stop_line_m
            at = stretch.line.nearest((ax + bx) / 2.0, (ay + by) / 2.0, start, end + 6.0)
            known = self._lines[what.id, start] = stretch, min(max(at, start), end + 6.0)
        return known[1]

    def _light_stops(self, light: Signal, line: float, nose: float, speed: float) -> bool:
        ahead = line - nose
        if light.state in ("off", "green") and not (light.state == "green" and light.remaining_s is not None):
            return False
        if ahead < -OVER_M or (ahead < 0.0 and speed > 2.0):
            return False  # over it already: clear the junction
        gently = speed * speed / (2.0 * _YELLOW_MPS2) <= max(0.0, ahead - _LINE_M) + 0.3
        if light.state == "red":
            return True
        if light.state == "yellow":
            return gently
        assert light.remaining_s is not None
        through = (ahead + self._length_m + 2.0) / max(speed, 3.0)
        return gently and ahead < 25.0 and through > light.remaining_s + 1.0 and speed > 1.0

    def before_yellow(self, nose: float, speed: float) -> list[StopPoint]:
        """A stop before a line whose light is yellow, harder than for the light alone: who lets somebody go first in
        the junction would stand astride the line when it turns red."""
        if self._yellow_m is None:
            return []
        room = self._yellow_m - _LINE_M - nose
        return [StopPoint(self._yellow_m - _LINE_M, "light yellow")] if speed * speed <= 2.0 * _HARD_MPS2 * room else []

    def _no_room_behind(self, line: float, nose: float, speed: float, meetings: Sequence[Meeting]) -> bool:
        """True if who is ahead would leave no room for all of the car behind a line that it can still stop at.

        Who stands on a line when its light turns red has run it.
        """
        ahead = line - _LINE_M - nose
        if ahead < -_LINE_M or speed * speed > 2.0 * _YELLOW_MPS2 * (max(0.0, ahead) + 0.3):
            return False
        return self._crowded(line, meetings)

    def _crowded(self, line: float, meetings: Sequence[Meeting]) -> bool:
        """True if who is ahead leaves no room for all of the car behind a line, should they stop."""
        needed = line + self._length_m + _ROOM_BEHIND_M
        return any(
            one.now and one.along and line - 0.5 < one.first_m < needed - max(0.0, one.along_mps) ** 2 / _TO_A_STAND
            for one in meetings
        )

    def _waits_astride(
        self, light: Signal, line: float, nose: float, speed: float, meetings: Sequence[Meeting]
    ) -> bool:
        """True if a car whose front is over a line waits there with its tail before it: it came to a stand in a queue,
        and its light has turned red since, or there is no room behind the line yet."""
        room = line + astride_m(self._length_m) - nose
        if nose < line or light.state == "off" or speed * speed > 2.0 * _YELLOW_MPS2 * max(0.0, room):
            return False
        turns = light.state == "yellow" and light.remaining_s is not None and light.remaining_s < _GONE_S
        return light.state == "red" or turns or self._crowded(line, meetings)

    def _serves(self, sign: Sign, line: float, nose: float, speed: float) -> bool:
        """True if a stop sign is served, or has been passed."""
        if nose > line + _AT_SIGN_M:
            self._served |= {sign.id}
            return True
        if speed < STANDING_MPS and abs(line - _LINE_M - nose) < _AT_SIGN_M:
            self._stood_s += self._dt_s
            if self._stood_s >= _SERVED_S:
                self._served |= {sign.id}
                self._stood_s = 0.0
                return True
        return False
