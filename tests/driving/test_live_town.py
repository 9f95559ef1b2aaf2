"""A town in real time: destinations, ways and stops wished while driving, by the policy's copy of the town."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from live_rig import Rig

from chauffeur.concept import Parameters, Scenario
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Runtime
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.messages import encode
from chauffeur.driving.talk.view import View
from chauffeur.programs import Budget, Sandbox
from chauffeur.worlds.town.library import load
from chauffeur.worlds.town.pack import places_called

pytest.importorskip("libsumo")
pytest.importorskip("sumo")

from chauffeur.worlds.town import TownWorld

BEFORE_M = 60.0
WITHIN = 3000
"""Periods: two and a half minutes of the car's time."""
ON = "def go():\n    while True:\n        yield proceed(check_speed_limit())\n"
OUT = "def out():\n    while True:\n        yield stop()\n"
SLOW = "def slow():\n    while True:\n        yield proceed(5.0)\n"
TURN = "def go():\n    turn_{0}_at_next_intersection()\n    while True:\n        yield proceed(check_speed_limit())\n"


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    with Sandbox(Budget(turn_s=2.0, tick_s=2.0, grace_s=0.5, start_s=10.0)) as sandbox:
        yield sandbox


@pytest.fixture
def rig(tmp_path: Path, sandbox: Sandbox) -> Iterator[Rig]:
    """On the street that leads to the station, some way before it."""
    town = load("Gridford")
    station = places_called(town.places, "station")[0]
    lane, at_m = station.lane, station.station_m - BEFORE_M
    while at_m < 1.0:
        lane = town.road.predecessors(lane)[0].id
        at_m += town.road[lane].length_m
    config = {"town": "Gridford", "vehicles": 8, "people": 8, "start": (lane, at_m), "ego_speed": 6.0}
    made = Rig(tmp_path, sandbox, (Start(Scenario("t", "town", config, 4), 4, most_s=600.0),))
    yield made
    made.policy.close()


def go_to(place: str) -> Parameters:
    return Parameters(11.1, 12.0, 2.0, 0, place)


def drive_until(rig: Rig, done: Callable[[], bool]) -> None:
    for _ in range(WITHIN):
        rig.period()
        if done():
            return
    raise AssertionError("It did not come to that.")


def said(rig: Rig) -> list[str]:
    return [text for report in rig.reports for text in report.said]


def stands(rig: Rig) -> bool:
    return rig.bench.world.observe().ego.speed_mps < 0.1


def test_a_place_is_driven_to_held_and_left_for_the_next_wish(rig: Rig) -> None:
    rig.period(10)
    rig.order(go_to("the station"))
    drive_until(rig, lambda: bool(said(rig)))
    assert said(rig) == ["Here we are: the station."]
    assert stands(rig)
    rig.period(60)
    assert stands(rig)
    assert ("finished", "w1") in rig.kinds()
    assert not rig.reports[-1].ended  # whoever is there may want to go on
    rig.order(ON, "w2")
    drive_until(rig, lambda: rig.bench.world.observe().ego.speed_mps > 4.0)
    assert said(rig) == ["Here we are: the station."]
    assert all(not report.refused and not report.faults for report in rig.reports)


def test_a_change_of_mind_is_another_way_and_a_turn_gives_the_place_up(rig: Rig) -> None:
    world = rig.bench.world
    assert isinstance(world, TownWorld)
    rig.order(go_to("the station"))
    rig.period(20)
    first = world.observe().route
    church = places_called(load("Gridford").places, "church")[0]
    rig.order(go_to("the church"), "w2")
    rig.period(5)
    second = world.observe().route
    assert first is not None
    assert second is not None
    assert second != first
    assert second.lanes[-1] == church.lane
    ahead = world.perception().junction_ahead()
    assert ahead is not None
    for number, side in enumerate(side for side in ahead[1] if side != "straight"):
        rig.order(TURN.format(side), f"w{3 + number}")
        rig.period(60)  # a wish inside a junction is for the next one
    assert not world.driver().has_goal  # one of the two is not the way to the church
    kinds = rig.kinds()
    assert ("superseded", "w1") in kinds
    assert ("superseded", "w2") in kinds
    assert ("started", "w3") in kinds


def test_a_turn_is_taken_once_and_another_pace_does_not_take_it_again(rig: Rig) -> None:
    world = rig.bench.world
    drive_until(rig, lambda: (ahead := world.perception().junction_ahead()) is not None and ahead[0] > 30.0)
    ahead = world.perception().junction_ahead()
    assert ahead is not None
    side = next(side for side in ahead[1] if side != "straight")
    rig.order(Parameters(11.1, 12.0, 2.0, 0, side))
    assert (steered := rig.period(5).steered) is not None
    assert isinstance(steered.policy, Parameters)
    assert steered.policy.route == side
    drive_until(rig, lambda: rig.reports[-1].setpoints.turn == side)
    drive_until(rig, lambda: rig.reports[-1].setpoints.turn is None)
    rig.order(Parameters(6.0, 12.0, 2.0, 0, ""), "w2")
    assert (steered := rig.period(5).steered) is not None
    assert isinstance(steered.policy, Parameters)
    assert steered.policy.route == ""
    assert rig.reports[-1].setpoints.target_speed_mps == 6.0


