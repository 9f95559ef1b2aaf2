"""Leaderboard 1.0's rules on drives whose outcome can be worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.leaderboard_drives import car, judged, seen, street, track
from chauffeur.bench.leaderboard.criteria import Blocked, Collisions, RouteReferee, timeout_s
from chauffeur.concept import Sign, Signal

ROAD = street()
WAY = track()


def drive(speed: float = 10.0, start: float = 0.0, end: float = 401.0, step: float = 0.05, y: float = 0.0):
    """Times and positions of a constant drive."""
    count = int((end - start) / (speed * step)) + 1
    return [(i * step, start + i * speed * step, y) for i in range(count)]


def red(at_x: float = 200.0, lane: str = "east", state: str = "red") -> Signal:
    return Signal("tl1", state, (lane,), ((at_x, 1.75), (at_x, -1.75)))  # type: ignore[arg-type]


def test_a_clean_drive_completes_the_route_without_a_word() -> None:
    referee, found = judged(WAY, (seen(t, car(0, x, y), road=ROAD) for t, x, y in drive()))
    assert referee.completion.completed
    assert referee.completion.share == 1.0
    assert found == []


def test_a_route_given_up_half_way_counts_what_was_passed() -> None:
    referee, _ = judged(WAY, (seen(t, car(0, x, y), road=ROAD) for t, x, y in drive(end=200.6)))
    assert not referee.completion.completed
    assert referee.completion.share == pytest.approx(0.5)


def test_ninety_nine_per_cent_far_from_the_goal_is_not_complete() -> None:
    aside = [seen(t, car(0, x, 12.0)) for t, x, _ in drive()]
    referee, found = judged(WAY, aside)
    assert not referee.completion.completed
    assert referee.completion.share > 0.99
    assert [one.kind for one in found] == ["outside_route_lanes"]


@pytest.mark.parametrize(("away", "share"), [(29.0, None), (31.0, 0.0)])
def test_thirty_metres_away_is_off_the_route(away: float, share: float | None) -> None:
    referee, found = judged(WAY, (seen(t, car(0, x, -away)) for t, x, _ in drive(end=100.0)))
    kinds = [one.kind for one in found if one.kind != "outside_route_lanes"]
    assert kinds == (["route_dev"] if share is not None else [])
    assert referee.done == (share is not None)


def test_thirty_per_cent_of_the_route_driven_twenty_metres_away_is_off_the_route() -> None:
    _, found = judged(WAY, (seen(t, car(0, x, -20.0)) for t, x, _ in drive()))
    assert [one.kind for one in found] == ["route_dev", "outside_route_lanes"]
    assert found[0].x_m == pytest.approx(0.3 * 400.0, abs=6.0)


def test_standing_for_three_minutes_is_blocked_and_moving_starts_anew() -> None:
    blocked = Blocked()
    assert not blocked.update(seen(0.0, car(0, 0.0, speed=0.0)))
    assert not blocked.update(seen(179.0, car(0, 0.0, speed=0.0)))
    assert not blocked.update(seen(179.5, car(0, 0.0, speed=0.2)))
    assert not blocked.update(seen(359.0, car(0, 0.0, speed=0.0)))
    assert [one.kind for one in blocked.update(seen(359.6, car(0, 0.0, speed=0.0)))] == ["vehicle_blocked"]
    assert not blocked.update(seen(600.0, car(0, 0.0, speed=0.0)))


def test_a_slow_route_times_out() -> None:
    assert timeout_s(1000.3) == 805
    referee, found = judged(WAY, (seen(t, car(0, 1.0 + t / 100.0)) for t in range(0, 400, 5)))
    assert [one.kind for one in found] == ["route_timeout"]
    assert found[0].time_s > referee.limit_s == 325
    assert found[0].time_s - 5 <= referee.limit_s


def test_a_collision_is_told_once_and_by_kind() -> None:
    walker = car(7, 100.0, kind="pedestrian")
    _, found = judged(WAY, (seen(t, car(0, x), [walker], road=ROAD) for t, x, _ in drive()))
    assert [(one.kind, one.other) for one in found] == [("collisions_pedestrian", "7")]
    assert "id=7" in found[0].message


def test_the_same_road_user_counts_again_after_five_seconds_at_another_place() -> None:
    rules = Collisions()
    hits: list[float] = []
    for i in range(200):  # pushes a car along at 2 m/s for 10 s
        t = i * 0.05
        if rules.update(seen(t, car(0, 2.0 * t), [car(3, 2.0 * t + 4.0)])):
            hits.append(t)
    assert hits[0] == 0.0
    assert len(hits) == 2
    assert hits[1] == pytest.approx(5.05)


def test_a_second_car_within_three_metres_of_a_collision_is_not_counted() -> None:
    rules = Collisions()
    assert len(rules.update(seen(0.0, car(0, 0.0), [car(3, 4.0)]))) == 1
    assert not rules.update(seen(0.1, car(0, 1.0), [car(4, 5.0)]))
    assert len(rules.update(seen(0.4, car(0, 3.5), [car(4, 7.0)]))) == 1


def test_running_a_red_light_counts_once_however_long_the_tail_stays_on_the_line() -> None:
    slow = drive(speed=0.7, start=190.0, end=250.0)
    _, found = judged(track(400, 190), (seen(t, car(0, x), signals=[red()], road=ROAD) for t, x, _ in slow))
    assert [(one.kind, one.other) for one in found] == [("red_light", "tl1")]


def test_two_lights_on_one_line_count_once_each() -> None:
    """The original remembers only one light and counts them in turns for ever."""
    second = replace(red(), id="tl2")
    still = [seen(t * 0.05, car(0, 203.0, speed=0.0), signals=[red(), second], road=ROAD) for t in range(400)]
    _, found = judged(track(400, 200), still)
    assert [one.other for one in found] == ["tl1", "tl2"]


@pytest.mark.parametrize("light", [*(red(state=one) for one in ("green", "yellow", "off")), red(lane="west")])
def test_a_light_that_is_not_red_or_of_another_lane_may_be_passed(light: Signal) -> None:
    _, found = judged(WAY, (seen(t, car(0, x), signals=[light], road=ROAD) for t, x, _ in drive()))
    assert found == []


def stop_sign() -> Sign:
    return Sign("s1", "stop", ("east",), 398.0, -3.0, ((398.0, 1.75), (398.0, -1.75)))


def stop_drive(least: float):
    """Up to the stop line, down to a speed there, and on."""
    t, x = 0.0, 340.0
    instants = []
    while x < 419.0:
        speed = least if 394.0 < x < 394.2 else 6.0
        instants.append(seen(t, car(0, x, speed=speed), signs=[stop_sign()], road=ROAD))
        x += 0.1
        t += 0.1 / max(speed, 0.05)
    return instants


TWIN = replace(stop_sign(), id="s2", x_m=398.6, stop_line_m=((398.6, 1.75), (398.6, -1.75)))


@pytest.mark.parametrize("signs", [(stop_sign(),), (TWIN, stop_sign())])
@pytest.mark.parametrize(("least", "kinds"), [(0.05, []), (0.5, ["stop_infraction"]), (6.0, ["stop_infraction"])])
def test_a_stop_sign_wants_a_full_stop_and_two_at_one_line_no_more(
    signs: tuple[Sign, ...], least: float, kinds: list[str]
) -> None:
    _, found = judged(track(430, 340), [replace(one, signs=signs) for one in stop_drive(least)])
    assert [one.kind for one in found] == kinds


def test_driving_in_the_oncoming_lane_costs_its_share() -> None:
    instants = [seen(t, car(0, x, 3.5 if 100.0 <= x < 200.0 else 0.0), road=ROAD) for t, x, _ in drive()]
    referee, found = judged(WAY, instants)
    assert [one.kind for one in found] == ["outside_route_lanes"]
    assert found[0].share == pytest.approx(0.25, abs=0.01)
    assert referee.completion.completed


def test_beside_the_road_begins_1_3_m_outside_the_lane() -> None:
    inside = [seen(t, car(0, x, -3.0), road=ROAD) for t, x, _ in drive()]
    outside = [seen(t, car(0, x, -3.1), road=ROAD) for t, x, _ in drive()]
    assert judged(WAY, inside)[1] == []
    (one,) = judged(WAY, outside)[1]
    assert one.share == pytest.approx(1.0)


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.floats(-3.0, 6.0), st.floats(-40.0, 40.0)), min_size=1, max_size=60))
def test_progress_never_goes_back_and_stays_within_the_route(moves: list[tuple[float, float]]) -> None:
    referee = RouteReferee(WAY)
    x, shares = 0.0, []
    for tick, (dx, y) in enumerate(moves):
        x += dx
        referee.update(seen(tick * 0.05, car(0, x, y), road=ROAD))
        shares.append(referee.completion.share)
    assert shares == sorted(shares)
    assert shares[0] >= 0.0
    assert shares[-1] <= 1.0
    assert sum(one.kind == "route_dev" for one in referee.infractions) <= 1


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 3), st.floats(-1.0, 2.0)), min_size=1, max_size=80))
def test_collisions_lie_apart_in_place_and_the_same_one_in_time(touches: list[tuple[int, float]]) -> None:
    rules = Collisions()
    x, found = 0.0, []
    for tick, (other, dx) in enumerate(touches):
        x += dx
        found += rules.update(seen(tick * 0.5, car(0, x), [car(other, x + 1.0)]))
    for one, two in pairwise(found):
        assert math.dist((one.x_m, one.y_m), (two.x_m, two.y_m)) > 3.0
        assert one.other != two.other or two.time_s - one.time_s > 5.0
