"""The driving APIs at run time: the catalogue bound to a world's perception and driver, and to set-points."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from typing import Any, Final

from chauffeur.concept import STOP_ZONE_M, ApiCall, LaneId, Setpoints, Turn, stops_at_sign
from chauffeur.programs.catalogue import (
    MAX_SAID,
    MAX_SAID_AT_ONCE,
    MAX_SAY_CHARS,
    Api,
    Param,
    apis_of,
    argument_problem,
)
from chauffeur.programs.errors import BadArgumentTypeError, BadArgumentValueError
from chauffeur.programs.handles import HandleTable, describe
from chauffeur.programs.prefetch import CAN_WAIT, FORESEEABLE, HOST, LATER, MAX_PENDING, NOT_FORESEEN
from chauffeur.programs.questions import AskedQuestion, Questions
from chauffeur.worlds.base import EGO, Driver, Perception

_MAX_SHOWN_CHARS: Final = 60


def starting_setpoints(perception: Perception, time_headway_s: float = 1.5) -> Setpoints:
    """What LaMPilot starts every program with: present speed, present lane, 1.5 s headway."""
    return Setpoints(
        target_speed_mps=perception.vehicle(EGO).speed_mps,
        time_headway_s=time_headway_s,
        target_lane=perception.lane_of(EGO),
    )


_SAYS_TOO_MUCH: Final = "(The program says too much: what it says from here on is left out.)"
_TOO_DEEP: Final = "<deeply nested>"
"""What the sandbox hands over in place of a value, whatever it was, where a program has called itself too often."""


@dataclass(frozen=True, slots=True)
class MadeCall:
    """A call as it was made. Putting it into words takes longer than making it, so that waits until somebody asks.

    Attributes:
        name: API name.
        given: Arguments the program gave, in the catalogue's order.
        result: What it got: numbers, texts, handles and lists of handles, none of which changes afterwards.
        refused: Why it was refused.
    """

    name: str
    given: Sequence[Any]
    result: Any
    refused: Exception | None = None

    def in_words(self) -> ApiCall:
        """The call as text, cut to a readable length."""
        result = _show(self.result) if self.refused is None else f"refused: {self.refused}"
        return ApiCall(self.name, ", ".join(map(_show, self.given)), result)


class DrivingApis:
    """The APIs as one program sees them. Reads the present instant, holds the set-points, records every call.

    Attributes:
        setpoints: What the program wants so far.
        handles: What it has been handed out.
    """

    def __init__(
        self, perception: Perception, driver: Driver, setpoints: Setpoints, *, stop_zone_m: float = STOP_ZONE_M
    ) -> None:
        """Bind.

        Args:
            perception: Of the present instant.
            driver: The world's own.
            setpoints: What holds already.
            stop_zone_m: Within how much of a stop sign a stop serves it; LaMPilot's own rules know no bound.
        """
        self.setpoints = setpoints
        self._stop_zone_m = stop_zone_m
        self.handles = HandleTable()
        self._perception = perception
        self._driver = driver
        self._said: list[str] = []
        self._said_before = 0
        self._calls: list[MadeCall] = []
        self._tick = 0
        self._questions = Questions()
        self._foreseen: dict[int, tuple[MadeCall, AskedQuestion]] = {}
        self._late: list[MadeCall] = []
        self._decoded: list[Any] = []
        self._methods: dict[str, Callable[..., Any]] = {
            name: getattr(self, f"_{name}") if api.answer is None else partial(self._own, api)
            for name, api in self.apis.items()
        }

    @property
    def apis(self) -> Mapping[str, Api]:
        """What it understands, by name."""
        return apis_of("road")

    def begin_tick(self, perception: Perception) -> None:
        """A new control period: look at its instant, forget the last one's calls."""
        self._perception = perception
        self._tick += 1
        self._said_before += len(self.said)
        self._said = []
        self._calls = []
        self._late = []

    def settle(self) -> None:
        """Let the world's driver move the target lane on where it ends, as it does before every command."""
        self.setpoints = self._driver.settle(self.setpoints)

    @property
    def said(self) -> tuple[str, ...]:
        """What was said in this control period, and that something was left out where that was too much."""
        room = MAX_SAID - self._said_before  # the last place is for the note
        if len(self._said) <= min(room - 1, MAX_SAID_AT_ONCE):
            return tuple(self._said)
        if room <= MAX_SAID_AT_ONCE:
            return (*self._said[: room - 1], _SAYS_TOO_MUCH) if room > 0 else ()
        kept = MAX_SAID_AT_ONCE - 1
        return (*self._said[:kept], f"({len(self._said) - kept} more remarks were left out.)")

    @property
    def made(self) -> tuple[MadeCall, ...]:
        """Calls made in this control period, not yet put into words."""
        return tuple(self._calls)

    @property
    def calls(self) -> tuple[ApiCall, ...]:
        """Calls made in this control period, in words."""
        return tuple(call.in_words() for call in self._calls)

    def call(self, name: str, arguments: Sequence[Any], keywords: Mapping[str, Any], slot: object = None) -> Any:
        """Make one call for the program.

        Args:
            name: API name from the catalogue.
            arguments: Positional arguments: untrusted.
            keywords: Keyword arguments: untrusted.
            slot: Under which number the sandbox will remember the question: untrusted.

        Returns:
            Numbers, texts, handles and lists of handles only.

        Raises:
            BadArgumentTypeError: Wrong number, name or type of arguments.
            BadArgumentValueError: A value that cannot be: unknown handle, vehicle gone, not finite, text too long.
        """
        return self._record(self._calls, name, arguments, keywords, slot)

    def wish_later(self, pending: object) -> None:
        """Make the calls that waited in the sandbox, `(API name, number)` each: untrusted.

        Raises:
            BadArgumentTypeError, BadArgumentValueError: As `call`; what makes no sense is passed over.
        """
        if not isinstance(pending, list):
            return
        for wish in pending[:MAX_PENDING]:
            if isinstance(wish, tuple) and len(wish) == 2 and isinstance(wish[0], str) and wish[0] in CAN_WAIT:
                self._record(self._late, wish[0], wish[1:], {})

    def _record(
        self,
        record: list[MadeCall],
        name: str,
        arguments: Sequence[Any],
        keywords: Mapping[str, Any],
        slot: object = None,
    ) -> Any:
        given: list[Any] = []
        try:
            result = self._make(self.apis[name], arguments, keywords, given)
        except (BadArgumentTypeError, BadArgumentValueError) as error:
            record.append(MadeCall(name, given, None, error))
            self._questions.refused(slot)
            raise
        record.append(MadeCall(name, given, result))
        if slot is not None and name in FORESEEABLE and not keywords:
            self._questions.asked(slot, name, given, self._decoded, self._tick)
        return result

    def foreseen(self) -> list[Any]:
        """Answers to what is likely to be asked in this period, as of now, by slot (prefetch.py)."""
        answers: list[Any] = []
        self._foreseen = {}
        for slot, question in self._questions.expected(self._tick):
            try:
                answer = self._methods[question.name](*question.values)
            except (KeyError, BadArgumentValueError):  # e.g. the vehicle is gone: the program will hear it if it asks
                self._questions.refused(slot)
                continue
            result = self._encode(self.apis[question.name], answer)
            if slot >= len(answers):
                answers.extend([NOT_FORESEEN] * (slot + 1 - len(answers)))
            answers[slot] = result
            self._foreseen[slot] = MadeCall(question.name, question.given, result), question
        return answers

    def account(self, told: object) -> int:
        """Take what a program tells at the end of a period: its set-points that waited, and what else it used.

        Args:
            told: The program's word: (slots of used answers, with marks for other calls; set-points that waited). What
                makes no sense is passed over.

        Returns:
            How many calls it made in the sandbox alone that were not counted yet.
        """
        if not isinstance(told, tuple | list) or len(told) != 2:
            return 0
        used, pending = told
        count = len(pending) if isinstance(pending, list) else 0
        with suppress(BadArgumentTypeError, BadArgumentValueError):  # the stand-ins let no such wish wait
            self.wish_later(pending)
        if not isinstance(used, list):
            self._calls += self._late
            return count
        made, late = iter(self._calls), iter(self._late)
        self._calls = []
        for mark in used:
            if isinstance(mark, bool) or not isinstance(mark, int):
                continue
            if mark in self._foreseen:
                call, question = self._foreseen[mark]
                count += 1
                self._calls.append(call)
                question.again(self._tick)
            elif mark in (HOST, LATER):
                self._calls.extend(islice(made if mark == HOST else late, 1))
        self._calls.extend(chain(made, late))
        return count

    def _make(self, api: Api, arguments: Sequence[Any], keywords: Mapping[str, Any], used: list[Any]) -> Any:
        problem = argument_problem(api, len(arguments), keywords.keys())
        if problem is not None:
            raise BadArgumentTypeError(problem)
        values: list[Any] = []
        for index, param in enumerate(api.params):
            given = arguments[index] if index < len(arguments) else keywords.get(param.name, param.default)
            if given == _TOO_DEEP:
                raise BadArgumentValueError(f"{api.name}({param.name}): the program calls itself too deeply")
            values.append(self._decode(api, param, given))
            if index < len(arguments) or param.name in keywords:
                used.append(given)
        self._decoded = values
        try:
            return self._encode(api, self._methods[api.name](*values))
        except KeyError as error:
            if not (error.args and isinstance(error.args[0], int)):
                raise
            raise BadArgumentValueError(f"{api.name}: vehicle veh:{error.args[0]} is no longer on the road") from None

    def _decode(self, api: Api, param: Param, given: Any) -> Any:
        where = f"{api.name}({param.name})"
        if given is None and (param.optional or param.default is None):
            return None
        if param.kind == "vehicle":
            return self.handles.vehicle(given, where)
        if param.kind == "lane":
            return self.handles.lane(given, where)
        if param.kind == "number":
            return _number(given, param, where)
        return _text(given, where)

    def _encode(self, api: Api, result: Any) -> Any:
        if result is None:
            return None
        if api.returns == "vehicle":
            return self.handles.give_vehicle(result)
        if api.returns == "lane":
            return self.handles.give_lane(result)
        if api.returns == "lanes":
            return [self.handles.give_lane(lane) for lane in result]
        if api.returns == "number":
            return float(result)
        return result

    def _own(self, api: Api, *values: Any) -> Any:
        """What a plug-in answers: foreign code, whose answer is checked."""
        assert api.answer is not None
        try:
            answer = api.answer(self._perception, *values)
        except Exception as error:
            raise BadArgumentValueError(f"{api.name} has no answer: {type(error).__name__}: {error}") from error
        if fault := answer_fault(api, answer, self._perception):
            raise BadArgumentValueError(f"{api.name}: {fault}")
        return answer

    def _get_ego_vehicle(self) -> int:
        return EGO

    def _get_desired_time_headway(self) -> float:
        return self.setpoints.time_headway_s

    def _get_target_speed(self) -> float:
        speed = self.setpoints.target_speed_mps
        return self._perception.vehicle(EGO).speed_mps if speed is None else speed

    def _say(self, text: str) -> None:
        self._said.append(text)

    def _is_safe_enter(self, lane: LaneId | None, safe_decel: float) -> bool:
        if lane is None:
            return False
        perception, headway = self._perception, self.setpoints.time_headway_s
        front, rear = perception.neighbours(lane)
        if front is not None and perception.idm_entering(EGO, front, headway) < -safe_decel:
            return False
        return rear is None or perception.idm_entering(rear, EGO, headway) >= -safe_decel

    def _set_desired_time_headway(self, desired_time_headway: float) -> None:
        self.setpoints = replace(self.setpoints, time_headway_s=desired_time_headway)

    def _set_target_speed(self, target_speed: float) -> None:
        self.setpoints = replace(self.setpoints, target_speed_mps=target_speed)

    def _set_target_lane(self, target_lane: LaneId) -> None:
        if not self._perception.has_lane(target_lane):
            raise BadArgumentValueError("set_target_lane: this lane is no longer part of the road")
        self.setpoints = replace(self.setpoints, target_lane=target_lane)

    def _autopilot(self) -> list[float]:
        self.settle()
        command = self._driver.command(self.setpoints)
        return [float(command.acceleration_mps2), 0.0 - float(command.steering_rad)]  # LaMPilot's is to the right

    def _recover_from_stop(self) -> None:
        perception, served = self._perception, self.setpoints.served_stops
        blocker = perception.front_blocker(served)
        if blocker is None or perception.vehicle(blocker).kind != "stop_sign":
            return
        ahead_m, speed = perception.distance_along(EGO, blocker), perception.vehicle(EGO).speed_mps
        if stops_at_sign(speed, ahead_m, zone_m=self._stop_zone_m):
            self.setpoints = replace(self.setpoints, served_stops=served | {blocker})

    def _get_speed_of(self, veh: int) -> float:
        return self._perception.vehicle(veh).speed_mps

    def _get_lane_of(self, veh: int) -> LaneId:
        return self._perception.lane_of(veh)

    def _detect_front_vehicle_in(self, lane: LaneId | None, distance: float) -> int | None:
        front, _ = self._perception.neighbours(lane or self._perception.lane_of(EGO))
        if front is None or not 0 < self._perception.distance_along(EGO, front) < distance:
            return None
        return front

    def _detect_rear_vehicle_in(self, lane: LaneId | None, distance: float) -> int | None:
        _, rear = self._perception.neighbours(lane or self._perception.lane_of(EGO))
        if rear is None or not -distance < self._perception.distance_along(EGO, rear) < 0:
            return None
        return rear

    def _get_distance_between_vehicles(self, veh1: int, veh2: int) -> float:
        return -self._perception.distance_along(veh1, veh2)

    def _get_left_lane(self, veh: int | None) -> LaneId | None:
        return self._beside(veh, -1)

    def _get_right_lane(self, veh: int | None) -> LaneId | None:
        return self._beside(veh, 1)

    def _beside(self, veh: int | None, offset: int) -> LaneId | None:
        perception = self._perception
        return perception.adjacent_lane(perception.lane_of(EGO if veh is None else veh), offset)

    def _get_left_to_right_cross_traffic_lanes(self) -> Sequence[LaneId]:
        return self._perception.cross_traffic_lanes(from_left=True)

    def _get_right_to_left_cross_traffic_lanes(self) -> Sequence[LaneId]:
        return self._perception.cross_traffic_lanes(from_left=False)

    def _detect_stop_sign_ahead(self) -> float:
        sign = self._perception.stop_sign_ahead(self.setpoints.served_stops)
        return -1.0 if sign is None else sign[1]

    def _turn_left_at_next_intersection(self) -> None:
        self._turn("left")

    def _turn_right_at_next_intersection(self) -> None:
        self._turn("right")

    def _go_straight_at_next_intersection(self) -> None:
        self._turn("straight")

    def _turn(self, turn: Turn) -> None:
        self.setpoints = replace(self.setpoints, turn=turn)

    def _get_speed_limit(self) -> float:
        return self._perception.speed_limit(self._perception.lane_of(EGO))


