"""Parameters driven in real time: policy and control side by side, on roads and in lots, through every fallback."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_rig import Rig

from chauffeur.concept import Limits, Parameters, ScenarioError, Setpoints
from chauffeur.driving.live.messages import Report, Steered
from chauffeur.driving.live.plan_messages import PlannedScene
from chauffeur.driving.live.policy import MOST_RESUMPTIONS
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import BUILT_IN, find
from chauffeur.executors.pursuit import ParametersDriver
from chauffeur.programs import Sandbox
from chauffeur.worlds.places import ParkingPlaces

PLAIN = Parameters(22.0, 12.0, 1.0)
PARK = Parameters(3.0, 5.0, 1.0, route="nearest")
HOLD_20 = "def drive():\n    set_target_speed(20.0)\n    while True:\n        yield autopilot()\n"

Begin = Callable[..., Rig]


def start(name: str, seed: int | None = None, **changes: object) -> Start:
    scenario = find(name)
    made = Start(scenario, scenario.seed if seed is None else seed, most_s=300.0)
    return replace(made, **changes)  # pyright: ignore[reportArgumentType]


@pytest.fixture
def begin(tmp_path: Path, sandbox: Sandbox) -> Iterator[Begin]:
    rigs: list[Rig] = []

    def made(*starts: Start) -> Rig:
        rigs.append(Rig(tmp_path, sandbox, starts))
        rigs[-1].period()
        return rigs[-1]

    yield made
    for rig in rigs:
        rig.policy.close()


def lanes(rig: Rig) -> list[int]:
    """Indices of the ego's lanes, in the order in which they were driven."""
    found: list[int] = []
    for report in rig.reports:
        index = None if report.lane is None else int(report.lane.rpartition(":")[2])
        if index is not None and (not found or found[-1] != index):
            found.append(index)
    return found


def said(rig: Rig) -> list[str]:
    return [text for report in rig.reports for text in report.said]


def well(rig: Rig) -> bool:
    last = rig.bench.world.observe()
    return not last.ego.crashed and not last.off_road and not any(report.faults for report in rig.reports)


# Driven ---------------------------------------------------------------------------------------------------------------


def test_parameters_are_checked_started_and_driven(begin: Begin) -> None:
    rig = begin(start("cruise"))
    rig.order(PLAIN)
    wish = rig.period()
    assert rig.kinds() == [("started", "w1")]
    assert (wish.plan, wish.state, wish.line, wish.setpoints.target_speed_mps) == ("w1", "running", None, 22.0)
    assert wish.steered == Steered(PLAIN, rig.reports[-1].lane)
    rig.period(150)
    report = rig.reports[-1]
    assert (report.level, report.plan, report.refused) == ("follow", "w1", {})
    assert (report.setpoints.target_speed_mps, report.setpoints.time_headway_s) == (22.0, 1.5)
    assert report.speed_mps == pytest.approx(22.0, abs=0.6)
    assert well(rig)


@pytest.mark.parametrize(
    ("name", "policy", "kind", "words"),
    [
        ("cruise", Parameters(60.0, 12.0, 1.0), "refused", "speed"),
        ("cruise", Parameters(20.0, 0.0, 1.0), "refused", "look-ahead"),
        ("cruise", Parameters(20.0, 12.0, 1.0, route="left"), "refused", "no intersection"),
        ("cruise", Parameters(20.0, 12.0, 1.0, route="stadium"), "refused", "parking lots"),
        ("left-lane", Parameters(20.0, 12.0, 1.0, -1), "refused", "left"),
        ("parking", Parameters(3.0, 5.0, 1.0, route="Z9"), "refused", "no place 'Z9'"),
        ("parking", Parameters(3.0, 5.0, 1.0, route="A1"), "refused", "taken"),
    ],
)
def test_what_cannot_be_driven_here_is_refused_in_words_and_never_reaches_control(
    begin: Begin, name: str, policy: Parameters, kind: str, words: str
) -> None:
    rig = begin(start(name))
    if words == "taken":
        taken = next(lane.id for lane in rig.bench.world.observe().road.lanes if lane.closed)
        policy = replace(policy, route=taken)
    rig.order(policy)
    assert rig.period(3).steered is None
    (event,) = rig.told()
    assert event.kind == kind
    assert words in event.text
    assert rig.reports[-1].refused == {}


