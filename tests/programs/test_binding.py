"""The catalogue and its run-time binding: LaMPilot's meanings, checked by hand on the straight road."""

from __future__ import annotations

import ast
import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from straight_road import CROSS, LANES, StraightRoad

from chauffeur.concept import LaneId
from chauffeur.programs import APIS, CATALOGUE, DrivingApis, render_docs, starting_setpoints
from chauffeur.programs.catalogue import argument_problem
from chauffeur.programs.errors import BadArgumentTypeError, BadArgumentValueError
from chauffeur.programs.handles import HandleTable, describe, lane_handle
from chauffeur.worlds.base import EGO

LAMPILOT_APIS = {
    "get_ego_vehicle", "get_desired_time_headway", "get_target_speed", "say", "is_safe_enter",
    "set_desired_time_headway", "set_target_speed", "set_target_lane", "autopilot", "recover_from_stop",
    "get_speed_of", "get_lane_of", "detect_front_vehicle_in", "detect_rear_vehicle_in",
    "get_distance_between_vehicles", "get_left_lane", "get_right_lane", "get_left_to_right_cross_traffic_lanes",
    "get_right_to_left_cross_traffic_lanes", "detect_stop_sign_ahead", "turn_left_at_next_intersection",
    "turn_right_at_next_intersection", "go_straight_at_next_intersection",
}  # fmt: skip


class Caller:
    """Calls APIs as a program would."""

    def __init__(self, road: StraightRoad) -> None:
        self.road = road
        self.apis = DrivingApis(road, road, starting_setpoints(road))

    def __call__(self, name: str, *args: Any, **kwargs: Any) -> Any:
        return self.apis.call(name, args, kwargs)


@pytest.fixture
def call(road: StraightRoad) -> Caller:
    return Caller(road)


def test_catalogue_is_lampilots_and_the_speed_limit() -> None:
    assert set(APIS) == LAMPILOT_APIS | {"get_speed_limit"}
    assert len(CATALOGUE) == len(APIS) == 24


def test_docs_are_python_and_name_everything() -> None:
    docs = render_docs()
    functions = {node.name: node for node in ast.parse(docs).body if isinstance(node, ast.FunctionDef)}
    assert set(functions) == set(APIS)
    for api in CATALOGUE:
        text = ast.get_docstring(functions[api.name]) or ""
        assert api.example in text
        assert all(f"{param.name}:" in text for param in api.params)
        assert [arg.arg for arg in functions[api.name].args.args] == [param.name for param in api.params]
    assert "0.01..2.0" in docs
    assert "[m/s]" in docs


def test_argument_shapes() -> None:
    detect = APIS["detect_front_vehicle_in"]
    assert argument_problem(detect, 1, []) is None
    assert argument_problem(detect, 0, ["lane", "distance"]) is None
    assert argument_problem(detect, 3, []) is not None
    assert argument_problem(detect, 1, ["lane"]) is not None
    assert argument_problem(detect, 0, ["distance"]) is not None
    assert argument_problem(detect, 1, ["how_far"]) is not None
    assert argument_problem(APIS["get_left_lane"], 0, []) is None


def test_starts_as_lampilot_starts(call: Caller) -> None:
    assert call("get_target_speed") == 25.0
    assert call("get_desired_time_headway") == 1.5
    assert call.apis.setpoints.target_lane == LANES[1]
    assert call("get_ego_vehicle") == "veh:0"
    assert call("get_speed_limit") == 31.0


@pytest.mark.parametrize(("given", "kept"), [(1.2, 1.2), (0, 0.01), (-3, 0.01), (2.5, 2.0)])
def test_headway_is_clipped(call: Caller, given: float, kept: float) -> None:
    call("set_desired_time_headway", given)
    assert call("get_desired_time_headway") == kept


@pytest.mark.parametrize(("given", "kept"), [(30, 30.0), (0, 0.0), (-3.5, 0.0), (72.5, 72.5), (1e6, 1000.0)])
def test_target_speed(call: Caller, given: float, kept: float) -> None:
    call("set_target_speed", given)
    assert call("get_target_speed") == kept


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400])
def test_numbers_are_finite(call: Caller, value: float) -> None:
    with pytest.raises(BadArgumentValueError):
        call("set_target_speed", value)
    assert call("get_target_speed") == 25.0