def answer_fault(api: Api, answer: object, perception: Perception) -> str:
    """Why what a plug-in's API answered is not what it says it gives, in words; empty where it is."""
    if answer is None:
        return "" if api.maybe_none else "it answered None, which it does not announce."
    if api.returns == "number":
        right = isinstance(answer, int | float) and not isinstance(answer, bool) and math.isfinite(answer)
    elif api.returns == "flag":
        right = isinstance(answer, bool)
    elif api.returns == "text":
        right = isinstance(answer, str) and len(answer) <= MAX_SAY_CHARS and answer.isprintable()
    elif api.returns == "lane":
        right = isinstance(answer, str) and perception.has_lane(answer)
    else:
        try:
            right = isinstance(answer, int) and perception.vehicle(answer).id == answer
        except KeyError:
            right = False
    return "" if right else f"it answered {str(answer)[:_MAX_SHOWN_CHARS]!r}, no {api.returns}."


def _number(given: Any, param: Param, where: str) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float):
        unit = f" in {param.unit}" if param.unit else ""
        raise BadArgumentTypeError(f"{where} must be a number{unit}, not {describe(given)}")
    try:
        value = float(given)
    except OverflowError:
        raise BadArgumentValueError(f"{where} is too large a number") from None
    if not math.isfinite(value):
        raise BadArgumentValueError(f"{where} must be a finite number, not {value}")
    if param.clip is not None:
        value = min(max(value, param.clip[0]), param.clip[1])
    return value


def _text(given: Any, where: str) -> str:
    if given is None or isinstance(given, bool | float):
        return str(given)
    if isinstance(given, int) and given.bit_length() <= 64:
        return str(given)
    if not isinstance(given, str):
        raise BadArgumentTypeError(f"{where} must be a text, not {describe(given)}")
    if len(given) > MAX_SAY_CHARS:
        raise BadArgumentValueError(f"{where} takes at most {MAX_SAY_CHARS} characters, not {len(given)}")
    # Control characters would speak to a terminal, not to a passenger.
    return "".join(char if char.isprintable() else " " for char in given)


def _show(value: Any) -> str:
    """A checked value as short text: only numbers, flags, texts, None and lists of them come here."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return f"[{', '.join(_show(item) for item in value)}]"
    text = repr(value) if isinstance(value, str) and not value.startswith(("veh:", "lane:")) else str(value)
    return text if len(text) <= _MAX_SHOWN_CHARS else f"{text[: _MAX_SHOWN_CHARS - 1]}…"
