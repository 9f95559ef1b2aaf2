"""Goldens: what planners answer, drives do and benchmarks say today, beside what they did when it was recorded.

A change that is meant to keep behaviour runs this first and last; every difference is shown and wants a reason.

    python benchmarks/goldens/run.py                    # compare with what is recorded here
    python benchmarks/goldens/run.py --part answers     # one part alone
    python benchmarks/goldens/run.py --record           # what is found today becomes the golden

Parts (`PARTS`): the answers of the embedded planners to the sets of wishes; a drive for each world, executor and
filter; rows of every benchmark that runs from this repository's data; the tables of one report. LaMPilot's rows need
its data (`--data` or CHAUFFEUR_LAMPILOT). Rows are compared without times, tokens and versions (`VOLATILE`).
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Any, Final

from chauffeur.api import run_benchmark
from chauffeur.bench.kernel.benchmark import make_benchmark
from chauffeur.concept import ChauffeurError, Context, Instruction, Limits, PersonId, Plan, Policy, Scenario
from chauffeur.concept.data import read_data
from chauffeur.describe import describe
from chauffeur.driving.episode import make_world
from chauffeur.driving.judge.choice import referee_for
from chauffeur.driving.scenarios import find
from chauffeur.driving.session import Session
from chauffeur.planners.registry import make_planner

HERE: Final = Path(__file__).parent
VOLATILE: Final = frozenset({
    "latency_s", "wall_s", "plan_s", "seconds", "usage", "cached", "machine", "versions", "code", "key", "model",
})  # fmt: skip
"""Fields that differ from run to run, or with a release, though nothing else does."""
TOWN_STEP: Final = 12
"""Every so many of the town's sentences are asked: some eighty."""
PLANNERS: Final = (("onboard", 1), ("talk2drive", 1), ("meaning", 5), ("keyword", 5))
"""(planner, every so many wishes): the two that ship drive by all, their yardsticks by a fifth."""
_TEXT_CHARS: Final = 40
"""Longer texts of rows are kept as their hashes."""

Row = dict[str, Any]