def test_lanes_beside(call: Caller) -> None:
    ego = call("get_ego_vehicle")
    left, right = call("get_left_lane", ego), call("get_right_lane")
    assert (left, right) == ("lane:a-b:0", "lane:a-b:2")
    call("set_target_lane", left)
    assert call.apis.setpoints.target_lane == LANES[0]
    call.road.cars[EGO] = replace(call.road.cars[EGO], lane=0)
    assert call("get_left_lane", ego) is None
    assert call("get_lane_of", ego) == left


def test_detection_is_strictly_inside_the_distance(call: Caller) -> None:
    own = call("get_lane_of", call("get_ego_vehicle"))
    assert call("detect_front_vehicle_in", own) == "veh:1"
    assert call("detect_front_vehicle_in", own, 45) is None
    assert call("detect_front_vehicle_in", own, 45.1) == "veh:1"
    assert call("detect_rear_vehicle_in", own) is None
    right = call("get_right_lane")
    assert call("detect_rear_vehicle_in", right, distance=40) is None
    assert call("detect_rear_vehicle_in", lane=right, distance=40.1) == "veh:3"
    assert call("detect_front_vehicle_in", None) == "veh:1"


def test_distance_is_positive_when_the_first_is_ahead(call: Caller) -> None:
    front = call("detect_front_vehicle_in", None)
    ego = call("get_ego_vehicle")
    assert call("get_distance_between_vehicles", front, ego) == 45.0
    assert call("get_distance_between_vehicles", ego, front) == -45.0


def test_safe_to_enter_asks_front_and_rear_with_the_present_headway(call: Caller) -> None:
    right, left = call("get_right_lane"), call("get_left_lane")
    assert call("is_safe_enter", None) is False
    assert call("is_safe_enter", left) is True
    assert call("is_safe_enter", right) is True
    call.road.cars[3] = replace(call.road.cars[3], x_m=95.0)
    assert call("is_safe_enter", right) is False
    assert call("is_safe_enter", right, 1e9) is True
    call.road.cars[2] = replace(call.road.cars[2], x_m=145.0, speed_mps=25.0)
    assert call("is_safe_enter", left) is True
    assert call("is_safe_enter", left, safe_decel=0.2) is False
    call("set_desired_time_headway", 0.5)
    assert call("is_safe_enter", left, safe_decel=0.2) is True


def test_stop_sign_is_left_only_from_standstill_in_front_of_it(call: Caller) -> None:
    assert call("detect_stop_sign_ahead") == 300.0
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset()
    call.road.cars[EGO] = replace(call.road.cars[EGO], speed_mps=0.9)
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset()  # a car, not the sign, is in front
    call.road.cars[1] = replace(call.road.cars[1], lane=0)
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset()  # the sign is 300 m away
    call.road.cars[EGO] = replace(call.road.cars[EGO], x_m=391.9)
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset()
    call.road.cars[EGO] = replace(call.road.cars[EGO], x_m=392.1, speed_mps=1.0)
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset()  # rolling
    call.road.cars[EGO] = replace(call.road.cars[EGO], speed_mps=0.9)
    call("recover_from_stop")
    assert call.apis.setpoints.served_stops == frozenset({9})
    assert call("detect_stop_sign_ahead") == -1.0


def test_turns_and_crossing_lanes(call: Caller) -> None:
    for name, turn in (("turn_left", "left"), ("turn_right", "right"), ("go_straight", "straight")):
        call(f"{name}_at_next_intersection")
        assert call.apis.setpoints.turn == turn
    assert call("get_left_to_right_cross_traffic_lanes") == [lane_handle(CROSS[0])]
    lanes = call("get_right_to_left_cross_traffic_lanes")
    assert lanes == [lane_handle(CROSS[1])]
    assert call("is_safe_enter", lanes[0]) is True


def test_autopilot_asks_the_driver_and_moves_nothing(call: Caller) -> None:
    before = dict(call.road.cars)
    call("set_target_speed", 20)
    assert call("autopilot") == [-5.0, 0.0]
    assert call.road.cars == before


