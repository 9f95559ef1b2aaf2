"""Leaderboard 1.0 as a benchmark: what is driven in a worker, and what is said of what cannot be."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.leaderboard.artefacts import OFFICIAL, write_artefacts
from chauffeur.bench.leaderboard.benchmark import LeaderboardBenchmark
from chauffeur.bench.leaderboard.own_routes import own_routes, routes_through
from chauffeur.bench.leaderboard.rollout import RouteJob, traffic_of
from chauffeur.bench.leaderboard.routes import LeaderboardRoute
from chauffeur.concept import ConfigError, DataError
from chauffeur.geometry import Pose
from chauffeur.worlds.town import library
from chauffeur.worlds.town.library import OWN_TOWNS, load
from chauffeur.worlds.town.sumo import Sumo

NOWHERE = """<routes>
<route id="0" town="Nowhere"><waypoint x="0" y="0" yaw="0"/><waypoint x="90" y="0" yaw="0"/></route>
<route id="1" town="Gridford"><waypoint x="0" y="0" yaw="0"/></route>
</routes>"""


def drive(driver: str, limit_s: float = 12.0, seed: int = 3) -> dict[str, Any]:
    routes, triggers = own_routes(("Gridford",))
    route = routes.routes[0]
    return RouteJob("k", route, triggers.towns["Gridford"], driver, seed, 1.0, limit_s=limit_s).run()


@pytest.fixture(scope="module")
def expert() -> dict[str, Any]:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    return drive("expert")


def test_a_route_is_driven_until_its_time_is_out(expert: dict[str, Any]) -> None:
    assert expert["engine"].startswith("sumo-2d")
    assert expert["status"] == "Failed - Agent timed out"
    assert expert["simulated_s"] == pytest.approx(12.05)
    assert 0.005 < expert["completion"] < 0.5
    assert not expert["infra_failed"]
    assert len(expert["path"]) == 13


def test_the_same_seed_gives_the_same_result_to_the_last_bit(expert: dict[str, Any]) -> None:
    again = drive("expert")
    assert json.dumps(again | {"cpu_s": 0}) == json.dumps(expert | {"cpu_s": 0})


def test_who_stands_gets_nowhere() -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    found = drive("standing", 3.0)
    assert found["completion"] == 0.0
    assert [one["kind"] for one in found["infractions"]] == ["route_timeout"]


@pytest.mark.parametrize(("deaths", "status"), [(1, "Failed - Agent timed out"), (2, "Failed - Simulation crashed")])
def test_an_engine_that_dies_is_started_again_once_and_then_scored_as_far_as_it_came(
    deaths: int, status: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    libsumo = pytest.importorskip("libsumo", reason="needs the extra `town`")
    step, left = Sumo.step, [deaths]

    def dies(engine: Sumo) -> None:
        if left[0] and libsumo.simulation.getTime() > 4.0:
            left[0] -= 1
            libsumo.close()  # what follows raises the library's own error, as after any fault of its own
        step(engine)

    monkeypatch.setattr(Sumo, "step", dies)
    found = drive("expert", 6.0)
    assert found["status"] == status
    assert found["infra_failed"] == (deaths == 2)
    assert "died at 4" in found["detail"]
    bench = LeaderboardBenchmark("own", seeds=1, towns="Gridford", limit=1)
    (item,) = bench.items()
    (row,) = bench.rows(ItemOutcome(item, None, "", found))
    assert 0.0 < row["rc"] < 50.0
    assert row["engine"].startswith("sumo-2d")
    official = json.loads(write_artefacts(tmp_path, bench, [row], {item.id: found})[0].read_text())
    assert official["_checkpoint"]["records"][0]["scores"]["score_route"] == pytest.approx(row["rc"])
    monkeypatch.undo()
    assert drive("standing", 3.0)["status"] == "Failed - Agent timed out", "the next route goes on"


def test_a_missing_town_and_a_malformed_route_are_said_and_scored_nothing(tmp_path: Path) -> None:
    file = tmp_path / "routes.xml"
    file.write_text(NOWHERE)
    bench = LeaderboardBenchmark(str(file), "none", seeds=1)
    rows: list[Any] = []
    results: dict[str, Any] = {}
    for item in bench.items():
        results[item.id] = bench.job(item, None).run()
        rows += bench.rows(ItemOutcome(item, None, "", results[item.id]))
    assert [row["status"] for row in rows] == ["Failed - Route cannot be set up", "Failed - Malformed route"]
    assert [row["ds"] for row in rows] == [0.0, 0.0]
    assert "Nowhere" in rows[0]["detail"]
    assert "1 waypoints" in rows[1]["detail"]
    assert not any(row["infra_failed"] for row in rows)
    (official,) = write_artefacts(tmp_path, bench, rows, results)
    assert official.name == OFFICIAL
    assert json.loads(official.read_text())["_checkpoint"]["progress"] == [2, 2]


def test_a_drive_leaves_a_map_of_its_route(expert: dict[str, Any], tmp_path: Path) -> None:
    bench = LeaderboardBenchmark("own", seeds=1, towns="Gridford", limit=1)
    (item,) = bench.items()
    (row,) = bench.rows(ItemOutcome(item, None, "", expert))
    assert row["town"] == "Gridford"
    assert row["route_timeout"] == 1
    written = write_artefacts(tmp_path, bench, [row], {item.id: expert})
    drawing = written[1].read_text()
    assert drawing.startswith("<svg")
    assert "out of time" in drawing
    assert expert["engine"] in drawing


def test_a_route_is_driven_again_once_its_town_is_there_or_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What was said of a missing town is no result that a repeated command may go by."""
    monkeypatch.setattr(library, "maps_folder", lambda: tmp_path / "maps")
    (tmp_path / "routes.xml").write_text(NOWHERE)

    def key() -> str:
        bench = LeaderboardBenchmark(str(tmp_path / "routes.xml"), scenarios="none", seeds=1)
        return bench.job(bench.items()[0], None).key

    missing = key()
    shutil.copytree(OWN_TOWNS / "Gridford", tmp_path / "maps" / "Nowhere")
    there = key()
    shutil.rmtree(tmp_path / "maps" / "Nowhere")
    shutil.copytree(OWN_TOWNS / "Oldbridge", tmp_path / "maps" / "Nowhere")
    assert len({missing, there, key()}) == 3


