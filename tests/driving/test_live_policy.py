"""The policy process in one piece beside a control process: what it starts, runs, puts down and picks up."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_bench import OVERTAKE
from live_rig import Rig

from chauffeur.concept import Plan, Thoughts
from chauffeur.driving.live.messages import LiveSetpoints
from chauffeur.driving.live.plan_messages import TAKES_BACK, PlannedScene
from chauffeur.driving.live.policy import MOST_RESUMPTIONS
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.programs import Sandbox

HOLD_20 = """
def drive():
    set_target_speed(20.0)
    for _ in range(40):
        yield autopilot()
    say("Done.")
    yield autopilot()
"""
COUNT = """
def drive():
    speed = 30.0
    while speed > 20.0:
        speed = speed - 0.1
        set_target_speed(speed)
        yield autopilot()
"""
FASTER = """
def drive():
    set_target_speed(31.0)
    while True:
        yield autopilot()
"""
TOO_FAST = """
def drive():
    set_target_speed(60.0)
    while True:
        yield autopilot()
"""
FAILS = """
def drive():
    yield autopilot()
    x = [1]
    y = x[3]
    yield autopilot()
"""


@pytest.fixture
def rig(tmp_path: Path, sandbox: Sandbox) -> Iterator[Rig]:
    made = Rig(tmp_path, sandbox)
    yield made
    made.policy.close()


def test_without_a_plan_it_wishes_what_is_and_shows_that_it_lives(rig: Rig) -> None:
    wish = rig.period(3)
    assert (wish.plan, wish.state, wish.tick) == ("", "none", 2)
    assert rig.bench.tick().level == "follow"
    assert rig.kinds() == []


def test_a_plan_is_checked_started_run_and_told_of(rig: Rig) -> None:
    rig.period(2)
    rig.order(HOLD_20)
    wish = rig.period()
    assert (wish.plan, wish.state, wish.setpoints.target_speed_mps) == ("w1", "running", 20.0)
    assert wish.line is not None
    assert rig.kinds() == [("started", "w1")]
    assert rig.verdicts and all(verdict.passed for verdict in rig.verdicts), "told, and before it started"
    assert rig.period(45).state == "finished"
    assert rig.kinds() == [("said", "w1"), ("finished", "w1")]
    assert rig.period().setpoints.target_speed_mps == 20.0  # what was wished holds on


def test_a_plan_that_crosses_the_limits_is_refused_and_what_is_driven_goes_on(rig: Rig) -> None:
    rig.period()
    rig.order(HOLD_20)
    rig.period(3)
    rig.order(TOO_FAST, "w2")
    wish = rig.period()
    assert (wish.plan, wish.setpoints.target_speed_mps) == ("w1", 20.0)
    kinds = rig.kinds()
    assert kinds == [("started", "w1"), ("refused", "w2")]
    assert [verdict for verdict in rig.verdicts if verdict.stops], rig.verdicts


def test_a_new_plan_takes_over_at_the_beginning_of_a_period_with_the_wishes_of_the_old(rig: Rig) -> None:
    rig.period()
    rig.order("def drive():\n    set_desired_time_headway(2.0)\n    while True:\n        yield autopilot()\n")
    assert rig.period().setpoints.time_headway_s == 2.0
    rig.order(FASTER, "w2")
    wish = rig.period()
    assert (wish.plan, wish.setpoints.target_speed_mps, wish.setpoints.time_headway_s) == ("w2", 31.0, 2.0)
    assert rig.kinds() == [("started", "w1"), ("superseded", "w1"), ("started", "w2")]


def test_a_plan_begins_without_waiting_for_the_next_instant(rig: Rig) -> None:
    rig.period(2)
    assert rig.policy.tick()
    assert not rig.policy.tick()  # nothing new was shown
    rig.order(HOLD_20)
    assert rig.policy.tick()
    message = rig.bench.setpoints.latest()
    assert message is not None
    assert LiveSetpoints.decode(message.payload).plan == "w1"
    assert not rig.policy.tick()


def test_between_instants_no_plan_begins_on_a_picture_that_is_old(rig: Rig) -> None:
    rig.period(2)
    assert rig.policy.tick()
    rig.order(HOLD_20)
    rig.bench.now_ns += 200_000_000
    assert not rig.policy.tick()
    assert rig.kinds() == []


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"start_by_ns": 1}, "too late"),
        ({"expires_ns": 1}, "too late"),
        ({"scene": PlannedScene(2, 0, None, None)}, "another trip"),
        ({"scene": PlannedScene(1, 0, "x-y:0", None)}, "another lane"),
    ],
)
def test_a_stale_plan_is_not_started(rig: Rig, changes: dict[str, object], why: str) -> None:
    rig.period()
    rig.order(HOLD_20, **changes)
    assert rig.period().plan == ""
    (event,) = rig.told()
    assert event.kind == "stale"
    assert why in event.text


def test_a_plan_for_another_car_ahead_is_stale(rig: Rig) -> None:
    rig.period()
    scene = PlannedScene.of(1, rig.bench.world.observe())
    assert scene.lead is not None
    rig.order(HOLD_20, scene=replace(scene, lead=scene.lead + 1))
    rig.period()
    assert [(e.kind, "Another car" in e.text) for e in rig.told()] == [("stale", True)]


def test_garbage_among_the_plans_is_told_of_and_only_the_last_of_several_is_looked_at(rig: Rig) -> None:
    rig.period()
    rig.orders.write(b"{garbage")
    rig.order(HOLD_20, "w1")
    rig.order(FASTER, "w2")
    assert rig.period().plan == "w2"
    assert rig.kinds() == [("garbage", ""), ("superseded", "w1"), ("started", "w2")]


def test_a_program_that_fails_says_so_once_and_control_lets_go_of_its_wishes(rig: Rig) -> None:
    rig.period()
    rig.order(FAILS)
    assert rig.period(4).state == "failed"
    assert rig.kinds() == [("started", "w1"), ("failed", "w1")]
    assert rig.bench.tick().level == "keep"


def test_a_program_goes_on_where_it_stood_when_its_process_dies(rig: Rig) -> None:
    rig.period()
    rig.order(COUNT)
    before = rig.period(30)
    rig.policy.close()  # as the end of the process would
    rig.policy = rig.new_policy()
    after = rig.period()
    assert rig.kinds() == [("started", "w1"), ("resumed", "w1")]
    assert (after.plan, after.state) == ("w1", "running")
    assert before.setpoints.target_speed_mps is not None
    assert after.setpoints.target_speed_mps == pytest.approx(before.setpoints.target_speed_mps - 0.1)


def test_a_program_that_was_running_whenever_its_process_died_is_given_up(rig: Rig) -> None:
    rig.period()
    rig.order(FASTER)
    rig.period(2)
    for _ in range(MOST_RESUMPTIONS):
        rig.policy.close()
        rig.policy = rig.new_policy()
        assert rig.period(2).plan == "w1"
    rig.policy.close()
    rig.policy = rig.new_policy()
    assert rig.period().plan == ""
    assert rig.kinds() == [("started", "w1"), *[("resumed", "w1")] * MOST_RESUMPTIONS, ("interrupted", "w1")]


def test_a_program_that_had_ended_is_not_picked_up_again(rig: Rig) -> None:
    rig.period()
    rig.order(HOLD_20)
    assert rig.period(50).state == "finished"
    rig.policy.close()
    rig.policy = rig.new_policy()
    assert rig.period().plan == ""
    assert ("resumed", "w1") not in rig.kinds()


def test_a_torn_checkpoint_is_no_program(rig: Rig) -> None:
    rig.period()
    rig.order(COUNT)
    rig.period(3)
    rig.policy.close()
    message = rig.rings.checkpoints.latest()
    assert message is not None
    rig.rings.checkpoints.write(message.payload[:-200] + bytes(200))
    rig.policy = rig.new_policy()
    assert rig.period(2).plan == ""
    assert rig.kinds() == [("started", "w1"), ("interrupted", "w1")]


def test_a_new_trip_ends_what_was_driven(tmp_path: Path, sandbox: Sandbox) -> None:
    starts = (replace(OVERTAKE, most_s=1.0), Start(find("following"), 2))
    rig = Rig(tmp_path, sandbox, starts)
    rig.period()
    rig.order(FASTER)
    rig.period(9)
    rig.bench.control.begin_trip()
    wish = rig.period()
    assert (wish.trip, wish.plan, wish.state) == (2, "", "none")
    assert rig.kinds() == [("started", "w1"), ("interrupted", "w1")]
    rig.policy.close()


def test_a_plan_without_a_program_is_refused(rig: Rig) -> None:
    rig.period()
    rig.order("", plan=Plan(Thoughts(""), None, refusal="I cannot fly."))
    rig.period()
    (event,) = rig.told()
    assert (event.kind, event.text) == ("refused", "I cannot fly.")


GROWS = """
def drive():
    kept = []
    while True:
        kept.append("x" * 400000 + str(len(kept)))
        yield autopilot()
