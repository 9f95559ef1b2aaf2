"""The person takes the wheel: at once, whatever else goes on; and nobody but they can."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_rig import Rig

import chauffeur
from chauffeur.concept import Limits, Parameters
from chauffeur.driving.live.messages import Key, Report, WheelHand
from chauffeur.driving.live.plan_messages import TOOK_OVER
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.wheel import STEP_MPS
from chauffeur.driving.scenarios import find
from chauffeur.programs import Sandbox

SOURCE = Path(chauffeur.__file__).parent
HOLD_20 = "def drive():\n    set_target_speed(20.0)\n    while True:\n        yield autopilot()\n"


def rig_on(folder: Path, sandbox: Sandbox, name: str, seed: int | None = None, limits: Limits | None = None) -> Rig:
    scenario = find(name)
    start = Start(scenario, scenario.seed if seed is None else seed, limits or Limits(), 600.0)
    rig = Rig(folder, sandbox, (start,))
    rig.period()
    return rig


@pytest.fixture
def rig(tmp_path: Path, sandbox: Sandbox) -> Iterator[Rig]:
    made = rig_on(tmp_path, sandbox, "cruise")
    yield made
    made.policy.close()


def press(rig: Rig, *keys: Key, periods: int = 1) -> Report:
    """Keys, one a period, and then some periods more."""
    for key in keys:
        rig.bench.take_over(True, key)
        rig.period()
    rig.period(periods)
    return rig.reports[-1]


# Taken ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("asked", [HOLD_20, Parameters(20.0, 12.0, 1.0)], ids=["program", "parameters"])
def test_the_wheel_is_the_persons_within_the_period_and_the_plan_ends(rig: Rig, asked: str | Parameters) -> None:
    rig.order(asked)
    rig.period(10)
    assert (rig.reports[-1].level, rig.reports[-1].plan) == ("follow", "w1")
    speed = rig.bench.world.observe().ego.speed_mps
    rig.bench.take_over(True)
    report = rig.bench.tick()
    assert (report.level, report.taken_over, report.plan, report.state) == ("hand", True, "", "none")
    assert report.setpoints.target_speed_mps == pytest.approx(speed)
    assert report.setpoints.target_lane == report.lane
    wish = rig.period()
    assert (wish.plan, wish.handovers) == ("", 1)
    assert [(event.kind, event.text) for event in rig.told()[1:]] == [("interrupted", TOOK_OVER)]
    rig.period(100)
    assert rig.reports[-1].level == "hand"
    assert rig.reports[-1].speed_mps == pytest.approx(speed, abs=0.5)
    assert rig.reports[-1].refused == {}


def test_keys_move_the_car_and_brake_stops_it(rig: Rig) -> None:
    before = rig.reports[-1]
    rig.bench.take_over(True)
    rig.period()
    began = rig.reports[-1].setpoints.target_speed_mps
    assert began is not None
    assert press(rig, "slower", "slower").setpoints.target_speed_mps == pytest.approx(began - 2 * STEP_MPS, abs=0.3)
    report = press(rig, "slower", periods=80)
    assert report.speed_mps == pytest.approx(report.setpoints.target_speed_mps, abs=0.5)
    slow = report.speed_mps
    assert press(rig, "faster", periods=80).speed_mps == pytest.approx(slow + STEP_MPS, abs=0.5)
    lane = rig.reports[-1].lane
    assert lane is not None
    assert before.lane == lane
    assert press(rig, "left", periods=80).lane == rig.bench.world.observe().road.neighbour(lane, -1)
    assert press(rig, "right", periods=80).lane == lane
    assert press(rig, "brake", periods=150).speed_mps < 0.1
    assert press(rig, "faster", periods=60).speed_mps == pytest.approx(STEP_MPS, abs=0.5)
    assert not any(report.faults for report in rig.reports)


def test_a_lane_that_is_not_there_is_said(rig: Rig) -> None:
    rig.bench.take_over(True)
    rig.period()
    for _ in range(6):
        press(rig, "left", periods=60)
    said = [text for report in rig.reports for text in report.said]
    assert said[0] == "There is no lane to the left."
    assert rig.reports[-1].lane is not None
    assert rig.reports[-1].lane.endswith(":0")


def test_limits_stay_and_keys_do_not_pile_up_beyond_them(tmp_path: Path, sandbox: Sandbox) -> None:
    rig = rig_on(tmp_path, sandbox, "cruise", limits=Limits(max_speed_mps=26.0))
    rig.bench.take_over(True)
    for _ in range(30):
        rig.bench.take_over(True, "faster")
        rig.period(3)
    assert rig.reports[-1].setpoints.target_speed_mps == 26.0
    rig.period(60)
    assert max(report.speed_mps for report in rig.reports) <= max(26.1, rig.reports[0].speed_mps)
    assert press(rig, "slower").setpoints.target_speed_mps == pytest.approx(26.0 - STEP_MPS, abs=0.3)
    rig.policy.close()


@pytest.mark.parametrize(("name", "seed"), [("overtake", 3), ("following", 5), ("emergency-lane", 7), ("parking", 5)])
def test_the_shield_stays_whatever_is_pressed(tmp_path: Path, sandbox: Sandbox, name: str, seed: int) -> None:
    rig = rig_on(tmp_path, sandbox, name, seed)
    keys = random.Random(seed)
    rig.bench.take_over(True)
    changed = 0
    for _ in range(250):
        if keys.random() < 0.3:
            rig.bench.take_over(True, keys.choice(("faster", "faster", "faster", "left", "right", "slower")))
        report = rig.bench.tick()
        changed += bool(report.interventions)
        if report.ended:
            break
    now = rig.bench.world.observe()
    assert not now.ego.crashed
    assert not now.off_road
    assert report.faults == 0
    assert changed or name in ("parking", "emergency-lane")
    rig.policy.close()


def test_at_a_crossing_the_keys_choose_the_turn_and_lead_on_from_the_stop_sign(
    tmp_path: Path, sandbox: Sandbox
) -> None:
    rig = rig_on(tmp_path, sandbox, "quiet-intersection")
    rig.bench.take_over(True)
    rig.period()
    assert press(rig, "left").setpoints.turn == "left"
    for _ in range(200):
        report = press(rig, periods=1)
        if report.speed_mps < 0.1:
            break
    assert report.speed_mps < 0.1, "it stands at the sign by itself"
    for _ in range(5):
        press(rig, "faster", periods=10)
    for _ in range(200):
        if rig.reports[-1].ended:
            break
        rig.period()
    assert rig.reports[-1].outcome == "ended"
    assert rig.reports[-1].lane is not None
    assert rig.reports[-1].lane == "il1-o1:0"
    rig.policy.close()


def test_somebody_at_the_wheel_of_a_lot_drives_on_along_its_way(tmp_path: Path, sandbox: Sandbox) -> None:
    rig = rig_on(tmp_path, sandbox, "parking")
    rig.order(Parameters(3.0, 5.0, 1.0, route="nearest"))
    rig.period(60)
    rig.bench.take_over(True)
    report = press(rig, "left", "slower", periods=100)
    assert (report.level, report.faults) == ("hand", 0)
    assert "There is no lane to the left." in [text for each in rig.reports for text in each.said]
    assert press(rig, "brake", periods=40).speed_mps < 0.05
    assert not rig.bench.world.observe().ego.crashed
    rig.policy.close()


# Given back -----------------------------------------------------------------------------------------------------------


def test_given_back_the_car_holds_until_a_new_wish_is_driven(rig: Rig) -> None:
    rig.order(HOLD_20)
    rig.period(5)
    rig.bench.take_over(True)
    rig.period()
    report = press(rig, "faster", periods=30)
    speed = rig.bench.world.observe().ego.speed_mps
    rig.bench.take_over(False)
    back = rig.bench.tick()
    assert (back.level, back.taken_over, back.plan) == ("hold", False, "")
    assert back.setpoints.target_speed_mps == pytest.approx(speed)
    rig.period(100)
    report = rig.reports[-1]
    assert (report.level, report.plan, report.refused) == ("follow", "", {})
    assert report.setpoints.target_speed_mps == pytest.approx(speed, abs=0.2), "not the 20 m/s of the plan that ended"
    rig.order(HOLD_20, "w2")
    assert rig.period().plan == "w2"
    rig.period()
    assert (rig.reports[-1].level, rig.reports[-1].plan) == ("follow", "w2")


def test_what_the_policy_still_wishes_from_before_is_not_believed(rig: Rig) -> None:
    rig.order(HOLD_20)
    old = rig.period(5)
    rig.bench.take_over(True)
    rig.period()
    rig.bench.take_over(False)
    for handovers, counted in ((0, {}), (1, {}), (3, {"of handovers to come": 1})):
        seen = rig.bench.observed()
        made = replace(old, tick=seen.tick, issued_ns=rig.bench.now_ns, handovers=handovers)
        rig.bench.setpoints.write(made.encode())
        report = rig.bench.tick()
        assert (report.level, report.plan, report.refused) == ("hold", "", counted)


def test_if_the_policy_is_gone_when_it_is_given_back_the_ladder_leads_to_a_stand(rig: Rig) -> None:
    rig.bench.take_over(True)
    rig.period(5)
    for _ in range(300):
        assert rig.bench.tick().level == "hand", "the person needs no policy"
    rig.bench.take_over(False)
    levels: list[str] = []
    for _ in range(400):
        report = rig.bench.tick()
        if not levels or levels[-1] != report.level:
            levels.append(report.level)
    assert levels == ["hold", "keep", "slow", "stop"]
    assert report.speed_mps < 0.1


def test_a_plan_that_comes_while_the_person_drives_is_not_started_and_one_made_before_is_stale(rig: Rig) -> None:
    rig.bench.take_over(True)
    rig.period(2)
    rig.order(HOLD_20)
    assert rig.period().plan == ""
    assert [(event.kind, event.text) for event in rig.told()] == [("interrupted", "You have the wheel.")]
    rig.order(HOLD_20, "w2")
    held = rig.orders.latest()
    assert held is not None
    rig.policy.tick()
    rig.told()
    rig.bench.take_over(False)
    rig.period(5)
    rig.orders.write(held.payload)
    assert rig.period().plan == ""
    assert [event.kind for event in rig.told()] == ["stale"]


@pytest.mark.parametrize("asked", [HOLD_20, Parameters(20.0, 12.0, 1.0)], ids=["program", "parameters"])
def test_a_policy_that_dies_meanwhile_does_not_go_on_with_what_was_taken_over(
    rig: Rig, asked: str | Parameters
) -> None:
    rig.order(asked)
    rig.period(5)
    rig.policy.close()
    rig.bench.take_over(True)
    rig.bench.tick()
    rig.policy = rig.new_policy()
    rig.period(3)
    rig.bench.take_over(False)
    rig.die()
    wish = rig.period(3)
    assert (wish.plan, wish.handovers) == ("", 2)
    assert [(event.kind, event.text) for event in rig.told()[1:]] == [("interrupted", TOOK_OVER)]


def test_it_may_change_hands_twice_within_a_period(rig: Rig) -> None:
    rig.order(HOLD_20)
    rig.period(5)
    rig.bench.take_over(True, "brake")
    rig.bench.take_over(False)
    report = rig.bench.tick()
    assert (report.level, report.taken_over, report.plan) == ("hold", False, "")
    assert report.setpoints.target_speed_mps, "a key of the hand that has let go counts for nothing"
    assert rig.period().plan == ""
    assert ("interrupted", "w1") in rig.kinds()


def test_the_wheel_stays_the_persons_from_trip_to_trip(tmp_path: Path, sandbox: Sandbox) -> None:
    starts = tuple(Start(find(name), 5, most_s=2.0) for name in ("overtake", "cruise"))
    rig = Rig(tmp_path, sandbox, starts)
    rig.bench.take_over(True)
    rig.period(20)
    assert rig.reports[-1].ended
    rig.bench.control.begin_trip()
    rig.period(3)
    assert (rig.reports[-1].trip, rig.reports[-1].level) == (2, "hand")
    rig.policy.close()


def test_asked_to_stop_the_car_stands_whoever_has_the_wheel(rig: Rig) -> None:
    rig.bench.take_over(True)
    rig.period(3)
    rig.bench.control.stop()
    for _ in range(300):
        report = press(rig, "faster", periods=0)
        if report.ended:
            break
    assert (report.level, report.outcome) == ("stop", "stopped")


# Heard ----------------------------------------------------------------------------------------------------------------


def test_garbage_is_counted_and_changes_nothing(rig: Rig) -> None:
    for payload in (b"", b"\xff" * 13, b"HAND\x01garbage!", b'{"on": true}', WheelHand(True).encode()[:-1]):
        rig.bench.hand.write(payload, rig.bench.now_ns)
        assert not rig.bench.tick().taken_over
    assert sum(rig.bench.tick().refused.values()) == 5
    rig.bench.take_over(True)
    assert rig.bench.tick().taken_over
    rig.bench.hand.write(b"HAND\x00garbage!", rig.bench.now_ns)
    assert rig.bench.tick().taken_over


def test_a_key_that_comes_late_is_not_meant_for_now_but_the_wheel_is(rig: Rig) -> None:
    rig.bench.take_over(True, "brake")
    rig.bench.now_ns += 5_000_000_000
    report = rig.bench.tick()
    assert report.taken_over
    assert report.setpoints.target_speed_mps is not None
    assert report.setpoints.target_speed_mps > 10.0


def test_every_key_of_a_period_counts_and_in_its_order(rig: Rig) -> None:
    rig.bench.take_over(True)
    press(rig, "slower", "slower", "slower", periods=80)
    speed = rig.bench.world.observe().ego.speed_mps
    for key in ("slower", "slower", "slower", "brake", "faster"):
        rig.bench.take_over(True, key)
        rig.bench.now_ns += 1
    assert rig.bench.tick().setpoints.target_speed_mps == pytest.approx(speed + STEP_MPS)
    rig.bench.take_over(True, "faster")
    rig.bench.take_over(True, "brake")
    assert rig.bench.tick().setpoints.target_speed_mps == 0.0


# Nobody else ----------------------------------------------------------------------------------------------------------

Place = tuple[str, ast.AST]


@pytest.fixture(scope="module")
def places() -> list[Place]:
    """Every place in the source, with its module, of those modules that speak of hands or of taking over at all."""
    found: list[Place] = []
    for path in SOURCE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if any(word in text for word in ('"hand"', "Hand(", "take_over(", ".hand(")):
            name = str(path.relative_to(SOURCE))
            found += [(name, node) for node in ast.walk(ast.parse(text))]
    return found


def names_the_ring(node: ast.AST) -> bool:
    """Whether it asks for the ring: `ring(folder, "hand")`, or `rings["hand"]`."""
    match node:
        case ast.Subscript(value=ast.Name(id="Literal")):
            return False
        case ast.Subscript(slice=ast.Constant(value="hand")):
            return True
        case ast.Call(args=[_, ast.Constant(value="hand"), *_]):
            return True
        case _:
            return False


def calls(node: ast.AST, *names: str) -> bool:
    match node:
        case ast.Call(func=ast.Attribute(attr=name) | ast.Name(id=name)):
            return name in names
        case _:
            return False


def test_one_hand_on_the_wheel(places: list[Place]) -> None:
    """The supervisor alone writes the ring, control alone reads it."""
    assert {name for name, node in places if names_the_ring(node)} == {
        "driving/live/supervisor.py", "driving/live/__main__.py",
    }  # fmt: skip
    main = ast.parse((SOURCE / "driving/live/__main__.py").read_text(encoding="utf-8"))
    functions = [each for each in main.body if isinstance(each, ast.FunctionDef)]
    assert {each.name for each in functions if any(map(names_the_ring, ast.walk(each)))} == {"_control"}
    live = {name for name, node in places if name.startswith("driving/live/") and calls(node, "WheelHand")}
    assert live == {"driving/live/supervisor.py"}


def test_what_a_model_says_or_makes_moves_no_wheel(places: list[Place]) -> None:
    """Who asks the supervisor: a session on behalf of its screens. No room that a model speaks in."""
    askers = {name for name, node in places if calls(node, "take_over", "hand")}
    assert askers
    assert not [name for name in askers if not name.startswith("driving/talk/")]


def test_no_process_that_hears_a_model_holds_the_ring(rig: Rig) -> None:
    """Whatever policy and planner could write to, control does not read hands from it."""
    rings = [getattr(rig.rings, name) for name in rig.rings.__slots__]
    for each in rings:
        assert isinstance(each, Ring)
        for hand in (WheelHand(True), WheelHand(True, "brake")):
            each.write(hand.encode(), rig.bench.now_ns)
    report = rig.bench.tick()
    assert not report.taken_over
    assert rig.bench.tick().level != "hand"