def test_towns_are_named_as_people_write_lists_and_an_unknown_one_is_refused() -> None:
    bench = LeaderboardBenchmark("own", seeds=1, towns="Gridford, Ringstead")
    assert {item.town for item in bench.items()} == {"Gridford", "Ringstead"}
    with pytest.raises(ConfigError, match="Gridfrod") as error:
        LeaderboardBenchmark("own", seeds=1, towns="Gridford,Gridfrod")
    assert "Ringstead" in error.value.hint


def test_own_routes_are_the_same_every_time_and_lie_in_all_own_towns() -> None:
    one, marks = own_routes()
    town = one.routes[0].town
    drawn, triggers = routes_through(town, load(town).road)
    assert tuple(drawn) == tuple(route for route in one.routes if route.town == town)
    assert triggers == marks.towns[town]
    assert len({route.town for route in one.routes}) >= 5
    assert {trigger.scenario for found in marks.towns.values() for trigger in found} == {1, 3, 4, 7}
    assert all(marks.towns[route.town] for route in one.routes)


def test_jobs_differ_by_all_that_decides_them() -> None:
    onboard = {"planner": "onboard", "latency_s": 0.1}
    runs: tuple[dict[str, Any], ...] = (
        {}, {"planner": "reckless"}, {"density": 0.5}, onboard, onboard | {"latency_s": 0.2},
        onboard | {"setting": "zero-shot"},
    )  # fmt: skip
    benches = [LeaderboardBenchmark("own", seeds=2, limit=2, **options) for options in runs]
    assert len({bench.job(item, None).key for bench in benches for item in bench.items()}) == 4 * len(runs)


@pytest.mark.parametrize(
    ("given", "seeds"), [(2, [0, 1]), ("2", [0, 1]), ("11,12", [11, 12]), ("11,", [11]), (" 7, 3 ", [7, 3])]
)
def test_seeds_are_counted_or_named(given: int | str, seeds: list[int]) -> None:
    bench = LeaderboardBenchmark("own", seeds=given, limit=1)
    assert [item.seed for item in bench.items()] == seeds


@pytest.mark.parametrize(
    "options",
    [
        {"planner": "nobody"}, {"scenarios": "eleven"}, {"towns": "Atlantis"}, {"scoring": "lb9"}, {"density": -1.0},
        {"seeds": 0}, {"seeds": "11,11"}, {"seeds": "-1"}, {"seeds": "a,b"}, {"seeds": ""},
        {"planner": "onboard", "setting": "by-heart"}, {"planner": "onboard", "repository": "."},
        {"planner": "onboard", "latency_s": -1.0},
    ],
)  # fmt: skip
def test_options_that_cannot_be_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        LeaderboardBenchmark(**options)


def test_a_missing_trigger_file_is_said(tmp_path: Path) -> None:
    file = tmp_path / "routes.xml"
    file.write_text(NOWHERE)
    with pytest.raises(DataError, match="trigger file"):
        LeaderboardBenchmark(str(file))


def test_traffic_is_the_official_number_where_the_lanes_are_long_enough() -> None:
    assert traffic_of("Town04", 25.0, 1.0) == 200
    assert traffic_of("Town02", 4.0, 1.0) == 32
    assert traffic_of("Town02", 4.0, 0.5) == 16


def test_a_route_that_came_from_another_map_is_said() -> None:
    route = LeaderboardRoute("9", "Gridford", (Pose(5e3, 5e3, 0.0), Pose(5e3, 5e3, 0.0)))
    assert RouteJob("k", route, (), "expert", 0, 1.0).run()["status"] == "Failed - Route cannot be set up"