def test_another_pace_leaves_the_place_that_is_made_for(rig: Rig) -> None:
    rig.order(go_to("the station"))
    rig.period(20)
    way = rig.bench.world.observe().route
    rig.order(Parameters(5.0, 12.0, 2.0, 0, ""), "w2")
    assert (steered := rig.period(5).steered) is not None
    assert isinstance(steered.policy, Parameters)
    assert steered.policy.route == "the station"
    rig.order(SLOW, "w3")
    rig.period(5)
    assert rig.bench.world.observe().route == way
    drive_until(rig, lambda: bool(said(rig)))
    assert stands(rig)


def test_a_place_that_is_not_there_is_refused_and_the_way_goes_on(rig: Rig) -> None:
    rig.order(go_to("the station"))
    rig.period(20)
    way = rig.bench.world.observe().route
    rig.order(go_to("the moon"), "w2")
    rig.period(5)
    refused = [event.text for event in rig.told() if event.kind == "refused"]
    assert len(refused) == 1
    assert "no place 'the moon'" in refused[0]
    assert rig.bench.world.observe().route == way
    assert rig.reports[-1].plan == "w1"


def test_who_wants_to_get_out_is_let_out_and_a_stop_is_a_stop_at_once(rig: Rig) -> None:
    rig.order(OUT)
    drive_until(rig, lambda: stands(rig))
    rig.order(ON, "w2")
    drive_until(rig, lambda: rig.bench.world.observe().ego.speed_mps > 5.0)
    rig.bench.control.stop()
    begun = len(rig.reports)
    drive_until(rig, lambda: rig.reports[-1].ended)
    report = rig.reports[-1]
    assert (report.level, report.outcome) == ("stop", "stopped")
    assert (len(rig.reports) - begun) * rig.bench.world.dt_s < 5.0
    assert not rig.bench.world.observe().ego.crashed


def test_a_policy_process_that_dies_is_followed_by_one_on_the_same_way(rig: Rig) -> None:
    rig.order(go_to("the station"))
    rig.period(20)
    rig.die()
    rig.period(3)
    assert ("resumed", "w1") in rig.kinds()
    drive_until(rig, lambda: bool(said(rig)))
    rig.period(2)
    assert ("finished", "w1") in rig.kinds()


def test_the_wheel_moves_the_car_and_gives_it_back(rig: Rig) -> None:
    rig.order(go_to("the station"))
    rig.period(20)
    rig.bench.take_over(True, "brake")
    drive_until(rig, lambda: stands(rig))
    assert rig.reports[-1].taken_over
    rig.bench.take_over(True, "faster")
    drive_until(rig, lambda: rig.bench.world.observe().ego.speed_mps > 1.0)
    rig.bench.take_over(False)
    rig.period(5)
    assert rig.reports[-1].level in ("follow", "hold")


def test_a_screen_sees_the_road_the_lights_and_the_name_of_the_street(rig: Rig) -> None:
    view = View(Settings(rig.starts), rig.bench.observations)
    road, scene = view.look(None)
    rig.period(5)
    for _ in range(600):
        rig.period()
        _, scene = view.look(rig.reports[-1])
        if scene is not None and scene.street and scene.lights:
            break
    assert road is not None
    assert scene is not None
    assert {"driving", "sidewalk"} <= {lane.what for lane in road.lanes}
    assert any(lane.junction for lane in road.lanes)
    assert scene.street in {lane.street for lane in load("Gridford").road.lanes}
    assert {light.state for light in scene.lights} <= {"red", "yellow", "green", "off"}
    assert any(body.what == "pedestrian" for body in scene.others)
    assert encode(scene)


def test_the_processes_drive_a_town_and_one_that_is_killed_is_replaced() -> None:
    """Control alone has a simulator. Words go in, the car goes to the place; a stop is a stop."""
    start = Start(find("town"), 4, most_s=600.0)
    heard: list[DriveEvent] = []

    def until(runtime: Runtime, holds: Callable[[], bool]) -> None:
        end = time.monotonic() + 60.0
        while not holds():
            assert time.monotonic() < end, "it did not come to pass in time"
            assert runtime.driving, "control has ended"
            runtime.poll()
            time.sleep(0.005)

    def follows(runtime: Runtime, wish: str) -> bool:
        report = runtime.report
        return report is not None and (report.plan, report.level) == (wish, "follow")

    with Runtime(Settings((start,), planner="onboard", realtime=False), heard.append) as runtime:
        wish = runtime.ask("Take me to the station.")
        until(runtime, lambda: follows(runtime, wish))
        before = runtime.pid("policy")
        os.kill(before, signal.SIGKILL)
        until(runtime, lambda: any(event.kind == "resumed" for event in heard))
        until(runtime, lambda: follows(runtime, wish))
        other = runtime.ask("Change of mind: take me to the church.")
        until(runtime, lambda: follows(runtime, other))
        runtime.ask("Stop!")
        end = time.monotonic() + 30.0
        while runtime.driving and time.monotonic() < end:
            runtime.poll()
            time.sleep(0.005)
        assert runtime.report is not None
        assert runtime.report.outcome == "stopped"
        assert runtime.report.faults == 0
