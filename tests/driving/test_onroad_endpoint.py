"""Wishes for a vehicle by way of a language model behind an endpoint: what it is told, and what it cannot do."""

from __future__ import annotations

import asyncio
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "planners"))

from server import ModelServer, silent, stream

from chauffeur.describe.services import Sources, read_sources
from chauffeur.driving.onroad.answers import OnRoadAnswer
from chauffeur.driving.onroad.session import VehicleSession
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.ros.factory import open_vehicle
from chauffeur.worlds.ros.settings import parse_settings

pytestmark = pytest.mark.server

FILE = 'interface = "rosbridge"\nstack = "autoware.ai"\n[limits]\nmax_speed_mps = 10.0\n'
GOOD = {"thoughts": "Slower.", "velocity_kmh": 20.0, "lookahead_distance_m": 12.0, "lookahead_ratio_s": 2.0}


@pytest.fixture
def server() -> Iterator[ModelServer]:
    running = ModelServer()
    yield running
    running.close()


def ask(server: ModelServer, folder: Path, *wishes: str) -> list[OnRoadAnswer]:
    path = folder / "services.toml"
    path.write_text('region = "germany"\n[position]\nat = [48.1371, 11.5754]\n')
    settings = parse_settings(FILE)

    async def whole() -> list[OnRoadAnswer]:
        planner = make_planner("talk2drive/openai/m", base_url=server.url)
        async with (
            Sources(read_sources(path)) as sources,
            VehicleSession(open_vehicle(settings, dry_run=True), settings, planner, sources=sources) as road,
        ):
            return [await road.ask(wish) for wish in wishes]

    return asyncio.run(whole())


def test_a_model_is_told_of_the_vehicle_and_not_where_it_is(server: ModelServer, tmp_path: Path) -> None:
    server.script(stream(json.dumps(GOOD)))
    (answer,) = ask(server, tmp_path, "Slower, please.")
    assert answer.status == "dry-run"
    assert answer.published is not None
    assert answer.published.messages[0].fields["velocity_max"] == pytest.approx(20.0)
    system, user = server.requests[0].body["messages"]
    assert "Never faster than 36 km/h" in system["content"]
    assert "How fast the vehicle drives is not known" in user["content"]
    assert "Speed limit: not known (no map is loaded)." in user["content"]
    assert "(Source: rules of Germany" in user["content"]
    assert "48.1" not in user["content"]
    assert "11.5" not in user["content"]


@pytest.mark.parametrize(
    ("changed", "status"),
    [
        ({"velocity_kmh": 80.0}, "refused"),
        ({"lane": "left"}, "refused"),
        ({"refusal": "I would rather not."}, "declined"),
        ({"engage": True}, "declined"),  # no such field: the answer is unusable
        ({"velocity_kmh": None}, "declined"),
    ],
)
def test_what_a_model_cannot_do(server: ModelServer, tmp_path: Path, changed: dict[str, object], status: str) -> None:
    server.script(*[stream(json.dumps(GOOD | changed))] * 2)
    (answer,) = ask(server, tmp_path, "Do it.")
    assert (answer.status, answer.published) == (status, None), answer.words


def test_a_stop_does_not_wait_for_a_model(server: ModelServer) -> None:
    server.script(silent(20.0))
    settings = parse_settings(FILE)

    async def whole() -> tuple[OnRoadAnswer, OnRoadAnswer]:
        planner = make_planner("talk2drive/openai/m", base_url=server.url)
        async with VehicleSession(open_vehicle(settings, dry_run=True), settings, planner) as road:
            slow = asyncio.create_task(road.ask("Slower, please."))
            while not server.requests:
                await asyncio.sleep(0.005)
            return await road.ask("stop"), await slow

    stop, slow = asyncio.run(whole())
    assert (stop.status, slow.status) == ("dry-run", "superseded")
