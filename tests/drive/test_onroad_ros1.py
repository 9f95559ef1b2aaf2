"""Wishes for a ROS 1 vehicle on a loopback graph that speaks the real protocols: delivered, dead, and back again."""

from __future__ import annotations

import asyncio
import sys
import xmlrpc.client
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'chauffeur[ros]'")

sys.path.append(str(Path(__file__).resolve().parents[1] / "worlds"))

import ros_graph as ros
from ros_graph import FOLLOWER, REPLANNER, Master, Subscriber, VelocityPublisher, closing_all

from chauffeur.concept import Parameters
from chauffeur.drive.events import DriveEvent
from chauffeur.drive.onroad import OnRoadAnswer, VehicleSession, open_recorder
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.safety.audit import read_records, verify
from chauffeur.worlds.ros import RosVehicleState
from chauffeur.worlds.ros.limits import checked
from chauffeur.worlds.ros.node import Ros1Settings
from chauffeur.worlds.ros.ros1 import Ros1Vehicle
from chauffeur.worlds.ros.settings import parse_settings

pytestmark = pytest.mark.server

TEXT = 'interface = "ros1"\n[limits]\nmax_speed_mps = 10.0\n[ros1]\nmaster = "{uri}"\n'


@pytest.fixture(scope="module")
def embedded() -> Planner:
    return make_planner("talk2drive")


@pytest.fixture
def master() -> Iterator[Master]:
    graph = Master()
    yield graph
    graph.close()


def drive(
    uri: str, planner: Planner, steps: Callable[[VehicleSession, list[DriveEvent]], Awaitable[None]], **options: Any
) -> list[DriveEvent]:
    told: list[DriveEvent] = []
    settings = parse_settings(TEXT.format(uri=uri))
    stack: Any = settings.stack
    car = Ros1Vehicle(stack, Ros1Settings(master=uri), check_s=0.1)

    async def whole() -> None:
        async with VehicleSession(car, settings, planner, tell=told.append, **options) as road:
            await steps(road, told)

    try:
        asyncio.run(whole())
    finally:
        car.close()
    return told


async def until(true: Callable[[], Any]) -> Any:
    for _ in range(2000):
        if value := true():
            return value
        await asyncio.sleep(0.005)
    raise AssertionError("it never came")


def said(told: list[DriveEvent], kind: str) -> list[str]:
    return [event.text for event in told if event.kind == kind]


def links(told: list[DriveEvent], link: str) -> list[str]:
    return [one.text for one in told if isinstance(one.value, RosVehicleState) and one.value.link == link]


def test_a_wish_is_with_the_vehicle_when_it_is_answered(master: Master, embedded: Planner) -> None:
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    speed = VelocityPublisher(master)
    speed.speed_mps = 5.0
    answers: list[OnRoadAnswer] = []
    contexts: list[str] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        assert (await road.reached(10.0)).link == "up"
        await until(lambda: road._vehicle.state().speed_mps == 5.0)
        answers.append(await road.ask("A bit faster, please."))
        await until(lambda: len(replanner.got) == 1 and len(follower.got) == 1)
        answers.append(await road.ask("Stop!"))
        contexts.extend(said(told, "context"))

    with closing_all(follower, replanner, speed):
        told = drive(master.uri, embedded, steps)
        ros.eventually(lambda: len(replanner.got) == 2)
    assert [one.status for one in answers] == ["delivered", "delivered"]
    assert answers[0].confirmed_s is not None
    first = ros.replanner_of(replanner.got[0][0])["velocity_max"]
    assert 18.0 < first < 36.0  # faster than 5 m/s
    assert ros.replanner_of(replanner.got[1][0])["velocity_max"] == 0.0
    assert ros.follower_of(follower.got[1][0])["param_flag"] == 0
    assert "I am driving at 5.0 m/s (18 km/h)." in contexts[0]
    assert "goes on with at most 0.0 m/s" in said(told, "over")[0]


def test_without_a_way_to_the_vehicle_nothing_waits_in_a_queue(master: Master, embedded: Planner) -> None:
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await until(lambda: "Nobody listens" in road._vehicle.state().words)
        answers.append(await road.ask("Drive at 20 km/h."))
        follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
        with closing_all(follower, replanner):
            await until(lambda: road._vehicle.state().link == "up")
            await asyncio.sleep(0.05)
            assert not follower.got
            assert not replanner.got
            answers.append(await road.ask("Drive at 20 km/h."))
            await until(lambda: replanner.got and follower.got)

    drive(master.uri, embedded, steps)
    assert [one.status for one in answers] == ["unreachable", "delivered"]
    assert "Nothing was published" in answers[0].words
    assert answers[0].published is None


