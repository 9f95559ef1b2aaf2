"""Trigger files, and the ten scenarios on a stage that only writes down what happens on it."""

from __future__ import annotations

import itertools
import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.leaderboard_drives import car, seen, street
from chauffeur.bench.leaderboard.behaviours import Behaviour, reached, set_off
from chauffeur.bench.leaderboard.routes import read_routes
from chauffeur.bench.leaderboard.track import RouteTrack
from chauffeur.bench.leaderboard.triggers import Placed, Trigger, place, read_triggers
from chauffeur.bench.leaderboard.ways import plan_keypoints
from chauffeur.concept import Command, DataError, ScenarioError, Signal
from chauffeur.geometry import Pose

SHARED_DATA = Path(os.environ.get("CHAUFFEUR_TEST_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
OFFICIAL = SHARED_DATA / "carla"
needs_official = pytest.mark.skipif(
    not (OFFICIAL / "routes").is_dir(), reason=f"the official files are not in {OFFICIAL}; set CHAUFFEUR_TEST_DATA"
)
ROAD = street(200.0)
WAY = RouteTrack.straight(
    [(float(x), 0.0) for x in range(321)], ["straight" if 200 <= x < 220 else "follow" for x in range(321)]
)
TURNING = replace(WAY, options=tuple("right" if one == "straight" else one for one in WAY.options))  # type: ignore[misc]


class Notebook:
    """A stage that knows where everybody is."""

    def __init__(self) -> None:
        self.there: dict[int, tuple[str, Pose, float]] = {}
        self.forced: dict[str, str | None] = {}
        self.spawned: list[str] = []

    def spawn(self, kind: str, pose: Pose, speed_mps: float = 0.0) -> int:
        self.spawned.append(kind)
        self.there[len(self.spawned)] = kind, pose, speed_mps
        return len(self.spawned)

    def drive(self, actor: int, pose: Pose, speed_mps: float) -> None:
        self.there[actor] = self.there[actor][0], pose, speed_mps

    def remove(self, actor: int) -> None:
        del self.there[actor]

    def force_signal(self, signal: str, state: str | None) -> None:
        self.forced[signal] = state


def start(kind: int, index: int = 100, way: RouteTrack = WAY) -> tuple[Behaviour, Notebook]:
    stage = Notebook()
    placed = Placed(Trigger(kind, way.poses[index]), index, way.next_turn(index))
    return set_off(placed, way, ROAD, stage, np.random.default_rng(5)), stage  # type: ignore[arg-type]


def pass_by(behaviour: Behaviour, stage: Notebook, begin: float = 100.0, end: float = 300.0, speed: float = 8.0):
    """Where everybody is while the ego drives on."""
    log = []
    for i in range(int((end - begin) / (speed * 0.05))):
        behaviour.update(seen(i * 0.05, car(0, begin + i * speed * 0.05, speed=speed), road=ROAD))
        log.append(dict(stage.there))
        if behaviour.done:
            break
    return log


def disturbances(behaviour: Behaviour, begin: float) -> list[tuple[float, Command]]:
    """Places along the way at which the ego is disturbed, and how."""
    felt: list[tuple[float, Command]] = []
    for i in range(300):
        x = begin + i * 0.4
        behaviour.update(seen(i * 0.05, car(0, x), road=ROAD))
        felt += [] if behaviour.disturbance is None else [(x, behaviour.disturbance)]
    assert behaviour.done and behaviour.disturbance is None
    return felt


def test_control_loss_disturbs_from_12_to_42_m_and_then_no_more() -> None:
    felt = disturbances(start(1, 20)[0], 20.0)
    assert [felt[0][0], felt[-1][0]] == pytest.approx([32.0, 62.0], abs=0.5)
    assert all(one.acceleration_mps2 > 0.0 for _, one in felt)
    assert 0.0 < np.std([one.steering_rad for _, one in felt]) < 0.05


def test_control_loss_ends_ten_metres_before_a_junction() -> None:
    felt = disturbances(start(1, 165)[0], 165.0)  # 12 m on, 23 m are left to the junction
    assert 188.0 < felt[-1][0] <= 190.5


def test_the_jaywalker_waits_on_the_right_crosses_the_way_and_is_cleared_away() -> None:
    behaviour, stage = start(3)
    log = pass_by(behaviour, stage)
    first = log[0][1]
    assert first[0] in ("pedestrian", "bicycle")
    assert stage.spawned[1] == "static"
    assert first[1].x_m == pytest.approx(112.0, abs=0.5)
    assert first[1].y_m < -1.75
    across = [instant[1][1].y_m for instant in log if 1 in instant]
    assert across == sorted(across)
    assert min(abs(y) for y in across) < 0.3
    assert across[-1] > 3.5  # beyond the lane of the other direction
    assert behaviour.done
    assert stage.there == {}


def test_a_cyclist_crosses_behind_the_turn_at_ten_metres_a_second() -> None:
    behaviour, stage = start(4, 180, TURNING)
    assert stage.spawned == ["bicycle"]
    assert stage.there[1][1].x_m == pytest.approx(227.0, abs=1.5)
    log = pass_by(behaviour, stage, 180.0)
    assert max(instant[1][2] for instant in log if 1 in instant) == 10.0
    assert behaviour.done


@pytest.mark.parametrize(
    ("kind", "index", "lacks"),
    [(4, 260, "a junction"), (7, 260, "a junction"), (6, 190, "a lane"), (6, 290, "60 m of way")],
)
def test_what_the_way_lacks_cannot_be_placed(kind: int, index: int, lacks: str) -> None:
    with pytest.raises(ScenarioError, match=f"Scenario{kind} needs {lacks}"):
        start(kind, index)


@pytest.mark.parametrize(("kind", "cars"), [(2, 1), (5, 2)])
def test_lead_cars_drive_brake_to_a_stand_and_are_gone_at_the_end(kind: int, cars: int) -> None:
    behaviour, stage = start(kind, 10)
    assert stage.spawned == ["car"] * cars
    speeds = []
    for i in range(1300):
        behaviour.update(seen(i * 0.05, car(0, 10.0 + i * 0.1, speed=2.0), road=ROAD))
        if behaviour.done:
            break
        speeds.append(stage.there[1][2])
    assert min(speeds) == 0.0
    assert behaviour.done
    assert stage.there == {}


def test_the_obstacle_stands_in_the_lane_until_it_is_passed() -> None:
    behaviour, stage = start(6, 30)
    assert stage.there[1][1].x_m == pytest.approx(80.0)
    pass_by(behaviour, stage, 30.0, 94.0)
    assert stage.there
    pass_by(behaviour, stage, 94.0, 100.0)
    assert behaviour.done
    assert not stage.there


def test_cars_come_the_other_way_forty_metres_apart_while_the_obstacle_stands() -> None:
    behaviour, stage = start(6, 30)
    gaps: set[int] = set()
    for i in range(700):
        behaviour.update(seen(i * 0.05, car(0, 30.0, speed=0.0), road=ROAD))
        flow = sorted(pose.x_m for number, (kind, pose, _) in stage.there.items() if kind == "car")
        assert all(
            pose.y_m == 3.5 and abs(pose.heading_rad) > 3.1 for kind, pose, _ in stage.there.values() if kind == "car"
        )
        gaps |= {round(b - a) for a, b in itertools.pairwise(flow)}
    assert flow[0] < 30.0 < flow[-1] <= 140.0, "they have passed the ego"
    assert gaps == {40}


def test_who_comes_waits_for_an_ego_in_the_way() -> None:
    behaviour, stage = start(6, 30)
    for i in range(600):
        behaviour.update(seen(i * 0.05, car(0, 60.0, 3.5, speed=0.0), road=ROAD))
        assert all(pose.x_m > 64.0 for kind, pose, _ in stage.there.values() if kind == "car")
    assert any(speed == 0.0 for kind, _, speed in stage.there.values() if kind == "car")


def test_lights_turn_yellow_red_and_back_within_ten_metres() -> None:
    behaviour, stage = start(7, 150)
    light = Signal("own", "green", ("east",), ((199.0, 1.75), (199.0, -1.75)))
    shown = []
    for i in range(400):
        x = min(150.0 + i * 0.4, 195.0)
        behaviour.update(seen(i * 0.05, car(0, x), signals=[light], road=ROAD))
        if not shown or shown[-1] != stage.forced.get("own", "cycle"):
            shown.append(stage.forced.get("own", "cycle"))
    assert shown == ["cycle", "yellow", "red", "green", None]
    assert behaviour.done


def test_negotiation_is_left_to_the_traffic() -> None:
    behaviour, stage = start(10)
    behaviour.update(seen(0.0, car(0, 100.0), road=ROAD))
    assert behaviour.done
    assert not stage.spawned


def test_what_a_trigger_puts_on_the_road_is_measured_from_the_trigger_itself() -> None:
    """The first point near it may lie 2 m before it: a car would have as much less to brake in."""
    trigger = Trigger(3, Pose(101.9, 0.5, 0.0))
    placed = Placed(trigger, 100, None)
    assert placed.station_m(WAY) == pytest.approx(101.9)


def test_a_trigger_fires_within_a_metre_and_a_half() -> None:
    placed = Placed(Trigger(3, Pose(100.0, 0.0, 0.0)), 100, None)
    assert reached(placed, seen(0.0, car(0, 98.6)))
    assert not reached(placed, seen(0.0, car(0, 98.4)))


def test_triggers_match_in_place_and_heading_and_the_highest_stands() -> None:
    here = Pose(50.3, 1.0, math.radians(5.0))
    found = place(
        WAY,
        [
            Trigger(1, here),
            Trigger(3, Pose(50.0, 0.5, 0.0)),
            Trigger(10, Pose(80.0, 2.1, 0.0)),
            Trigger(10, Pose(80.0, 0.0, math.radians(11.0))),
            Trigger(4, Pose(120.0, 0.0, 0.0)),
            Trigger(7, Pose(130.0, 0.0, 0.0)),
        ],
    )
    assert [(one.trigger.scenario, one.turn) for one in found] == [(3, None), (7, "straight")]
    assert [one.trigger.scenario for one in place(TURNING, [Trigger(8, Pose(90.0, 0.0, 0.0))])] == []


@pytest.mark.parametrize("content", ["[]", "{}", '{"available_scenarios": [{"T": [{"scenario_type": "Scenario99"}]}]}'])
def test_what_is_no_trigger_file_is_said(tmp_path: Path, content: str) -> None:
    file = tmp_path / "triggers.json"
    file.write_text(content)
    with pytest.raises(DataError, match=r"triggers\.json"):
        read_triggers(file)


def test_a_route_on_no_map_says_that_no_way_leads_there() -> None:
    with pytest.raises(ScenarioError, match="No way leads"):
        plan_keypoints(ROAD, [Pose(150.0, 0.0, 0.0), Pose(20.0, 0.0, 0.0)])


@needs_official
def test_all_official_routes_are_read_unchanged() -> None:
    files = [read_routes(OFFICIAL / "routes" / f"routes_{name}.xml") for name in ("testing", "training", "devtest")]
    assert [len(file.routes) for file in files] == [26, 50, 4]
    assert not any(route.fault for file in files for route in file.routes)
    assert {route.town for file in files for route in file.routes} <= {f"Town0{n}" for n in range(1, 8)}
    assert any(route.weather for route in files[1].routes)


@needs_official
def test_both_trigger_files_are_read() -> None:
    public = read_triggers(OFFICIAL / "scenarios" / "all_towns_traffic_scenarios_public.json")
    kinds = [one.scenario for triggers in public.towns.values() for one in triggers]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {1: 1538, 3: 414, 4: 489}
    ten = read_triggers(OFFICIAL / "scenarios" / "ten")
    assert {one.scenario for triggers in ten.towns.values() for one in triggers} == {1, 3, 4, 7, 8, 9, 10}
    assert json.dumps(sorted(public.towns)) == json.dumps([f"Town0{n}" for n in range(1, 7)])