def test_say_keeps_words_short_and_printable(call: Caller) -> None:
    call("say", "hello\nworld\x1b[2J")
    call("say", 3.5)
    call("say", None)
    call("say", True)
    assert call.apis.said == ("hello world [2J", "3.5", "None", "True")
    with pytest.raises(BadArgumentValueError, match="at most 500"):
        call("say", "x" * 501)
    with pytest.raises(BadArgumentTypeError, match="must be a text, not a list"):
        call("say", ["x"])
    with pytest.raises(BadArgumentValueError, match="calls itself too deeply"):
        call("say", "<deeply nested>")  # not what the program said, but what the sandbox makes of it
    assert len(call.apis.said) == 4


def test_vehicle_gone(call: Caller) -> None:
    front = call("detect_front_vehicle_in", None)
    del call.road.cars[1]
    with pytest.raises(BadArgumentValueError, match="no longer on the road"):
        call("get_speed_of", front)


def test_a_world_that_fails_is_not_the_programs_fault(call: Caller) -> None:
    class Broken(StraightRoad):
        def lane_of(self, vehicle_id: int) -> LaneId:
            raise KeyError("a table of the world's own")

    ego = call("get_ego_vehicle")
    call.apis.begin_tick(Broken())
    with pytest.raises(KeyError):
        call("get_lane_of", ego)


def test_trace_shows_calls_and_refusals(call: Caller) -> None:
    call("get_speed_of", call("get_ego_vehicle"))
    with pytest.raises(BadArgumentTypeError):
        call("set_target_speed", "fast")
    with pytest.raises(BadArgumentTypeError):
        call("get_speed_of")
    calls = call.apis.calls
    assert [(c.name, c.args, c.result) for c in calls[:2]] == [
        ("get_ego_vehicle", "", "veh:0"),
        ("get_speed_of", "veh:0", "25"),
    ]
    assert calls[2].result.startswith("refused: set_target_speed(target_speed) must be a number in m/s")
    assert calls[3].result == "refused: get_speed_of needs 'veh'"
    call.apis.begin_tick(call.road)
    assert call.apis.calls == ()


_VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=20)
    | st.sampled_from(["veh:0", "veh:1"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=2),
    max_leaves=6,
)


@given(
    st.sampled_from(sorted(APIS)),
    st.lists(_VALUES, max_size=3),
    st.dictionaries(st.text(max_size=8), _VALUES, max_size=2),
)
def test_any_call_answers_or_is_refused_in_words(name: str, args: list[Any], kwargs: dict[str, Any]) -> None:
    road = StraightRoad()
    apis = DrivingApis(road, road, starting_setpoints(road))
    try:
        apis.call(name, args, kwargs)
    except (BadArgumentTypeError, BadArgumentValueError) as error:
        assert 5 < len(str(error)) < 300
    speed = apis.setpoints.target_speed_mps
    assert speed is not None
    assert 0 <= speed <= 1000
    assert 0.01 <= apis.setpoints.time_headway_s <= 2.0
    assert len(apis.calls) == 1


def test_handles_are_only_what_was_given() -> None:
    table = HandleTable()
    table.give_vehicle(3)
    assert table.vehicle("veh:3", "x") == 3
    for forged in ("veh:4", "veh:03", "veh:3 "):
        with pytest.raises(BadArgumentValueError, match="was given"):
            table.vehicle(forged, "x")
    for wrong in (3, None, "3", ["veh:3"], 3.0, "lane:a-b:0"):
        with pytest.raises(BadArgumentTypeError):
            table.vehicle(wrong, "x")


@given(
    st.tuples(st.text(":%ab"), st.text(":%ab"), st.integers(0, 3)),
    st.tuples(st.text(":%ab"), st.text(":%ab"), st.integers(0, 3)),
)
def test_no_two_lanes_share_a_handle(one: LaneId, other: LaneId) -> None:
    assert (lane_handle(one) == lane_handle(other)) == (one == other)


def test_values_are_described_briefly_whatever_their_size() -> None:
    shared: list[Any] = [0]
    for _ in range(60):
        shared = [shared] * 10
    for value in (shared, "x" * 10**6, 10**10_000, float("nan"), True, {"a": shared}, len):
        assert len(describe(value)) < 60