def test_a_roscore_that_dies_and_comes_back(tmp_path: Path, embedded: Planner) -> None:
    file, log = tmp_path / "vehicle.toml", tmp_path / "audit.jsonl"
    file.write_text(TEXT)
    port = ros.free_port()
    graph = Master(port)
    nodes = [Subscriber(graph, FOLLOWER), Subscriber(graph, REPLANNER)]
    fresh: list[Subscriber] = []
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        answers.append(await road.ask("Drive at 20 km/h."))
        for node in nodes:
            node.close()
        graph.close()
        lost = await until(lambda: [one for one in links(told, "connecting") if "refused" in one])
        assert "stays in force: at most 5.6 m/s" in lost[-1]
        answers.append(await road.ask("Drive at 30 km/h."))
        again = Master(port)
        fresh.extend([Subscriber(again, FOLLOWER), Subscriber(again, REPLANNER)])
        with closing_all(*fresh, again):
            await until(lambda: road._vehicle.state().link == "up" and fresh[1].got)
            # What was answered "not delivered" is not delivered later; who starts anew gets what is in force.
            assert [ros.replanner_of(data)["velocity_max"] for data, _ in fresh[1].got] == [pytest.approx(20.016)]
            answers.append(await road.ask("Drive at 25 km/h."))
            await until(lambda: len(fresh[1].got) == 2)

    with open_recorder(log, file, "ros1", dry_run=False) as books:
        drive(graph.uri, embedded, steps, books=books)
    assert [one.status for one in answers] == ["delivered", "unreachable", "delivered"]
    assert verify(log).ok
    records = [record.body for _, record in read_records(log)]
    assert "real vehicle over ros1" in records[0]["drive"]
    written = [one["link"] for one in records if one.get("event") == "link"]
    assert "up" in written[: written.index("connecting", 1)]
    assert written[-1] == "up"
    assert [one["outcome"] for one in records if "took_s" in one] == ["delivered", "unreachable", "delivered"]


def test_nodes_outlive_their_master(embedded: Planner) -> None:
    """They stay connected to us: wishes still reach them, and what is wrong is said."""
    port = ros.free_port()
    graph = Master(port)
    follower, replanner = Subscriber(graph, FOLLOWER), Subscriber(graph, REPLANNER)
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        answers.append(await road.ask("Drive at 20 km/h."))
        graph.close()
        await until(lambda: [one for one in links(told, "up") if "connection is refused" in one])
        answers.append(await road.ask("Drive at 25 km/h."))
        again = Master(port)
        try:
            await until(lambda: links(told, "up")[-1].startswith("Connected. In force: at most 6.9 m/s"))
        finally:
            again.close()

    drive(graph.uri, embedded, steps)
    ros.eventually(lambda: len(follower.got) == 2 and len(replanner.got) == 2)
    follower.vanish()
    replanner.vanish()
    assert [one.status for one in answers] == ["delivered", "delivered"]


def test_a_node_that_takes_nothing_is_said_and_a_rise_is_taken_back(master: Master, embedded: Planner) -> None:
    """A subscriber that is connected and never reads: its socket's buffers are all that is handed over."""
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        answers.append(await road.ask("Drive at 20 km/h."))
        state = road._vehicle.state
        stuck = True

        class Stuck:
            def __getattr__(self, name: str) -> Any:
                return getattr(car, name)

            def state(self) -> Any:
                return replace(state(), delivered=state().delivered and not stuck)

        car = road._vehicle
        road._vehicle = Stuck()  # type: ignore[assignment]
        road._confirm_within_s = 0.05
        answers.append(await road.ask("Drive at 30 km/h."))
        assert road.asked is not None
        assert road.asked.target_speed_mps == pytest.approx(5.56)
        answers.append(await road.ask("Drive at 10 km/h."))
        assert not said(told, "late")
        stuck = False
        await until(lambda: said(told, "late"))

    with closing_all(follower, replanner):
        told = drive(master.uri, embedded, steps)
        ros.eventually(lambda: len(replanner.got) == 4)
    assert [one.status for one in answers] == ["delivered", "unconfirmed", "unconfirmed"]
    assert "taken back to 5.6 m/s" in answers[1].words
    assert "stays the newest" in answers[2].words
    caps = [ros.replanner_of(data)["velocity_max"] for data, _ in replanner.got]
    assert caps == [pytest.approx(each, abs=0.1) for each in (20.0, 30.0, 20.0, 10.0)]
    assert "10" in said(told, "late")[0]


def test_shut_down_from_outside(master: Master, embedded: Planner) -> None:
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        (uri,) = [uri for name, uri in master.nodes.items() if name.startswith("/chauffeur")]
        await asyncio.to_thread(xmlrpc.client.ServerProxy(uri).shutdown, "/test", "user request")
        await until(lambda: [one for one in said(told, "link") if "user request" in one])
        answers.append(await road.ask("Drive at 20 km/h."))

    with closing_all(follower, replanner):
        drive(master.uri, embedded, steps)
    assert answers[0].status == "unreachable"
    assert "user request" in answers[0].words


def test_limits_of_the_interface_hold_whatever_was_checked(master: Master, embedded: Planner) -> None:
    """The border's own refusal is an answer like any other."""
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        car, stricter = road._vehicle, parse_settings(TEXT.format(uri=master.uri).replace("10.0", "2.0")).stack

        class Stricter:
            def __getattr__(self, name: str) -> Any:
                return getattr(car, name)

            def apply(self, parameters: Parameters) -> Any:
                checked(parameters, stricter.limits)
                return car.apply(parameters)

        road._vehicle = Stricter()  # type: ignore[assignment]
        answers.append(await road.ask("Drive at 20 km/h."))
        assert road.asked is None

    with closing_all(follower, replanner):
        drive(master.uri, embedded, steps)
        assert not replanner.got
    assert answers[0].status == "refused"
    assert "allows 0 to 2 m/s" in answers[0].words
