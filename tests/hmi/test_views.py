"""Road markings, events, framing and words: what page and filmstrip both rely on."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from sample_trips import OVERTAKE, guarded, highway_trip, intersection_trip

from chauffeur.concept import Causes, Command, Feedback, Lane, Metric, Parameters, RoadGraph, Trajectory
from chauffeur.hmi import words
from chauffeur.hmi.events import events_of
from chauffeur.hmi.interventions import stretches_of
from chauffeur.hmi.payload import policy_words, program_tokens
from chauffeur.hmi.road import Bounds, draw_road
from chauffeur.hmi.view import facing_right, frame_drive, instants_of
from roads import a_lane, a_road

EVERYWHERE = Bounds(-500, -500, 500, 500)


def straight(index: int, *, emergency: bool = False, road: str = "a-b") -> Lane:
    centre = ((0.0, 4.0 * index), (200.0, 4.0 * index))
    return a_lane(f"{road}:{index}", centre, closed=emergency, emergency=emergency)


def test_lines_of_a_highway() -> None:
    road = draw_road(a_road((straight(0), straight(1), straight(2, emergency=True))), (), EVERYWHERE)
    assert sorted((line.points_m[0][1], line.style) for line in road.lines) == [
        (-2.0, "solid"),
        (2.0, "dashed"),
        (6.0, "solid"),
        (10.0, "solid"),
    ]


def test_opposite_lanes_share_one_centre_line() -> None:
    there = a_lane("a-b:0", ((0.0, 2.0), (100.0, 2.0)), limit=10.0)
    back = a_lane("b-a:0", ((100.0, -2.0), (0.0, -2.0)), limit=10.0)
    styles = sorted(line.style for line in draw_road(a_road((there, back)), (), EVERYWHERE).lines)
    assert styles == ["centre", "solid", "solid"]


def test_the_inside_of_an_intersection_is_clear() -> None:
    (shot,) = facing_right((intersection_trip().frames[0].observation,))
    road = draw_road(shot.road, shot.objects, EVERYWHERE)
    inside = [p for line in road.lines for p in line.points_m if max(abs(p[0]), abs(p[1])) < 3.9]
    assert not inside
    sign = road.signs[0]
    assert sign.line_m is not None and sign.post_m[1] > 4.0, "the post stands to the right of the lane, beside the road"
    assert math.dist(*sign.line_m) == pytest.approx(3.6)


def test_a_crosswalk_is_painted_as_bars_across_the_way_of_those_who_cross() -> None:
    over = replace(a_lane("over:0", ((50.0, -6.0), (50.0, 6.0)), width=3.0), kind="crossing")
    road = draw_road(a_road((straight(0), over)), (), EVERYWHERE)
    assert len(road.bars_m) == 12
    assert len(road.surfaces) == 1, "people's way is no asphalt"
    assert all(math.dist(*bar) == pytest.approx(3.0) for bar in road.bars_m)
    assert sorted(bar[0][1] for bar in road.bars_m) == pytest.approx([-5.5 + i for i in range(12)])
    assert not draw_road(a_road((straight(0), over)), (), Bounds(100, -10, 180, 10)).bars_m


def test_gaps_between_the_lanes_of_a_junction_are_paved_and_a_green_middle_is_not() -> None:
    def triangle(side_m: float) -> RoadGraph:
        corners = ((0.0, 0.0), (side_m, 0.0), (side_m / 2.0, side_m * 0.866))
        ends = zip(corners, (*corners[1:], corners[0]), strict=True)
        return a_road(replace(a_lane(f"j-{i}:0", pair), junction="j") for i, pair in enumerate(ends))

    small = draw_road(triangle(18.0), (), EVERYWHERE)
    (island,) = small.islands_m
    assert all(-1.0 < x < 19.0 and -1.0 < y < 17.0 for x, y in island)
    assert not draw_road(triangle(80.0), (), EVERYWHERE).islands_m


def test_bays_back_to_back_leave_no_wedges_and_reach_under_their_aisle() -> None:
    def bay(x: float, side: float) -> Lane:
        middle = (x, side * 4.0)
        end = (x + 2.9, side * 9.0)
        return replace(a_lane(f"{x}-{side}:0", (middle, end), width=2.5), kind="parking")

    aisle = replace(a_lane("aisle:0", ((-20.0, 0.0), (40.0, 0.0)), width=6.0), kind="aisle")
    road = draw_road(a_road((aisle, *(bay(3.0 * i, -1.0) for i in range(6)))), (), EVERYWHERE)
    assert [surface.kind for surface in road.surfaces][-1] == "aisle", "it is painted over the ends of its bays"
    assert all(max(y for _, y in s.centre_m) > -3.0 for s in road.surfaces if s.kind == "parking")


def test_a_streets_name_stands_on_it_once_in_a_while() -> None:
    street = replace(a_lane("a-b:0", ((0.0, 0.0), (200.0, 0.0))), street="Park Road")
    back = replace(a_lane("b-a:0", ((200.0, -4.0), (0.0, -4.0))), street="Park Road")
    (name,) = draw_road(a_road((street, back)), (), EVERYWHERE).names
    assert name.text == "Park Road" and name.x_m == pytest.approx(100.0, abs=1.0)


def test_a_stretch_of_road_out_of_sight_is_left_out() -> None:
    road = draw_road(a_road((straight(0),)), (), Bounds(50, -10, 80, 10))
    xs = [x for surface in road.surfaces for x, _ in surface.centre_m]
    assert min(xs) >= 49, "surfaces lap over each other by less than a metre"
    assert max(xs) <= 81


def test_events_of_a_highway_drive() -> None:
    kinds = [event.kind for event in events_of(highway_trip())]
    assert kinds == ["said", "lane_change", "finished", "said"]


def test_what_the_shield_did_is_told_in_stretches() -> None:
    trip = guarded(highway_trip(seconds=10.0))
    lane, gap, later = stretches_of(trip.frames)
    assert [(s.rule, round(s.start_s, 1), round(s.end_s, 1), s.changes) for s in (lane, gap, later)] == [
        ("lane", 5.0, 6.0, 10),
        ("gap", 5.2, 5.3, 1),
        ("gap", 9.0, 9.4, 4),
    ]
    assert later.after.acceleration_mps2 == pytest.approx(-1.93), "the greatest change of the stretch"
    labels = [event.label for event in events_of(trip) if event.kind == "shield"]
    assert len(labels) == 3
    assert labels[0] == "Shield, 1.0 s: lane not free. The lane is not free: a car is beside."
    assert labels[2].endswith("Too close to the car 9 m ahead to ask for more.")


def test_a_pause_ends_a_stretch_only_if_it_is_long() -> None:
    frames = guarded(highway_trip(seconds=10.0)).frames
    short = tuple(replace(f, interventions=()) if 5.35 < f.observation.time_s < 5.65 else f for f in frames)
    assert [s.changes for s in stretches_of(short)] == [7, 1, 4]
    assert stretches_of(highway_trip(seconds=1.0).frames) == ()


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (Command(1.5, 0.0), Command(-3.2, 0.0), "+1.5 → −3.2 m/s²"),
        (Command(0.01, 0.1), Command(-0.01, 0.1), "0.0 → 0.0 m/s²"),
        (Command(1.0, -0.05), Command(1.0, 0.01), "steering 2.9° right → 0.6° left"),
        (Command(1.0, -0.05), Command(-8.0, 0.0), "steering 2.9° right → 0.0°, +1.0 → −8.0 m/s²"),
    ],
)
def test_a_changed_command_in_words(before: Command, after: Command, told: str) -> None:
    assert words.change_words(before, after) == told


def test_the_next_stretch_of_road_is_no_lane_change() -> None:
    trip = highway_trip(seconds=1.0)
    last = trip.frames[-1].observation
    final = replace(last, ego=replace(last.ego, lane="b-c:2"))
    assert [e.kind for e in events_of(replace(trip, final=final))] == [e.kind for e in events_of(trip)]


def test_a_collision_shows_though_it_comes_after_the_last_command() -> None:
    trip = highway_trip(seconds=1.0)
    last = trip.frames[-1].observation
    final = replace(last, time_s=1.0, off_road=True, ego=replace(last.ego, crashed=True))
    assert [e.kind for e in events_of(replace(trip, final=final))][-2:] == ["collision", "off_road"]


def test_a_stop_is_marked_once() -> None:
    assert [e.kind for e in events_of(intersection_trip())].count("stopped") == 1


def test_the_car_sets_off_to_the_right() -> None:
    shots = facing_right(instants_of(intersection_trip()))
    assert shots[0].ego.heading_rad == pytest.approx(0.0)
    assert shots[20].ego.x_m > shots[0].ego.x_m
    assert shots[-1].ego.y_m < shots[0].ego.y_m, "a left turn goes up"
    assert not frame_drive(shots).along


def test_a_highway_is_looked_at_as_it_is() -> None:
    instants = instants_of(highway_trip(seconds=1.0))
    shots = facing_right(instants)
    assert [(one.ego.x_m, one.ego.y_m) for one in shots] == [(one.ego.x_m, -one.ego.y_m) for one in instants]
    camera = frame_drive(shots)
    assert camera.along
    assert (camera.box.y0, camera.box.y1) == (-2.0, 14.0)


def test_tokens_give_back_the_program_line_by_line() -> None:
    for source in (OVERTAKE, "\n\nx = 1", "def (", "", "'''open", "\tif a:\r\n\t\tb()"):
        lines = program_tokens(source)
        joined = ["".join(text for _, text in line) for line in lines]
        assert joined == source.replace("\r\n", "\n").split("\n")
    kinds = {text: kind for line in program_tokens(OVERTAKE) for kind, text in line}
    assert (kinds["while"], kinds["is_safe_enter"], kinds["overtake_left"], kinds["left"]) == ("k", "a", "d", "")


def test_numbers_carry_their_units() -> None:
    assert words.speed(28.0) == "28.0 m/s (101 km/h)"
    assert words.setting("target_speed_mps", 28.0) == ("target speed", "28.0 m/s (101 km/h)")
    assert words.setting("time_headway_s", 1.5) == ("time headway", "1.5 s")
    assert words.setting("gap_m", 30.0) == ("gap", "30 m")
    assert words.setting("lanes", 2) == ("lanes", "2")
    assert words.metric_value(Metric("x-v1", math.nan, "points", False)) == "does not apply"
    assert words.metric_value(Metric("x-v1", 10.0, "m/s")) == "10.0 m/s (36 km/h)"
    assert words.metric_name("lampilot-time-efficiency-v1") == "Time-efficiency score"
    assert words.metric_name("stop-compliance-v2") == "Stop compliance"
    assert "10.0 m/s (36 km/h)" in policy_words(Parameters(10.0, 5.0, 0.5))
    long = Trajectory(tuple((0.8 * (i + 1), -0.5 * max(0, i - 10)) for i in range(25)), 0.5)
    told = policy_words(long).splitlines()
    assert told[0] == "25 waypoints in 12.5 s; of them"
    assert told[-1] == "12.5 s: 20.0 m ahead, 7.0 m to the right"
    assert len(told) < 10
    assert "way: stadium" in policy_words(Parameters(3.0, 4.0, 1.0, route="stadium")), "what is shown is what is driven"


def test_causes_and_feedback_in_words() -> None:
    assert words.cause_words(Causes()) == ()
    assert len(words.cause_words(Causes(policy_failed=True, fallback_used=True, detail="line 3"))) == 3
    assert words.feedback_words(Feedback("", speed=1, gap=-1)) == "wants it faster, wants a larger gap"
    assert words.feedback_words(Feedback("")) == "no change wanted"