def test_a_lane_is_changed_once_and_what_is_said_of_it_reaches_the_person(begin: Begin) -> None:
    """Lanes lie to the right of where it ends up: the wish does not count anew from each."""
    rig = begin(start("left-lane"))
    rig.order(Parameters(22.0, 12.0, 1.0, 1))
    rig.period(200)
    assert lanes(rig) == [0, 1]
    assert len({lane.id for lane in rig.bench.world.observe().road.lanes}) > 2
    assert said(rig)[-1] == "Changing to the right lane."
    events = [(event.kind, event.text) for event in rig.told()]
    assert [kind for kind, _ in events] == ["started"], "control says it, in its reports"
    assert rig.bench.world.observe().ego.y_m == pytest.approx(-4.0, abs=0.1)
    assert well(rig)


def test_other_numbers_on_the_way_leave_a_change_that_has_begun_alone(begin: Begin) -> None:
    rig = begin(start("left-lane"))
    rig.order(Parameters(22.0, 12.0, 1.0, 1))
    while not said(rig):
        rig.period()
    while "Changing to the right lane." not in said(rig):
        rig.period()
    rig.period(10)
    rig.order(Parameters(25.0, 14.0, 1.0), "w2")
    rig.period(100)
    assert lanes(rig) == [0, 1]
    assert rig.reports[-1].setpoints.target_speed_mps == 25.0


def test_a_turn_is_driven_and_the_next_numbers_keep_to_it(begin: Begin) -> None:
    rig = begin(start("intersection"))
    rig.order(Parameters(9.0, 6.0, 1.0, route="left"))
    rig.period(40)
    rig.order(Parameters(7.0, 6.0, 1.0), "w2")
    wish = rig.period()
    assert wish.steered is not None
    assert wish.steered.policy.route == "left"
    while not rig.reports[-1].ended:
        rig.period()
    assert rig.reports[-1].lane is not None
    assert rig.reports[-1].lane == "il1-o1:0"
    assert rig.reports[-1].outcome == "ended"
    stood = [report for report in rig.reports if report.speed_mps < 0.1]
    assert len(stood) >= 10, "at the stop sign, and once"


@pytest.mark.parametrize("scenario", [s.id for s in BUILT_IN if s.world == "parking"])
def test_a_lot_is_driven_to_the_spot_and_the_wish_is_done(begin: Begin, scenario: str) -> None:
    rig = begin(start(scenario))
    world = rig.bench.world
    assert isinstance(world, ParkingPlaces)
    goal = find(scenario).goal["place"]
    spot = world.spot(goal).name
    rig.order(replace(PARK, route=goal))
    wish = rig.period()
    assert wish.steered is not None
    assert wish.steered.policy.route == spot, "a place is a spot from the start on"
    while wish.state == "running" and len(rig.reports) < 800:
        wish = rig.period()
    assert world.parked() == spot
    events = rig.told()
    assert [(event.kind, event.text) for event in events[1:]] == [("finished", f"Parked in {spot}.")]
    rig.period(30)
    assert world.parked() == spot
    assert well(rig)
    rig.order(Parameters(3.0, 5.0, 1.0), "w2")
    rig.period()
    assert [(event.kind, "does not reverse" in event.text) for event in rig.told()] == [("refused", True)]


def turning_in(rig: Rig, world: ParkingPlaces) -> str:
    """Drive until the car has begun to turn onto its spot, from where no way leads there any more; its name."""
    wish = rig.period()
    assert wish.steered is not None
    name = wish.steered.policy.route
    spot = world.spot(name)
    while world.way_to(spot) is not None:
        assert rig.period().state == "running"
    with pytest.raises(ScenarioError):
        world.spot(name)
    return name


def test_slower_on_the_way_onto_a_spot_is_driven_on_that_way(begin: Begin) -> None:
    """From there no way would lead onto the spot any more, if one were looked for anew."""
    rig = begin(start("parking"))
    world = rig.bench.world
    assert isinstance(world, ParkingPlaces)
    rig.order(PARK)
    spot = turning_in(rig, world)
    rig.order(Parameters(1.5, 4.0, 1.0), "w2")
    after = rig.period()
    assert after.plan == "w2"
    assert after.steered is not None
    assert after.steered.policy.route == spot
    while after.state == "running" and len(rig.reports) < 900:
        after = rig.period()
    assert world.parked() == spot