"""
LEAPS = """
def drive():
    yield autopilot()
    kept = ["x" * 400000 + str(i) for i in range(18)]
    while True:
        yield autopilot()
"""


def test_a_program_that_grows_is_not_put_down_beyond_its_ring_and_ends_with_its_process(rig: Rig) -> None:
    rig.period(2)
    rig.order(GROWS)
    rig.period(8)
    head = rig.rings.checkpoints.head
    rig.period(8)
    assert rig.rings.checkpoints.head == head
    assert rig.kinds() == [("started", "w1")]
    rig.die()
    assert rig.period().plan == ""  # an older state of it is not taken up again
    assert rig.kinds() == [("interrupted", "w1")]


def test_a_program_that_fails_of_being_put_down_has_failed_and_the_policy_goes_on(rig: Rig) -> None:
    rig.period(2)
    rig.order(LEAPS)
    assert rig.period(6).state == "failed"
    assert rig.kinds() == [("started", "w1"), ("failed", "w1")]
    rig.order(HOLD_20, "w2")
    wish = rig.period()
    assert (wish.plan, wish.state, wish.setpoints.target_speed_mps) == ("w2", "running", 20.0)


@pytest.mark.parametrize("periods", [3, 60])
def test_what_is_taken_back_ends_and_the_car_drives_on_as_before(rig: Rig, periods: int) -> None:
    before = rig.period(2).setpoints
    rig.order(HOLD_20)
    assert rig.period(periods).setpoints.target_speed_mps == 20.0
    rig.order(HOLD_20, "w2", plan=Plan(Thoughts("As you wish."), None, intent=TAKES_BACK))
    wish = rig.period()
    assert (wish.plan, wish.state, wish.setpoints.target_speed_mps) == ("", "none", before.target_speed_mps)
    kinds = rig.kinds()
    assert kinds[-1] == ("answered", "w2")
    assert (("superseded", "w1") in kinds) == (periods == 3)
