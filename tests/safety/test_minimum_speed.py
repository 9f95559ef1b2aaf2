"""`minimum-speed-v1`: nobody crawls or stands in a lane of a highway because of words, whatever kind the policy is."""

from __future__ import annotations

from dataclasses import replace

import pytest
from check_scenes import plan, snap
from golden_sentences import compare, row

from chauffeur.concept import Lead, Limits, Parameters, Plan, Program, Thoughts
from chauffeur.geometry import RoadGraph
from chauffeur.safety.bounds import LEAST_MPS, least_speed_mps
from chauffeur.safety.minimum_speed import check_minimum_speed

LIMITS = Limits()
CONSTANT = "def go():\n    set_target_speed({speed})\n    while True:\n        yield autopilot()\n"
WORKED_OUT = """def go():
    speed = 40.0
    for _ in range(9):
        speed = speed * 0.5
    set_target_speed({speed} + 0.0 * speed)
    yield autopilot()
"""
PULL_OVER = """def pull_over():
    ego = get_ego_vehicle()
    right = get_right_lane(ego)
    while right is not None:
        while not is_safe_enter(right):
            yield autopilot()
        set_target_lane(right)
        while get_lane_of(ego) != right:
            yield autopilot()
        right = get_right_lane(ego)
    set_target_speed(0.0)
    yield autopilot()
"""


def plans(speed: float) -> list[Plan]:
    return [
        Plan(Thoughts(""), Program(CONSTANT.format(speed=speed))),
        Plan(Thoughts(""), Program(WORKED_OUT.format(speed=speed))),
        Plan(Thoughts(""), Program("def go():\n    yield autopilot()\n"), settings=(("target_speed_mps", speed),)),
        Plan(Thoughts(""), Parameters(speed, 10.0, 1.0)),
    ]


@pytest.mark.parametrize("speed", [0.0, 1.7, 8.33, 16.0])
def test_a_crawl_is_refused_with_what_to_say_instead(speed: float) -> None:
    for one in plans(speed):
        assert check_minimum_speed(one, snap(), LIMITS).stops, one


@pytest.mark.parametrize("speed", [LEAST_MPS, 16.67, 25.0, 31.0])
def test_what_is_no_crawl_passes(speed: float) -> None:
    assert all(check_minimum_speed(one, snap(), LIMITS).passed for one in plans(speed))


def test_a_queue_is_followed_at_its_own_speed() -> None:
    slow = replace(snap(), front=Lead(1, 40.0, 3.0))
    assert least_speed_mps(slow) == 3.0
    assert all(check_minimum_speed(one, slow, LIMITS).passed for one in plans(4.0))
    assert all(check_minimum_speed(one, slow, LIMITS).stops for one in plans(1.0))
    far = replace(snap(), front=Lead(1, 400.0, 3.0))
    assert least_speed_mps(far) == pytest.approx(LEAST_MPS)


def test_a_persons_own_cap_is_no_crawl() -> None:
    assert least_speed_mps(snap(), Limits(max_speed_mps=10.0)) == 10.0


def test_it_holds_on_highways_alone() -> None:
    crossing = snap(kind="intersection")
    assert least_speed_mps(crossing) is None
    assert all(check_minimum_speed(one, crossing, LIMITS).passed for one in plans(0.0))


def test_only_what_makes_for_a_shoulder_may_stand_there() -> None:
    here = snap()
    pull_over = Plan(Thoughts(""), Program(PULL_OVER), intent="pull_over", settings=(("target_speed_mps", 0.0),))
    assert check_minimum_speed(pull_over, here, LIMITS).stops
    *others, last = here.road.lanes
    shoulder = replace(here, road=RoadGraph((*others, replace(last, kind="emergency"))))
    assert check_minimum_speed(pull_over, shoulder, LIMITS).passed
    on_it = replace(shoulder, ego=replace(shoulder.ego, lane=last.id))
    assert least_speed_mps(on_it) is None
    assert all(check_minimum_speed(one, shoulder, LIMITS).stops for one in plans(0.0))
    found = {
        "a crawl": check_minimum_speed(plans(8.33)[0], here, LIMITS),
        "a crawl, by parameters": check_minimum_speed(plans(8.33)[3], here, LIMITS),
        "a stand beside a shoulder": check_minimum_speed(plans(0.0)[0], shoulder, LIMITS),
        "fast enough": check_minimum_speed(plans(25.0)[0], here, LIMITS),
        "to the shoulder": check_minimum_speed(replace(pull_over, settings=()), shoulder, LIMITS),
        "on the shoulder": check_minimum_speed(pull_over, on_it, LIMITS),
        "no policy": check_minimum_speed(plan(None), here, LIMITS),
    }
    compare("minimum-speed-v1", {name: row(one) for name, one in found.items()})
