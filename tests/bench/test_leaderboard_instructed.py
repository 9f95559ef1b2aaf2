"""Planners on routes of the leaderboard: told by words, late with answers, checked, and learning from the rules."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).resolve().parents[1] / "planners"))
from server import ModelServer, stream

from chauffeur.bench.kernel.benchmark import ItemOutcome
from chauffeur.bench.kernel.report import tables
from chauffeur.bench.leaderboard.benchmark import TABLE_V, LeaderboardBenchmark
from chauffeur.bench.leaderboard.coaching import Apprentice, TownCoach
from chauffeur.bench.leaderboard.instructed import InstructedDriver, PlannerSpec
from chauffeur.bench.leaderboard.own_routes import own_routes
from chauffeur.bench.leaderboard.rollout import RouteJob
from chauffeur.bench.leaderboard.ways import plan_official
from chauffeur.concept import Limits, Plan, PlanRequest, Program, Scenario, Thoughts
from chauffeur.memory.policies import PolicyRepository
from chauffeur.planners.onboard.town import SNIPPETS
from chauffeur.worlds.town.library import load

GO = "def go():\n    while True:\n        yield proceed(check_speed_limit())\n"


@pytest.fixture
def endpoint() -> Iterator[ModelServer]:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    one = ModelServer()
    yield one
    one.close()


def job(endpoint: ModelServer, setting: str, limit_s: float, **spec: object) -> RouteJob:
    file, triggers = own_routes(("Gridford",))
    options = (("base_url", endpoint.url), ("cache", False))
    planner = PlannerSpec("openai/m", setting, latency_s=2.0, options=options, **spec)  # type: ignore[arg-type]
    marks = triggers.towns["Gridford"]
    return RouteJob("k", file.routes[0], marks, "openai/m", 3, 0.2, limit_s=limit_s, shield=True, planner=planner)


@pytest.mark.parametrize(("setting", "examples"), [("zero-shot", False), ("few-shot", True)])
def test_a_model_behind_an_endpoint_drives_by_instructions(endpoint: ModelServer, setting: str, examples: bool) -> None:
    endpoint.script(stream(f"Thoughts: I go.\n\n```python\n{GO}```\n"))
    found = job(endpoint, setting, 8.0).run()
    assert found["planning"]["plans_driven"] == found["planning"]["plans"] == 1
    assert found["planning"]["plan_latency_s"] == 2.0
    assert found["completion"] > 0.0
    assert not found["policy_failed"]
    (at_s, kind, text) = found["told"][0]
    system, user = (one["content"] for one in endpoint.requests[0].body["messages"])
    assert text in user
    assert "I am in a town" in user
    assert "check_front_vehicle" in system
    assert ("# Examples" in system) is examples
    assert at_s == 0.0
    assert kind


def test_what_is_no_program_of_towns_never_drives(endpoint: ModelServer) -> None:
    endpoint.script(stream("```python\ndef go():\n    while True:\n        yield fly(3)\n```\n"))
    found = job(endpoint, "zero-shot", 5.0).run()
    assert found["policy_failed"]
    assert found["planning"]["plans_driven"] == 0
    assert found["completion"] < 0.01
    assert "fly" in found["planning"]["plan_reasons"]


def test_learned_programs_are_offered_and_can_be_called(endpoint: ModelServer, tmp_path: Path) -> None:
    repository = PolicyRepository(tmp_path, create=True)
    lessons = TownCoach(Apprentice(), repository, Limits()).coach(own_routes(("Gridford",))[0].routes[:1], 2)
    assert [one.kept for one in lessons if one.kept] == [entry.callable_name for entry in repository.entries]
    turned = [entry for entry in repository.entries if "turn_" in entry.source]
    assert turned, "a way that is not straight on is only learned from what the evaluator says"
    assert all("asks for the way" in " ".join(entry.critiques) for entry in turned)
    assert all(entry.world == "town" and entry.judged_by == "evaluator" for entry in repository.entries)

    name = turned[0].callable_name
    endpoint.script(stream(f"```python\ndef mine():\n    yield from {name}()\n```\n"))
    found = job(endpoint, "human-feedback", 5.0, repository=str(tmp_path), digest=repository.digest).run()
    assert found["planning"]["plans_driven"] == 1, found["planning"]
    assert f"{name}()" in endpoint.requests[0].body["messages"][0]["content"]


class Scripted:
    """Plans by a list of sources; the last one repeats."""

    id = model = "scripted"

    def __init__(self, *sources: str) -> None:
        self.sources = list(sources)

    async def plan(self, request: PlanRequest) -> Plan:
        del request
        source = self.sources.pop(0) if len(self.sources) > 1 else self.sources[0]
        return Plan(Thoughts("."), Program(source), planner=self.id, model=self.model)


def test_the_car_does_not_wait_for_the_next_plan() -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    from chauffeur.worlds.town import TownWorld

    route = own_routes(("Gridford",))[0].routes[0]
    town = load(route.town)
    planned = plan_official(town, route)
    world = TownWorld()
    config = {"town": "Gridford", "start": (planned.route.lanes[0], planned.route.start_m), "vehicles": 0, "people": 0}
    seen = world.reset(Scenario("x", "town", config, 1))
    fails = "def go():\n    for _ in range(100):\n        yield proceed(5.0)\n    raise ValueError('enough')\n"
    driver = InstructedDriver(
        world, planned, town, PlannerSpec("scripted", latency_s=3.0), 1, planner=Scripted(fails, GO)
    )
    speeds: list[tuple[float, float]] = []
    try:
        while seen.time_s < 24.0 and len(driver.told) < 3:
            world.step(driver.command(seen))
            seen = world.observe()
            speeds.append((seen.time_s, seen.ego.speed_mps))
    finally:
        driver.close()
        world.close()
    assert all(speed < 0.01 for at, speed in speeds if at < 2.9), "nothing was checked yet"
    assert driver.tally.failed == 1
    first, again = (at for at, _ in driver.told[:2])
    assert again - first == pytest.approx(3.0 + 5.0 + 10.0, abs=0.3)
    waiting = [speed for at, speed in speeds if 6.0 < at < min(again + 3.0, speeds[-1][0])]
    assert waiting
    assert max(waiting) > 3.0


def test_without_a_repository_the_programs_that_ship_are_offered(tmp_path: Path) -> None:
    half = (SNIPPETS / "policies.jsonl").read_text("utf-8").splitlines(keepends=True)[::2]
    (tmp_path / "policies.jsonl").write_text("".join(half), "utf-8")
    shipped = LeaderboardBenchmark(planner="onboard", setting="human-feedback").config["planner"]
    given = LeaderboardBenchmark(planner="onboard", setting="human-feedback", repository=str(tmp_path))
    assert PolicyRepository(SNIPPETS).digest in shipped
    assert PolicyRepository(tmp_path).digest in given.config["planner"]


def test_the_papers_rows_never_stand_alone_with_ours() -> None:
    bench = LeaderboardBenchmark(planner="onboard", seeds=1, limit=1, latency_s=0.1)
    item = bench.items()[0]
    result = replace(bench.job(item, None), route=replace(bench.route_of(item), fault="it is no route")).run()
    (row,) = bench.rows(ItemOutcome(item, None, "", json.loads(json.dumps(result))))
    (table,) = tables((TABLE_V,), [row | {"engine": "sumo-2d 1.28"}])
    ours, *printed = table.lines
    assert ours.name == "sumo-2d 1.28" and "CARLA" in table.spec.lead
    assert len(printed) == 5 and all(line.published for line in printed)
