"""CARLA's world against a stand-in that the town plays, in the client library's own value classes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("carla")
pytest.importorskip("libsumo")
pytest.importorskip("sumo")

from carla_stand_in import StandInClient, StandInWorld
from world_contract import WorldContract

from chauffeur.concept import Command, Scenario, ScenarioError
from chauffeur.geometry import Pose
from chauffeur.worlds.base import Stage
from chauffeur.worlds.carla import CarlaWorld, server
from chauffeur.worlds.carla.server import SERVER_VARIABLE, address, connect, lacks
from chauffeur.worlds.conformance import MakeWorld
from chauffeur.worlds.town.build import build, sources_of
from chauffeur.worlds.town.pack import MapPack


@pytest.fixture(scope="module")
def town(carla_data: Path, tmp_path_factory: pytest.TempPathFactory) -> MapPack:
    return build(sources_of(carla_data / "maps" / "Town02.xodr"), folder=tmp_path_factory.mktemp("maps") / "Town02")


@pytest.fixture
def client(town: MapPack) -> Iterator[StandInClient]:
    client = StandInClient(StandInWorld(town, 15))
    yield client
    client.world.town.close()


def start_of(town: MapPack, metres: float = 10.0) -> tuple[str, float]:
    lane = next(one for one in town.road.lanes if one.kind == "driving" and not one.junction and one.length_m > 80.0)
    return lane.id, metres


def scenario(town: MapPack, **config: object) -> Scenario:
    return Scenario("c", "carla", {"town": town.name, "start": start_of(town), "vehicles": 0, **config}, 5)


class TestContract(WorldContract):
    known = ("capabilities",)
    """It says places, as the town does, and goes to the goal of its scenario alone."""

    @pytest.fixture
    def tried(self, client: StandInClient, town: MapPack) -> tuple[MakeWorld, Scenario]:
        return lambda: CarlaWorld(client), scenario(town)


def test_it_has_a_stage(client: StandInClient, town: MapPack) -> None:
    world = CarlaWorld(client)
    world.reset(scenario(town))
    assert isinstance(world, Stage)
    assert world.engine == "carla-0.9.16"


def test_it_sees_and_drives_what_the_town_shows(client: StandInClient, town: MapPack) -> None:
    world = CarlaWorld(client)
    world.reset(scenario(town))
    driver = world.driver()
    for _ in range(200):
        world.step(driver.command(driver.settle(driver.initial_setpoints())))
    seen, truth = world.observe(), client.world.town.observe()
    assert truth.ego.speed_mps > 0.0 or any(one.state != "green" for one in truth.signals)
    for name in ("x_m", "y_m", "speed_mps", "length_m", "width_m", "yaw_rate_radps"):
        assert getattr(seen.ego, name) == pytest.approx(getattr(truth.ego, name), abs=2e-3)
    assert seen.ego.lane == truth.ego.lane
    near = {(round(one.x_m, 1), round(one.y_m, 1)) for one in truth.others}
    assert {(round(one.x_m, 1), round(one.y_m, 1)) for one in seen.others} <= near
    shown = {one.id: (one.state, one.lanes) for one in truth.signals}
    assert seen.signals
    assert all(shown[one.id] == (one.state, one.lanes) for one in seen.signals if one.id in shown)


def test_contacts_are_told_and_end_the_trip(client: StandInClient, town: MapPack) -> None:
    client.world.vehicles = 0
    world = CarlaWorld(client)
    world.reset(scenario(town))
    lane, _ = start_of(town)
    actor = world.spawn("static", town.road[lane].centre.at(25.0))
    for _ in range(200):
        world.step(Command(3.0, 0.0))
        if world.ended:
            break
    assert world.observe().ego.crashed
    assert [one.id for one in world.observe().others if one.crashed] == [actor]


def test_the_stage_moves_and_removes(client: StandInClient, town: MapPack) -> None:
    client.world.vehicles = 0
    world = CarlaWorld(client)
    world.reset(scenario(town))
    lane, _ = start_of(town)
    place = town.road[lane].centre.at(40.0)
    actor = world.spawn("pedestrian", place)
    world.drive(actor, Pose(place.x_m + 1.0, place.y_m, 0.3), 1.0)
    world.step(Command(0.0, 0.0))
    one = world.perception().vehicle(actor)
    assert (one.kind, one.x_m, one.heading_rad) == (
        "pedestrian",
        pytest.approx(place.x_m + 1.0, abs=1e-3),
        pytest.approx(0.3, abs=1e-3),
    )
    world.remove(actor)
    world.remove(actor)
    world.step(Command(0.0, 0.0))
    assert world.observe().others == ()


def test_a_server_that_dies_or_lacks_something_is_said(client: StandInClient, town: MapPack) -> None:
    assert lacks(client) == ()
    client.server_version, client.maps = "0.9.13", client.maps[:5]
    said = " ".join(lacks(client))
    assert "0.9.13" in said
    assert "Town06" in said
    world = CarlaWorld(client)
    with pytest.raises(ScenarioError, match="Town07"):
        world.reset(Scenario("c", "carla", {**scenario(town).config, "town": "Town07"}, 5))
    world.reset(scenario(town))
    client.world.dies = True
    with pytest.raises(ScenarioError, match="stopped answering"):
        world.step(Command(0.0, 0.0))


@pytest.mark.parametrize("named", ["here", "localhost:abc", ":2000", "localhost:99999", "localhost:0", "localhost:²"])
def test_an_address_that_is_none_is_refused(named: str) -> None:
    with pytest.raises(ScenarioError, match="must be HOST:PORT"):
        address({SERVER_VARIABLE: named})


def test_a_host_that_nobody_knows_is_a_server_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    class Library:
        @staticmethod
        def Client(host: str, port: int) -> None:
            raise RuntimeError("resolve: Host not found (authoritative)")

    monkeypatch.setattr(server, "library", Library)
    monkeypatch.setenv(SERVER_VARIABLE, "nowhere:2000")
    with pytest.raises(ScenarioError, match="No CARLA server answers at nowhere:2000"):
        connect()


def test_no_address_is_the_usual_one() -> None:
    assert address({}) == address({SERVER_VARIABLE: ""}) == ("localhost", 2000)