def test_a_program_takes_over_from_parameters_and_the_other_way_round(begin: Begin) -> None:
    rig = begin(start("cruise"))
    rig.order(PLAIN)
    rig.period(20)
    rig.order(HOLD_20, "w2")
    wish = rig.period(20)
    assert (wish.plan, wish.steered, wish.setpoints.target_speed_mps) == ("w2", None, 20.0)
    assert wish.setpoints.target_lane == rig.reports[-1].lane
    rig.order(replace(PLAIN, target_speed_mps=24.0), "w3")
    wish = rig.period(20)
    assert wish.plan == "w3"
    assert rig.reports[-1].setpoints.target_speed_mps == 24.0
    assert [kind for kind, _ in rig.kinds()] == ["started", "superseded", "started", "superseded", "started"]
    assert well(rig)


def test_limits_hold_whatever_control_is_told(begin: Begin) -> None:
    rig = begin(start("cruise", limits=Limits(max_speed_mps=18.0)))
    rig.order(Parameters(17.0, 12.0, 1.0))
    wish = rig.period(3)
    assert wish.steered is not None
    forged = replace(wish.steered, policy=replace(wish.steered.policy, target_speed_mps=90.0))
    for _ in range(100):
        seen = rig.bench.observed()
        made = replace(
            wish, tick=seen.tick, issued_ns=rig.bench.now_ns, plan="x", setpoints=Setpoints(90.0), steered=forged
        )
        rig.bench.setpoints.write(made.encode())
        report = rig.bench.tick()
    assert report.setpoints.target_speed_mps == 18.0
    assert "target_speed" in report.clipped
    assert rig.bench.world.observe().ego.speed_mps <= 18.1


def test_a_plan_without_a_lane_wish_relies_on_neither_lane_nor_lead(begin: Begin) -> None:
    rig = begin(start("cruise"))
    elsewhere = PlannedScene(1, 0, "x-y:0", 99)
    rig.order(Parameters(22.0, 12.0, 1.0, -1), scene=elsewhere)
    rig.order(PLAIN, "w2", scene=elsewhere)
    assert rig.period().plan == "w2"
    rig.order(Parameters(22.0, 12.0, 1.0, -1), "w3", scene=elsewhere)
    assert rig.period().plan == "w2"
    assert rig.kinds() == [("superseded", "w1"), ("started", "w2"), ("stale", "w3")]


def test_the_gap_a_person_wants_at_least_is_kept(begin: Begin) -> None:
    rig = begin(start("cruise", limits=Limits(min_time_headway_s=2.5)))
    rig.order(PLAIN)
    rig.period(3)
    assert rig.reports[-1].setpoints.time_headway_s == 2.5


