"""Action matrices and trajectories driven live: by control, through the executors of simulated drives."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from live_rig import Rig

from chauffeur.concept import ActionMatrix, Limits, Scenario, Trajectory
from chauffeur.driving.live.messages import MOST_WAYPOINTS, LiveSetpoints, MessageError, Steered
from chauffeur.driving.live.plan_messages import PlannedScene
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.geometry import Pose
from chauffeur.programs import Sandbox

pytest.importorskip("osqp")

CALM = ActionMatrix((0.6, 0.02, 0.05), (10.0, 20.0, 100.0))
EMPTY_LOT = Start(Scenario("lot", "parking", {"cars": 0, "walkers": 0, "ego_speed": 2.0}, 7), 7)


def straight(speed_mps: float, seconds: float, period_s: float = 0.5) -> Trajectory:
    return Trajectory(tuple((speed_mps * period_s * i, 0.0) for i in range(1, round(seconds / period_s) + 1)), period_s)


@pytest.fixture
def begin(tmp_path: Path, sandbox: Sandbox) -> Iterator[Callable[[Start], Rig]]:
    rigs: list[Rig] = []

    def made(start: Start) -> Rig:
        folder = tmp_path / str(len(rigs))
        folder.mkdir()
        rigs.append(Rig(folder, sandbox, (start,)))
        rigs[-1].period()
        return rigs[-1]

    yield made
    for rig in rigs:
        rig.policy.close()


def ego_of(rig: Rig) -> Pose:
    ego = rig.bench.world.observe().ego
    return Pose(ego.x_m, ego.y_m, ego.heading_rad)


@pytest.mark.parametrize("dies", [False, True])
def test_a_trajectory_is_driven_to_its_end_and_no_further(begin: Callable[[Start], Rig], dies: bool) -> None:
    rig = begin(EMPTY_LOT)
    begun = ego_of(rig)
    rig.order(straight(2.0, 5.0))
    rig.period(20)
    if dies:
        rig.die()
    rig.period(90)
    forward, left = begun.sees(ego_of(rig).x_m, ego_of(rig).y_m)
    assert rig.kinds() == [("started", "w1"), *([("resumed", "w1")] if dies else []), ("finished", "w1")]
    assert forward == pytest.approx(10.0, abs=2.0)
    assert abs(left) < 0.1
    last = rig.reports[-1]
    assert (last.level, last.plan, last.faults, last.refused) == ("follow", "w1", 0, {})
    assert last.speed_mps < 0.1


def test_waypoints_count_from_where_they_were_planned_however_long_that_took(begin: Callable[[Start], Rig]) -> None:
    """The same end, whether a plan took no time or two seconds; one that took longer than it lasts is not driven."""
    ends: list[float] = []
    for waited in (0, 20, 60):
        rig = begin(EMPTY_LOT)
        begun = ego_of(rig)
        ordered = rig.bench.world.observe()
        scene = replace(_scene(rig), tick=ordered.tick)
        rig.period(waited)
        rig.order(straight(2.0, 5.0), scene=scene)
        rig.period(110 - waited)
        kinds = rig.kinds()
        ends.append(begun.sees(ego_of(rig).x_m, ego_of(rig).y_m)[0])
        assert kinds == ([("stale", "w1")] if waited == 60 else [("started", "w1"), ("finished", "w1")])
    assert ends[1] == pytest.approx(ends[0], abs=0.6)


def _scene(rig: Rig):

    return PlannedScene.of(rig.bench.observed().trip, rig.bench.world.observe())


def test_an_action_matrix_keeps_its_lane_and_goes_on_after_its_process_died(begin: Callable[[Start], Rig]) -> None:
    rig = begin(Start(find("cruise"), 3))
    rig.order(CALM)
    rig.period(30)
    rig.die()
    rig.period(30)
    assert rig.kinds() == [("started", "w1"), ("resumed", "w1")]
    assert {report.level for report in rig.reports[2:]} <= {"follow", "hold"}
    assert len({report.lane for report in rig.reports}) == 1
    assert rig.reports[-1].faults == 0


def test_when_the_policy_is_silent_the_ladder_brakes_whatever_drives(begin: Callable[[Start], Rig]) -> None:
    rig = begin(Start(find("cruise"), 3, limits=Limits()))
    rig.order(CALM)
    rig.period(10)
    for _ in range(190):
        rig.reports.append(rig.bench.tick())
    levels = list(dict.fromkeys(report.level for report in rig.reports))
    assert levels[-4:] == ["hold", "keep", "slow", "stop"]
    assert rig.reports[-1].speed_mps < 15.0
    assert all(report.setpoints.target_speed_mps == 0.0 for report in rig.reports if report.level == "stop")
    assert rig.reports[-1].faults == 0


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        (ActionMatrix((90.0, 0.0, 0.0), (1.0, 1.0, 1.0)), "Kp"),
        (straight(4.0, 4.0, 0.25), "acceleration"),
        (Trajectory(tuple((0.02 * i, 0.0) for i in range(1, 2 * MOST_WAYPOINTS)), 0.01), "waypoints"),
    ],
    ids=["gains", "harsh", "long"],
)
def test_the_same_checks_refuse_them(
    begin: Callable[[Start], Rig], policy: ActionMatrix | Trajectory, words: str
) -> None:
    rig = begin(EMPTY_LOT)
    rig.order(policy)
    assert rig.period(2).steered is None
    (event,) = rig.told()
    assert event.kind == "refused"
    assert words in event.text


@pytest.mark.parametrize(
    "steered",
    [Steered(CALM, "a:0"), Steered(straight(3.0, 4.0), None, (1.0, 2.0, 0.3, 4.0))],
    ids=lambda one: one.policy.kind,
)
def test_what_control_is_told_comes_back_and_garbage_does_not(steered: Steered) -> None:
    fields = json.loads(json.dumps(steered.fields()))
    assert Steered.read(fields) == steered
    for spoiled in ({"rows": []}, {"rows": [[1.0]]}, {"rows": [["1", 2.0]]}, {"kind": "telepathy"}, {"pose": [1.0]},
                    {"rows": [[float("nan")] * len(fields["rows"][0])] * 2}, {"rows": [[1.0, 2.0]] * 500}):  # fmt: skip
        with pytest.raises(MessageError):
            Steered.read(fields | spoiled)


def test_the_longest_trajectory_fits_where_wishes_are_written(begin: Callable[[Start], Rig]) -> None:
    rig = begin(EMPTY_LOT)
    points = tuple((12345.678 + 0.001 * i, -9876.543) for i in range(MOST_WAYPOINTS))
    wish = rig.period()
    assert isinstance(wish, LiveSetpoints)
    pose = (12345.678, -9876.543, -3.14159, 22.345)
    rig.bench.setpoints.write(replace(wish, steered=Steered(Trajectory(points, 0.1), "a" * 200, pose)).encode())
