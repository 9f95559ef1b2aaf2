"""C in words and as values, for every branch an observation can take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from chauffeur.concept import Lead, Observation, ScenarioError, VehicleState
from chauffeur.describe import describe, describe_with_traffic
from chauffeur.describe.road import ordinal
from chauffeur.geometry import LaneId

Make = Callable[..., Observation]


def test_highway_in_words_and_values(highway: Make) -> None:
    context = describe(highway(lanes=4, index=1, front=Lead(3, 42.54, 28.06)))
    assert context.text == (
        "I am driving at 31.3 m/s. I am on a highway with 4 lanes in my direction, in the third lane from the right. "
        "The speed limit of my lane is 31.3 m/s. "
        "The car ahead of me in my lane is 42.5 m away and drives at 28.1 m/s."
    )
    situation = context.situation
    assert (situation.world, situation.lane_count, situation.lane_index) == ("highway", 4, 1)
    assert situation.speed_mps == 31.26
    assert situation.speed_limit_mps == 31.2928
    assert situation.front == Lead(3, 42.54, 28.06)
    assert (situation.emergency_lane, situation.stop_sign_m, situation.turns) == (False, None, ())


@pytest.mark.parametrize(("index", "word"), [(0, "fifth"), (3, "second"), (4, "first")])
def test_the_emergency_lane_counts_from_the_right(highway: Make, index: int, word: str) -> None:
    context = describe(highway(lanes=5, index=index, emergency=True))
    assert f"in the {word} lane from the right. The right-most lane is an emergency lane." in context.text
    assert context.situation.emergency_lane
    assert context.situation.lane_count == 5


@pytest.mark.parametrize(("distance", "seen"), [(99.99, True), (100.0, True), (100.01, False)])
def test_sight_ends_at_100_m(highway: Make, distance: float, seen: bool) -> None:
    context = describe(highway(front=Lead(1, distance, 20.0)))
    assert (context.situation.front is not None) is seen
    assert ("no car ahead of me in my lane within 100 m" in context.text) is not seen


def test_a_single_lane_is_said_in_the_singular(highway: Make) -> None:
    assert "with 1 lane in my direction, in the first lane" in describe(highway(lanes=1, index=0)).text


def test_lanes_of_other_segments_and_directions_do_not_count(highway: Make) -> None:
    assert describe(highway(lanes=2, index=0)).situation.lane_count == 2


def test_intersection_in_words_and_values(crossing: Make) -> None:
    context = describe(crossing())
    assert context.text == (
        "I am driving at 10.0 m/s. I am coming to an intersection on a two-way road with one lane per direction. "
        "A stop sign stands 85 m ahead of me; the autopilot stops there by itself. I may recover from the stop only "
        "once my speed is below 1 m/s and only when crossing is safe. At the intersection I may turn left, go straight "
        "or turn right; the route has to be chosen before I get there. The speed limit of my lane is 10.0 m/s. "
        "There is no car ahead of me in my lane within 100 m."
    )
    assert context.situation.turns == ("left", "straight", "right")
    assert context.situation.stop_sign_m == 85.0


def test_inside_and_past_the_junction_there_is_no_choice_left(crossing: Make) -> None:
    for lane_id in ("ir0-il1:0", "il1-o1:0"):
        context = describe(crossing(on=lane_id, stop_sign=None))
        assert context.situation.turns == ()
        assert "I am at an intersection" in context.text
        assert "stop sign" not in context.text
        assert "I may" not in context.text


def test_turns_follow_the_geometry_of_the_lanes(crossing: Make) -> None:
    lanes = crossing().road.lanes
    no_left = tuple(lane for lane in lanes if lane.id != "ir0-il1:0")
    context = describe(crossing(lanes=no_left))
    assert context.situation.turns == ("straight", "right")
    assert "I may go straight or turn right;" in context.text


def test_unknown_world_kind_is_refused_in_words(crossing: Make) -> None:
    with pytest.raises(ScenarioError, match=r"'moon'.*Known kinds: highway, intersection"):
        describe(crossing(kind="moon"))


@pytest.mark.parametrize("lane_id", [None, "x-y:0"])
def test_an_ego_off_every_lane_is_refused_in_words(crossing: Make, lane_id: LaneId | None) -> None:
    with pytest.raises(ScenarioError, match="not among the 6 lanes"):
        describe(crossing(on=lane_id))


def test_ordinals() -> None:
    assert [ordinal(n) for n in (1, 10, 11, 12, 13, 21, 22, 23, 24, 111)] == [
        "first", "tenth", "11th", "12th", "13th", "21st", "22nd", "23rd", "24th", "111th",
    ]  # fmt: skip


def _car(number: int, x_m: float, index: int, speed_mps: float, heading_rad: float = 0.0) -> VehicleState:
    return VehicleState(number, "car", x_m, 4.0 * (1 - index), heading_rad, speed_mps, 5.0, 2.0, f"c-d:{index}")


def test_the_traffic_behind_and_beside_is_told_for_a_drive_and_not_for_the_benchmark(highway: Make) -> None:
    cars = (
        _car(1, -30.0, 1, 33.0), _car(2, -60.0, 1, 20.0), _car(3, 40.0, 1, 20.0),
        _car(4, 12.34, 0, 24.06), _car(5, -20.0, 0, 28.0), _car(6, 2.0, 2, 25.0), _car(7, 130.0, 0, 9.0),
    )  # fmt: skip
    observation = replace(highway(lanes=4, index=1), others=cars)
    text = describe_with_traffic(observation).text
    assert text == (
        f"{describe(observation).text} The car behind me in my lane is 30.0 m away and drives at 33.0 m/s. "
        "In the lane on my left the nearest cars are 12.3 m ahead at 24.1 m/s and 20.0 m behind at 28.0 m/s. "
        "In the lane on my right a car is right beside me and drives at 25.0 m/s."
    )
    assert describe_with_traffic(observation).situation == describe(observation).situation


def test_empty_lanes_lanes_that_are_not_there_and_the_shoulder_are_told(highway: Make) -> None:
    text = describe_with_traffic(highway(lanes=2, index=0, emergency=True)).text
    assert "no car behind me in my lane within 100 m. There is no lane on my left." in text
    assert text.endswith("On my right is the emergency lane.")
    assert describe_with_traffic(highway(lanes=2, index=1)).text.endswith(
        "The lane on my left is free of cars for 100 m ahead and behind. There is no lane on my right."
    )


def test_a_car_on_another_segment_is_placed_beside_the_ego_and_oncoming_ones_are_left_out(highway: Make) -> None:
    elsewhere = replace(_car(1, -50.0, 0, 30.0), lane="b-c:0")
    oncoming = _car(2, -20.0, 0, 30.0, heading_rad=3.14159)
    text = describe_with_traffic(replace(highway(lanes=4, index=1), others=(elsewhere, oncoming))).text
    assert "In the lane on my left the nearest car is 50.0 m behind at 30.0 m/s." in text
