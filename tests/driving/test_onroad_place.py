"""What services know of the place, in C of a wish for a vehicle and in its bounds. Servers on loopback."""

from __future__ import annotations

import asyncio
import re
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "describe"))

from test_services_server import Asked, reply, roads_json, serving

from chauffeur.concept import Parameters, Plan, PlanRequest, Thoughts
from chauffeur.describe.services import Sources, Unknown, read_sources
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

pytestmark = pytest.mark.server

FILE = 'interface = "rosbridge"\nstack = "autoware.ai"\n[limits]\nmax_speed_mps = 10.0\n'
STREET = [(48.137, 11.56), (48.137, 11.59)]


def streets(limit: str) -> Callable[[Asked], bytes | None]:
    def answer(asked: Asked) -> bytes | None:
        if asked.path != "/api/interpreter":
            return None  # silent: the weather service hangs
        return reply(roads_json((7, {"highway": "residential", "name": "High Street", "maxspeed": limit}, STREET)))

    return answer


def drive(
    folder: Path,
    url: str,
    planner: Planner,
    steps: Callable[[VehicleSession, Sources], Awaitable[None]],
    budget_s: float = 5.0,
) -> list[DriveEvent]:
    path = folder / "services.toml"
    path.write_text(
        f'region = "germany"\nonline = ["map"]\nbudget_s = {budget_s}\n'
        f'[position]\nat = [48.137, 11.575]\nheading_deg = 90.0\n[urls]\nmap = "{url}"\nweather = "{url}"\n'
    )
    told: list[DriveEvent] = []
    settings = parse_settings(FILE)

    async def whole() -> None:
        async with (
            Sources(read_sources(path), environ={"OPENWEATHER_API_KEY": "k"}) as sources,
            VehicleSession(
                open_vehicle(settings, dry_run=True), settings, planner, sources=sources, tell=told.append
            ) as road,
        ):
            await steps(road, sources)

    asyncio.run(whole())
    return told


def ask(folder: Path, url: str, planner: Planner, *wishes: str) -> tuple[list[OnRoadAnswer], str]:
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, sources: Sources) -> None:
        for wish in wishes:
            answers.append(await road.ask(wish))

    told = drive(folder, url, planner, steps)
    return answers, next(event.text for event in told if event.kind == "context")


@pytest.fixture(scope="module")
def embedded() -> Planner:
    return make_planner("talk2drive")


def test_the_speed_limit_of_the_map_holds(tmp_path: Path, embedded: Planner) -> None:
    with serving(streets("20")) as service:
        answers, context = ask(
            tmp_path, service.url, embedded, "Drive at 30 km/h.", "Drive at the speed limit.", "Drive at 15 km/h."
        )
    assert [one.status for one in answers] == ["refused", "dry-run", "dry-run"]
    assert "above the speed limit of 20 km/h here" in answers[0].words
    assert answers[1].plan is not None
    assert isinstance(answers[1].plan.policy, Parameters)
    assert answers[1].plan.policy.target_speed_mps == pytest.approx(20 / 3.6, abs=0.01)
    assert re.search(r"Speed limit[^:]*: 20 km/h \(5\.6 m/s\)\. \(Source: OpenStreetMap", context), context
    assert "At most 5.6 m/s (20 km/h) may be asked for, by the speed limit of the map." in context


def test_a_limit_above_the_vehicle_s_changes_nothing(tmp_path: Path, embedded: Planner) -> None:
    with serving(streets("100")) as service:
        answers, context = ask(tmp_path, service.url, embedded, "Drive at 40 km/h.", "Drive at 30 km/h.")
    assert [one.status for one in answers] == ["refused", "dry-run"]
    assert "above the cap of 36 km/h" in answers[0].words
    assert "At most 10.0 m/s (36 km/h) may be asked for, by the limits of vehicle and person." in context


def test_a_limit_that_falls_while_it_is_planned(tmp_path: Path) -> None:
    """The car drives into a slower street before the plan is there: the lower of both limits holds."""
    limits = ["50"]

    async def answer(request: PlanRequest) -> Plan:
        limits[:] = ["20"]
        sources_of[0]._map._kept.clear()  # type: ignore[union-attr]
        await sources_of[0].look(5.0)
        return Plan(Thoughts(""), Parameters(9.0, 8.0, 2.0))

    class Late:
        id = model = "late"

        async def plan(self, request: PlanRequest) -> Plan:
            return await answer(request)

    sources_of: list[Any] = []
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, sources: Sources) -> None:
        sources_of.append(sources)
        answers.append(await road.ask("Drive."))

    def street(asked: Asked) -> bytes | None:
        return streets(limits[0])(asked)

    with serving(street) as service:
        drive(tmp_path, service.url, Late(), steps)
    assert answers[0].status == "refused"
    assert "20 km/h" in answers[0].words


def test_services_that_hang_cost_their_budget_and_are_said(tmp_path: Path, embedded: Planner) -> None:
    answers: list[OnRoadAnswer] = []

    async def steps(road: VehicleSession, sources: Sources) -> None:
        answers.append(await road.ask("Drive at 20 km/h."))

    with serving(lambda asked: None) as service:
        told = drive(tmp_path, service.url, embedded, steps, budget_s=0.05)
    assert answers[0].status == "dry-run"
    context = next(event.text for event in told if event.kind == "context")
    assert "Speed limit: not known (the service did not answer within 0.05 s)." in context


def test_sources_that_break_are_said(tmp_path: Path, embedded: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    async def broken(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError

    async def steps(road: VehicleSession, sources: Sources) -> None:
        monkeypatch.setattr(sources, "around", broken)
        found = await sources.look()
        assert isinstance(found, Unknown)
        assert (await road.ask("Drive at 20 km/h.")).status == "dry-run"

    told = drive(tmp_path, "http://127.0.0.1:9", embedded, steps)
    context = next(event.text for event in told if event.kind == "context")
    assert "not known (the sources failed (ZeroDivisionError))" in context
