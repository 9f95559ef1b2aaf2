"""Wishes for a vehicle behind a rosbridge server on loopback: delivered, dead, and back again."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("websockets", reason="websockets is not installed: pip install 'chauffeur[ros]'")

sys.path.append(str(Path(__file__).resolve().parents[1] / "worlds"))

from rosbridge_server import FOLLOWER, HOST, REPLANNER, Bridge, eventually, free_port

from chauffeur.concept import Parameters
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.driving.recorder import open_vehicle_audit
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.safety.audit import read_records, verify
from chauffeur.worlds.ros import RosVehicleState
from chauffeur.worlds.ros.autoware_ai import VELOCITY_TOPIC
from chauffeur.worlds.ros.limits import checked
from chauffeur.worlds.ros.rosbridge import RosbridgeVehicle
from chauffeur.worlds.ros.settings import parse_settings

pytestmark = pytest.mark.server

TEXT = """interface = "rosbridge"
stack = "autoware.ai"
[limits]
max_speed_mps = 10.0
[rosbridge]
url = "{url}"
"""


@pytest.fixture(scope="module")
def embedded() -> Planner:
    return make_planner("talk2drive")


@pytest.fixture
def bridge() -> Iterator[Bridge]:
    server = Bridge()
    yield server
    server.close()


def drive(
    url: str, planner: Planner, steps: Callable[[VehicleSession, list[DriveEvent]], Awaitable[None]], **options: Any
) -> list[DriveEvent]:
    told: list[DriveEvent] = []
    settings = parse_settings(TEXT.format(url=url))
    stack: Any = settings.stack
    car = RosbridgeVehicle(stack, settings.rosbridge, retry_s=0.05)

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


def caps(bridge: Bridge) -> list[float]:
    """The speed caps that were published, km/h."""
    return [message["velocity_max"] for topic, message in bridge.published if topic == REPLANNER]


def test_a_wish_is_with_the_vehicle_when_it_is_answered(bridge: Bridge, embedded: Planner) -> None:
    answers: list[OnRoadAnswer] = []
    contexts: list[str] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        assert (await road.reached(10.0)).link == "up"
        await until(lambda: VELOCITY_TOPIC in bridge.subscribed)
        bridge.say(VELOCITY_TOPIC, {"twist": {"linear": {"x": 5.0}}})
        await until(lambda: road._vehicle.state().speed_mps == 5.0)
        answers.append(await road.ask("A bit faster, please."))
        await until(lambda: len(bridge.published) == 2)
        answers.append(await road.ask("Stop!"))
        contexts.extend(said(told, "context"))

    told = drive(bridge.url, embedded, steps)
    eventually(lambda: len(bridge.published) == 4)
    assert [one.status for one in answers] == ["delivered", "delivered"]
    assert answers[0].confirmed_s is not None
    assert "who listens behind it is not known" in answers[0].words
    assert 18.0 < caps(bridge)[0] < 36.0  # faster than 5 m/s
    assert caps(bridge)[1] == 0.0
    assert [topic for topic, _ in bridge.published] == [REPLANNER, FOLLOWER] * 2
    assert bridge.published[-1][1]["param_flag"] == 0
    assert "I am driving at 5.0 m/s (18 km/h)." in contexts[0]
    assert "goes on with at most 0.0 m/s" in said(told, "over")[0]


def test_without_a_way_to_the_vehicle_nothing_waits_in_a_queue(embedded: Planner) -> None:
    answers: list[OnRoadAnswer] = []
    port = free_port()
    servers: list[Bridge] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await until(lambda: "the connection is refused" in road._vehicle.state().words)
        answers.append(await road.ask("Drive at 20 km/h."))
        servers.append(Bridge(port))
        await until(lambda: road._vehicle.state().link == "up")
        await until(lambda: VELOCITY_TOPIC in servers[0].subscribed)
        assert not servers[0].published
        answers.append(await road.ask("Drive at 25 km/h."))
        await until(lambda: len(servers[0].published) == 2)

    try:
        drive(f"ws://{HOST}:{port}", embedded, steps)
    finally:
        for server in servers:
            server.close()
    assert [one.status for one in answers] == ["unreachable", "delivered"]
    assert "Nothing was published" in answers[0].words
    assert answers[0].published is None
    assert caps(servers[0]) == [pytest.approx(25.0, abs=0.1)]


def test_a_server_that_dies_and_comes_back(tmp_path: Path, embedded: Planner) -> None:
    file, log = tmp_path / "vehicle.toml", tmp_path / "audit.jsonl"
    file.write_text(TEXT)
    port = free_port()
    servers = [Bridge(port)]
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        answers.append(await road.ask("Drive at 20 km/h."))
        servers[0].close()
        lost = await until(lambda: [one for one in links(told, "connecting") if "stays in force" in one])
        assert "stays in force: at most 5.6 m/s" in lost[-1]
        answers.append(await road.ask("Drive at 30 km/h."))
        servers.append(Bridge(port))
        await until(lambda: road._vehicle.state().link == "up" and len(servers[1].published) == 2)
        # What was answered "not delivered" is not delivered later; who starts anew gets what is in force.
        assert caps(servers[1]) == [pytest.approx(20.0)]
        answers.append(await road.ask("Drive at 25 km/h."))
        await until(lambda: len(servers[1].published) == 4)

    try:
        with open_vehicle_audit(log, file, "rosbridge", dry_run=False) as books:
            drive(f"ws://{HOST}:{port}", embedded, steps, books=books)
    finally:
        servers[-1].close()
    assert [one.status for one in answers] == ["delivered", "unreachable", "delivered"]
    assert verify(log).ok
    records = [record.body for _, record in read_records(log)]
    assert "real vehicle over rosbridge" in records[0]["drive"]
    written = [one["link"] for one in records if one.get("event") == "link"]
    assert "up" in written[: written.index("connecting", 1)]
    assert written[-1] == "up"
    assert [one["outcome"] for one in records if "took_s" in one] == ["delivered", "unreachable", "delivered"]


def test_a_way_that_takes_nothing_is_said_and_a_rise_is_taken_back(bridge: Bridge, embedded: Planner) -> None:
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

    told = drive(bridge.url, embedded, steps)
    eventually(lambda: len(caps(bridge)) == 4)
    assert [one.status for one in answers] == ["delivered", "unconfirmed", "unconfirmed"]
    assert "taken back to 5.6 m/s" in answers[1].words
    assert "stays the newest" in answers[2].words
    assert caps(bridge) == [pytest.approx(each, abs=0.1) for each in (20.0, 30.0, 20.0, 10.0)]
    assert "10" in said(told, "late")[0]


def test_limits_of_the_interface_hold_whatever_was_checked(bridge: Bridge, embedded: Planner) -> None:
    """The border's own refusal is an answer like any other."""
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, told: list[DriveEvent]) -> None:
        await road.reached(10.0)
        car, stricter = road._vehicle, parse_settings(TEXT.format(url=bridge.url).replace("10.0", "2.0")).stack

        class Stricter:
            def __getattr__(self, name: str) -> Any:
                return getattr(car, name)

            def apply(self, parameters: Parameters) -> Any:
                checked(parameters, stricter.limits)
                return car.apply(parameters)

        road._vehicle = Stricter()  # type: ignore[assignment]
        answers.append(await road.ask("Drive at 20 km/h."))
        assert road.asked is None

    drive(bridge.url, embedded, steps)
    assert not bridge.published
    assert answers[0].status == "refused"
    assert "allows 0 to 2 m/s" in answers[0].words