def digest(value: Any) -> str:
    """Hash of a value's canonical JSON, 12 digits."""
    text = json.dumps(value, sort_keys=True, default=_plain, ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _plain(value: Any) -> Any:
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else str(value)


def answer_of(plan: Plan) -> Row:
    """A plan in short: what was understood, whether it asks or declines, and a hash of its policy and words."""
    policy: Policy | None = plan.policy
    return {
        "intent": plan.intent,
        "answer": "asks" if plan.offer else "declines" if plan.refusal else "drives" if policy is not None else "says",
        "policy": "" if policy is None else f"{type(policy).__name__} {digest(policy)}",
        "words": digest([plan.thoughts.text, plan.refusal, plan.offer]),
    }


# Parts ----------------------------------------------------------------------------------------------------------------


@dataclass
class _Desk:
    """What a benchmark needs to make a request."""

    contexts: dict[str, Context]

    async def context(self, scenario: Scenario) -> Context:
        """C of a scene, described once."""
        found = self.contexts.get(scenario.id)
        if found is None:
            found = self.contexts[scenario.id] = describe(make_world(scenario).reset(scenario))
        return found

    async def ask(self, request: Any) -> None:
        """No earlier turn is asked for here."""
        del request


def answers() -> Iterator[Row]:
    """Answers of every embedded planner of programs and set-points to passengers' and hostile wishes, and in a town."""
    for planner, step in PLANNERS:
        for name in ("passengers", "hostile"):
            yield from asyncio.run(_asked(name, planner, step))
    yield from asyncio.run(_in_town("onboard"))


async def _asked(name: str, spec: str, step: int) -> list[Row]:
    benchmark, planner = make_benchmark(name, planner=spec), make_planner(spec)
    desk, rows = _Desk({}), []
    for item in benchmark.items()[::step]:
        try:
            found = answer_of(await planner.plan(await benchmark.request(item, desk)))  # type: ignore[arg-type]
        except ChauffeurError as error:
            found = {"error": type(error).__name__}
        rows.append({"key": f"{name}/{spec}/{item.id}", **found})
    return rows


async def _in_town(spec: str) -> list[Row]:
    scene, rows = find("town"), []
    session = Session(planner=make_planner(spec))
    lines = read_data("sorters", "town.tsv").decode().splitlines()[::TOWN_STEP]
    for number, line in enumerate(lines):
        wish = Instruction(line.split("\t")[1], person=PersonId(""))
        try:
            request = await session.request(wish, scene, scene.seed, Limits())
            found = answer_of(await session.planner.plan(request))
        except ChauffeurError as error:
            found = {"error": type(error).__name__}
        rows.append({"key": f"town/{spec}/{number * TOWN_STEP}", **found})
    return rows


DRIVES: Final = (
    ("overtake", "onboard", "Overtake the car in front of you."),
    ("following", "talk2drive", "Leave a bit more room to the car ahead."),
    ("emergency-lane", "onboard", "Pull over on the shoulder, please."),
    ("intersection", "onboard", "Turn left at the intersection."),
    ("intersection", "talk2drive", "Turn left at the intersection."),
    ("parking", "talk2drive", "Park in the nearest free spot."),
    ("parking-lift", "vilad", "Park close to the lift, away from other cars."),
    ("open-road", "vilad", "Turn left and stop near the crosswalk."),
    ("track-lane-change", "gains", "Change lanes, please, nothing special."),
    ("track-left-turn", "vlm", "I'm late, but it is slippery."),
    ("town", "onboard", "Take me to the station."),
)
"""(scenario, planner, wish): each world with each kind of policy that is driven in it."""


def drives() -> Iterator[Row]:
    """One drive a world and kind of policy, with the safety filter and without it."""
    for scenario, planner, wish in DRIVES:
        for filtered in (True, False):
            yield {
                "key": f"{scenario}/{planner}/{'filter' if filtered else 'bare'}",
                **_driven(scenario, planner, wish, filtered),
            }


def _driven(scenario: str, planner: str, wish: str, filtered: bool) -> Row:
    place = find(scenario)
    try:
        session = Session(planner=make_planner(planner), referee=referee_for, shielded=filtered)
        recorded = asyncio.run(session.drive(Instruction(wish, person=PersonId("")), place, place.seed, Limits()))
    except ChauffeurError as error:
        return {"error": f"{type(error).__name__}: {error}"}
    poses = [
        (round(one.x_m, 6), round(one.y_m, 6), round(one.speed_mps, 6))
        for one in (frame.observation.ego for frame in recorded.frames)
    ]
    applied = [frame.applied for frame in recorded.frames]
    commands = [(round(one.acceleration_mps2, 6), round(one.steering_rad, 6)) for one in applied]
    return {
        "outcome": recorded.trip.outcome,
        "refused_by": [one.check for one in recorded.trip.verdicts if one.vetoes and not one.passed],
        "ticks": len(recorded.frames),
        "ends": poses[-1] if poses else (),
        "poses": digest(poses),
        "commands": digest(commands),
        **{"plan_" + name: value for name, value in answer_of(recorded.trip.plan).items()},
    }


BENCHES: Final[tuple[tuple[str, str, dict[str, Any]], ...]] = (
    ("lampilot", "onboard", {"items": 40}),
    ("lampilot", "meaning", {"items": 40}),
    ("hostile", "onboard", {"items": 2}),
    ("faithfulness", "onboard", {"items": 20}),
    ("instructions", "vilad", {"count": 5}),
    ("motion", "vlm", {}),
    ("motion-passengers", "vlm", {"passengers": 1, "trips": 2}),
    ("personalization", "talk2drive", {"passengers": 1, "trips": 2}),
)
"""(benchmark, planner, options): some twenty rows of each that runs from this repository's data."""
_ROWS: Final = 20


def rows(data: str) -> Iterator[Row]:
    """Rows of small runs of the benchmarks."""
    for name, planner, options in BENCHES:
        where: dict[str, Any] = {}
        if name == "lampilot":
            if not data:
                continue
            where = {"data": data}
        folder = Path(tempfile.mkdtemp(prefix="goldens-"))
        try:
            found = run_benchmark(name, planner, out=folder, workers=1, **options, **where)
        except ChauffeurError as error:
            yield {"key": f"{name}/{planner}", "error": f"{type(error).__name__}: {error}"}
            continue
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        for number, row in enumerate(found[:_ROWS]):
            yield {"key": f"{name}/{planner}/{number:02d}", **_steady(row)}


def _steady(row: Any) -> Any:
    if is_dataclass(row) and not isinstance(row, type):
        row = asdict(row)
    if isinstance(row, dict):
        return {name: _steady(value) for name, value in row.items() if name not in VOLATILE}
    if isinstance(row, list | tuple):
        return [_steady(one) for one in row]
    if isinstance(row, str) and len(row) > _TEXT_CHARS:
        return digest(row)
    return round(row, 9) if isinstance(row, float) else row


def report(data: str) -> Iterator[Row]:
    """The tables of a report over one run, a row a line of text."""
    if not data:
        return
    from typer.testing import CliRunner

    from chauffeur.cli.main import app

    folder = Path(tempfile.mkdtemp(prefix="goldens-"))
    try:
        run, told = str(folder / "run"), str(folder / "report")
        CliRunner().invoke(app, ["bench", "lampilot", "--data", data, "--items", "40", "--out", run])
        CliRunner().invoke(app, ["report", run, "--out", told, "--gallery", "0"])
        for page in sorted((folder / "report").rglob("*.md")):
            lines = [line for line in page.read_text().splitlines() if line.startswith("|")]
            for number, line in enumerate(lines):
                yield {"key": f"{page.name}/{number:03d}", "line": re.sub(r"\s+", " ", line)}
    finally:
        shutil.rmtree(folder, ignore_errors=True)


PARTS: Final = ("answers", "drives", "rows", "report")


# Comparing ------------------------------------------------------------------------------------------------------------


def load(path: Path) -> dict[str, Row]:
    """Recorded rows by key."""
    if not path.exists():
        return {}
    return {row["key"]: row for row in map(json.loads, path.read_text().splitlines())}


def compare(before: dict[str, Row], after: dict[str, Row], shown: int) -> bool:
    """Print what differs, fields first, then the first rows. Returns whether nothing does."""
    changed: list[tuple[str, list[str]]] = []
    for key in sorted(before.keys() & after.keys()):
        a, b = before[key], after[key]
        fields = sorted(name for name in a.keys() | b.keys() if a.get(name) != b.get(name))
        if fields:
            changed.append((key, fields))
    gone, new = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
    print(f"  {len(before)} recorded, {len(after)} found: {len(changed)} differ, {len(gone)} gone, {len(new)} new")
    groups: dict[tuple[str, str], int] = {}
    for key, fields in changed:
        for name in fields:
            group = "/".join(key.split("/")[:2]), name
            groups[group] = groups.get(group, 0) + 1
    for (group, name), count in sorted(groups.items()):
        print(f"    {group:<32} {name:<14} {count}")
    for key, fields in changed[:shown]:
        print(
            f"    {key}: "
            + "; ".join(f"{name} {before[key].get(name)!r} -> {after[key].get(name)!r}" for name in fields)[:400]
        )
    for word, keys in (("gone", gone), ("new", new)):
        if keys:
            print(f"    {word}: {', '.join(keys[:shown])}")
    return not (changed or gone or new)


def main() -> int:
    """Record or compare. Exit code 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", action="append", choices=PARTS, help="only this part; may come again")
    parser.add_argument("--record", action="store_true", help="what is found becomes the golden")
    parser.add_argument("--data", default=os.environ.get("CHAUFFEUR_LAMPILOT", ""), help="LaMPilot's DbLv1 folder")
    parser.add_argument("--show", type=int, default=20, help="rows shown of each part (default 20)")
    asked = parser.parse_args()
    same = True
    for part in asked.part or PARTS:
        begun = time.monotonic()
        found: Iterable[Row] = {
            "answers": answers,
            "drives": drives,
            "rows": lambda: rows(asked.data),
            "report": lambda: report(asked.data),
        }[part]()
        after = {row["key"]: json.loads(json.dumps(row, default=_plain)) for row in found}
        path = HERE / f"{part}.jsonl"
        print(f"{part} ({time.monotonic() - begun:.0f} s)", flush=True)
        if asked.record:
            path.write_text(
                "".join(json.dumps(row, ensure_ascii=False, sort_keys=True) + "\n" for row in after.values())
            )
            print(f"  {len(after)} recorded")
        else:
            same &= compare(load(path), after, asked.show)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
