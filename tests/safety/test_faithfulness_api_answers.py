"""What the driving APIs are taken to answer when a program is read, name by name."""

from __future__ import annotations

import pytest

from chauffeur.programs import APIS
from chauffeur.safety.faithfulness.evaluator import answer
from chauffeur.safety.faithfulness.values import NOTHING, Base, LaneValue, Term, TracedValue

HERE = frozenset({0, 1})
"""The car may have moved one lane to the right since the start."""
EGO = TracedValue(vehicle="ego")
FRONT, REAR = (
    TracedValue(vehicle="front", tags=frozenset({"front"})),
    TracedValue(vehicle="rear", tags=frozenset({"rear"})),
)
FAR_LEFT = frozenset({LaneValue(-2, frozenset({0}))})
LANE = TracedValue(lanes=FAR_LEFT, tags=frozenset({"told"}))
FROM_LEFT = TracedValue(crossing="left")


def lane(offset: int) -> frozenset[LaneValue]:
    return frozenset({LaneValue(offset, HERE)})


def measured(base: Base, *tags: str) -> TracedValue:
    return TracedValue(frozenset({Term(base, 1.0, 0.0)}), frozenset(tags))


def tagged(*tags: str) -> TracedValue:
    return TracedValue(tags=frozenset(tags))


@pytest.mark.parametrize(
    ("name", "asked", "answered"),
    [
        ("get_ego_vehicle", [], EGO),
        ("get_left_lane", [EGO], TracedValue(lanes=lane(-1))),
        ("get_right_lane", [EGO], TracedValue(lanes=lane(1))),
        ("get_left_lane", [], TracedValue(lanes=lane(-1))),
        ("get_right_lane", [NOTHING], TracedValue(lanes=lane(1))),
        ("get_left_lane", [FRONT], tagged("front")),
        ("get_lane_of", [EGO], TracedValue(lanes=lane(0))),
        ("get_lane_of", [], TracedValue(lanes=lane(0))),
        ("get_lane_of", [TracedValue(vehicle="front", tags=frozenset({"front"}), lanes=FAR_LEFT)],
         TracedValue(lanes=FAR_LEFT, tags=frozenset({"front"}))),
        ("get_left_to_right_cross_traffic_lanes", [], TracedValue(crossing="left")),
        ("get_right_to_left_cross_traffic_lanes", [], TracedValue(crossing="right")),
        ("is_safe_enter", [LANE], tagged("safe:-2")),
        ("is_safe_enter", [TracedValue(lanes=lane(1) | lane(-1))], tagged("safe:1", "safe:-1")),
        ("is_safe_enter", [FROM_LEFT], tagged("safe:cross", "safe:cross:left")),
        ("is_safe_enter", [], tagged("safe:?")),
        ("detect_front_vehicle_in", [LANE], TracedValue(lanes=FAR_LEFT, vehicle="front", tags=frozenset({"front"}))),
        ("detect_rear_vehicle_in", [LANE], TracedValue(lanes=FAR_LEFT, vehicle="rear", tags=frozenset({"rear"}))),
        ("detect_front_vehicle_in", [], TracedValue(lanes=lane(0), vehicle="front", tags=frozenset({"front"}))),
        ("detect_rear_vehicle_in", [FROM_LEFT], TracedValue(vehicle="rear", tags=frozenset({"rear"}))),
        ("get_speed_of", [EGO], measured("ego", "speed")),
        ("get_speed_of", [FRONT], measured("other", "other speed")),
        ("get_speed_of", [], measured("other", "other speed")),
        ("get_distance_between_vehicles", [FRONT, EGO], measured("gap", "gap")),
        ("get_distance_between_vehicles", [NOTHING, EGO], measured("gap", "gap")),
        ("get_distance_between_vehicles", [EGO, FRONT], measured("past", "past")),
        ("get_distance_between_vehicles", [EGO, NOTHING], measured("past", "past")),
        ("get_distance_between_vehicles", [EGO, REAR], measured("behind", "behind")),
        ("get_distance_between_vehicles", [REAR, EGO], NOTHING),
        ("get_distance_between_vehicles", [EGO, EGO], NOTHING),
        ("get_distance_between_vehicles", [FRONT, REAR], NOTHING),
        ("get_distance_between_vehicles", [NOTHING, NOTHING], NOTHING),
        ("detect_stop_sign_ahead", [], measured("sign", "sign")),
        ("get_speed_limit", [], measured("limit", "limit")),
        ("get_target_speed", [], measured("ego", "speed")),
        ("get_desired_time_headway", [], measured("headway", "headway")),
        ("get_something_else", [EGO], NOTHING),
    ],
)  # fmt: skip
def test_what_an_api_answers(name: str, asked: list[TracedValue], answered: TracedValue) -> None:
    assert answer(name, asked, HERE) == answered


def test_every_api_that_only_asks_is_answered() -> None:
    """A new one has to be given an answer of its own: what is not known is taken for nothing."""
    for api in APIS.values():
        if api.effect == "read" and api.name != "autopilot":
            assert answer(api.name, [EGO, FRONT], HERE) != NOTHING, api.name