def test_a_fault_in_a_lot_is_braked_for_with_the_wheel_held(begin: Begin, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = begin(start("parking"))
    world = rig.bench.world
    assert isinstance(world, ParkingPlaces)
    rig.order(PARK)
    turning_in(rig, world)
    rig.period(5)
    wheel = rig.reports[-1].applied.steering_rad
    assert abs(wheel) > 0.1

    def fails(*_: object) -> None:
        raise ZeroDivisionError

    with monkeypatch.context() as broken:
        broken.setattr(ParametersDriver, "command", fails)
        rig.period(3)
    assert [report.applied.steering_rad for report in rig.reports[-3:]] == [wheel] * 3
    assert rig.reports[-1].faults == 3
    assert rig.reports[-1].applied.acceleration_mps2 < 0.0


# Believed -------------------------------------------------------------------------------------------------------------


def test_parameters_that_lead_nowhere_are_refused_by_control_too_and_what_it_had_goes_on(begin: Begin) -> None:
    rig = begin(start("cruise"))
    rig.order(PLAIN)
    wish = rig.period(3)
    for _ in range(3):
        made = replace(wish, tick=rig.bench.observed().tick, plan="x", issued_ns=rig.bench.now_ns)
        bad = Steered(replace(PLAIN, target_speed_mps=30.0, route="stadium"), None)
        rig.bench.setpoints.write(replace(made, steered=bad).encode())
        report = rig.bench.tick()
    assert (report.plan, report.setpoints.target_speed_mps) == ("w1", 22.0)
    assert report.refused == {"no way for this policy": 3}
    assert report.faults == 0


# Let go of ------------------------------------------------------------------------------------------------------------


def silence(rig: Rig, periods: int = 600) -> list[str]:
    """Rungs that control goes down when the policy is heard of no more, until the car stands."""
    levels: list[str] = []
    for _ in range(periods):
        report: Report = rig.bench.tick()
        rig.reports.append(report)
        if not levels or levels[-1] != report.level:
            levels.append(report.level)
        if report.speed_mps < 0.05 and report.level == "stop":
            break
    return levels


@pytest.mark.parametrize("name", ["cruise", "following", "emergency-lane", "quiet-intersection", "parking"])
def test_silence_leads_down_the_ladder_to_a_stand_and_wishes_lead_back(begin: Begin, name: str) -> None:
    rig = begin(start(name, most_s=900.0))
    slow = name in ("parking", "quiet-intersection")
    rig.order(Parameters(2.0 if slow else 20.0, 6.0, 1.0))
    rig.period(30)
    before = rig.reports[-1].lane
    levels = silence(rig)
    assert levels[:3] == ["follow", "hold", "keep"]
    assert levels[-1] == "stop"
    assert rig.reports[-1].speed_mps < 0.05
    assert well(rig)
    rig.period(100)
    assert rig.reports[-1].level == "follow"
    assert rig.reports[-1].speed_mps > 1.0
    if name == "emergency-lane":
        assert before is not None
        assert max(lanes(rig)) == 3, "it made for the shoulder"
        rig.period(150)
        assert rig.reports[-1].lane == before, "and came back, for that is where the plan drives"
    assert well(rig)


def test_parameters_go_on_when_the_process_dies_even_where_no_way_could_be_found_anew(begin: Begin) -> None:
    rig = begin(start("parking"))
    world = rig.bench.world
    assert isinstance(world, ParkingPlaces)
    rig.order(PARK)
    wish = rig.period()
    for times in range(MOST_RESUMPTIONS):
        if times == MOST_RESUMPTIONS - 1:
            turning_in(rig, world)
        wish = rig.period(10)
        rig.die()
        silent = rig.bench.tick()
        assert silent.level in ("follow", "hold")
        wish = rig.period()
        assert (wish.plan, wish.state) == ("w1", "running")
    while wish.state == "running" and len(rig.reports) < 800:
        wish = rig.period()
    assert wish.steered is not None
    assert world.parked() == wish.steered.policy.route
    assert [kind for kind, _ in rig.kinds()] == ["started", *["resumed"] * MOST_RESUMPTIONS, "finished"]
    assert rig.reports[-1].refused == {}


def test_parameters_of_a_checkpoint_are_read_as_carefully_as_any(begin: Begin) -> None:
    rig = begin(start("cruise"))
    rig.order(PLAIN)
    rig.period(2)
    message = rig.rings.checkpoints.latest()
    assert message is not None
    assert b'"ahead": 12.0' in message.payload
    rig.rings.checkpoints.write(message.payload.replace(b'"ahead": 12.0', b'"ahead": -2.0'))
    rig.policy = rig.new_policy()
    assert rig.period(2).plan == ""
    assert rig.kinds() == [("started", "w1")]


def test_trips_of_lots_follow_one_another_and_a_new_one_ends_the_parameters(begin: Begin) -> None:
    rig = begin(start("parking", most_s=2.0), start("parking-exit"))
    rig.order(PARK)
    rig.period(19)
    assert rig.reports[-1].ended
    rig.bench.control.begin_trip()
    wish = rig.period(2)
    assert (wish.trip, wish.plan, wish.steered) == (2, "", None)
    assert rig.reports[-1].level == "follow"
    assert rig.kinds() == [("started", "w1"), ("interrupted", "w1")]


@pytest.mark.parametrize("name", ["overtake", "intersection", "parking"])
def test_control_warms_up_in_any_world_and_forgets_it(begin: Begin, name: str) -> None:
    rig = begin(start(name))
    first = rig.bench.world.reset(rig.starts[0].scenario, rig.starts[0].seed)
    control = rig.bench.control
    control.warm_up()
    assert rig.bench.world.observe() != first, "it has driven"
    control._trip = 0  # pyright: ignore[reportPrivateUsage]
    assert control.begin_trip()
    assert rig.bench.world.observe() == first
    assert control.tick().faults == 0
