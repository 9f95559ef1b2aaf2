"""The benchmark: stage, read, ground, compose, check, drive, judge by the labels; a row a command and reader.

`labels` are people's readings, driven by the same composer: what is missing there is missing in grounding, composing or
driving, not in reading. `blind` hears nothing and drives on: what is whole there any careful driver does. Any other
reader is a planner, which gets the words alone.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal, cast

from chauffeur.bench.kernel.benchmark import ItemOutcome, Unasked
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import TableSpec, count, mean, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.realization.highway import highway_scenario
from chauffeur.bench.realization.stage import stage_of
from chauffeur.concept import (
    ChauffeurError,
    ConfigError,
    DataError,
    Instruction,
    Limits,
    Plan,
    Program,
    Scenario,
    ScenarioError,
    SystemMessage,
    Thoughts,
)
from chauffeur.concept.data import data_folder
from chauffeur.concept.utterance import Act, Reference, Utterance, acts_from_json
from chauffeur.describe import describe
from chauffeur.driving.episode import drive_policy, make_world
from chauffeur.driving.judge.referee import ActsReferee
from chauffeur.driving.planning import checked, screened_request
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.meaning import MeaningPlanner
from chauffeur.planners.meaning.compose import references_of
from chauffeur.planners.registry import make_planner
from chauffeur.safety.checks import DEFAULT_CHECKS
from chauffeur.worlds.town import TownWorld

VERSION: Final = "realization-v4"
"""Stage, judge and rollout together; changes whenever the same command could give another row."""
LABELS, BLIND = "labels", "blind"
_ON: Final[Mapping[str, str]] = {
    "town": "def go():\n    while True:\n        yield proceed(check_speed_limit())\n",
    "highway": "def go():\n    while True:\n        yield autopilot()\n",
}
"""Plan that the blind reader drives, whatever was said."""
WORLDS: Final = tuple(_ON)
MAX_S: Final = 120.0
"""Simulated time of a drive: red lights, a crossing and three junctions."""
_NOTE: Final = "simulated drives (SUMO), staged scenes; judged by people's labels over the geometry of the drive"
_MOST_BYTES: Final = 4_000_000

Came = Literal["whole", "part", "none", "opposite", "asked", "declined", "failed"]


@dataclass(frozen=True, slots=True)
class RealizationItem:
    """A command to be read by one reader.

    Attributes:
        id: Of command and reader.
        command: The command's own id.
        text: The words.
        acts: What people say that they mean, in written form.
        reader: `labels`, `blind`, or a planner.
        set: Of the command: the name of its file.
        world: In which it is staged.
    """

    id: str
    command: str
    text: str
    acts: tuple[Any, ...]
    reader: str
    set: str
    world: str


@dataclass(frozen=True, slots=True)
class RealizationJob:
    """A command to stage, plan, drive and judge."""

    key: str
    item: RealizationItem

    @property
    def near(self) -> str:
        """See BenchJob."""
        return self.item.command

    def run(self) -> Row:
        """See BenchJob."""
        try:
            return {"key": self.key, "infra_failed": False, **_driven(self.item)}
        except ChauffeurError as error:
            return self.spoiled(str(error))

    def spoiled(self, detail: str) -> Row:
        """See BenchJob."""
        return {"key": self.key, "infra_failed": True, "detail": detail}


def _driven(item: RealizationItem) -> Row:
    acts = acts_from_json(item.acts)
    staged = _staged(acts, item.world, item.command)
    assert staged is not None, item.id
    scenario, referents = staged
    world = make_world(scenario)
    try:
        seen = world.reset(scenario)
        request = screened_request(Instruction(item.text), describe(seen), SystemMessage(""), observation=seen)
        plan: Plan
        if item.reader == LABELS:
            plan = MeaningPlanner().plan_of(Utterance(item.text, acts), request)
        elif item.reader == BLIND:
            plan = Plan(Thoughts("I drive on."), Program(_ON[item.world]), planner=BLIND)
        else:
            plan = asyncio.run(make_planner(item.reader).plan(request))
        found = checked(plan, seen, Limits(), DEFAULT_CHECKS)
        if found.refusal or plan.policy is None:
            came: Came = "asked" if plan.intent == "ask" else "declined"
            return _undriven(came, found.refusal, plan.latency_s)
        ids = (
            {one: tuple(world.staged[k] for k in places) for one, places in referents.items()}
            if isinstance(world, TownWorld)
            else None
        )
        referee = ActsReferee(world, acts, "labels", ids)
        try:
            episode = drive_policy(world, plan.policy, referee, MAX_S, Limits())
        except ScenarioError as error:  # known only when the policy meets the world
            return _undriven("declined", str(error), plan.latency_s)
        judged = [{"act": one.act.act, "result": one.result, "why": one.why} for one in referee.judged]
        return {
            "came": _came([one["result"] for one in judged]),
            "detail": episode.causes.detail,
            "acts": judged,
            "collision": episode.final.ego.crashed,
            "seconds": episode.duration_s,
            "latency_s": plan.latency_s,
        }
    finally:
        if isinstance(world, TownWorld):
            world.close()


def _staged(acts: Sequence[Act], world: str, name: str) -> tuple[Scenario, Mapping[Reference, tuple[int, ...]]] | None:
    """The scenario of a command in a world, and which of its stage each reference means; None where it has none."""
    if world == "highway":
        scenario = highway_scenario(acts, name)
        return None if scenario is None else (scenario, {})
    scene = stage_of(acts)
    return None if scene is None else (scene.scenario(name), scene.referents)


def _undriven(came: Came, detail: str, latency_s: float) -> Row:
    return {"came": came, "detail": detail, "acts": [], "collision": False, "seconds": 0.0, "latency_s": latency_s}


def _came(results: Sequence[str]) -> Came:
    if "opposite" in results:
        return "opposite"
    done = results.count("done")
    return "whole" if done == len(results) else "part" if done else "none"


@dataclass(frozen=True, slots=True)
class RealizationRow:
    """Outcome of a command.

    Attributes:
        item: Its id, the same for all readers.
        reader: Who read it.
        set: The file that it is from.
        world: In which it was driven.
        verb: Of its first act.
        reference: The most telling attribute by which it points at something.
        condition: The first event that it waits for, or lasts until.
        text: The words.
        came: Whole, in part, none of it, the opposite; asked back or declined instead.
        collision: Whether the car touched anything.
        acts: What became of each act.
        detail: What is missing, or why it was not driven.
        seconds: Simulated time driven.
        latency_s: Until there was a plan.
        note: What must be said wherever the row is shown.
    """

    item: str
    reader: str
    set: str
    world: str
    verb: str
    reference: str
    condition: str
    text: str
    came: str
    collision: bool
    acts: tuple[Mapping[str, Any], ...]
    detail: str
    seconds: float
    latency_s: float
    note: str = _NOTE


_MEASURES: Final = (
    share("realization-whole-v1", "whole", lambda row: row["came"] == "whole"),
    share("realization-part-v1", "in part", lambda row: row["came"] == "part"),
    share("realization-none-v1", "not", lambda row: row["came"] == "none"),
    share("realization-opposite-v1", "opposite", lambda row: row["came"] == "opposite"),
    share("realization-asked-v1", "asked", lambda row: row["came"] == "asked"),
    share("realization-declined-v1", "declined", lambda row: row["came"] == "declined"),
    count("realization-collisions-v1", "ego collisions", lambda row: row["collision"]),
    mean("realization-latency-v1", "ms to a plan", "ms", lambda row: 1000.0 * row["latency_s"], digits=0),
)


_ALL: Final = TableSpec("What was done of what was said", _MEASURES, cluster="item")


class RealizationBenchmark(Unasked):
    """Labelled commands that a world can stage, by several readers."""

    id = VERSION
    row = RealizationRow
    judge = (
        "Labels of what commands mean, by people's reading, over the geometry of the drive. Shared: scenes are staged "
        "from the same labels; no planner sees them."
    )
    card = CardPart(
        (
            Headline("done whole", _ALL, _MEASURES[0]),
            Headline("did the opposite", _ALL, _MEASURES[3]),
        ),
        evidence="simulated drives (SUMO, highway-env), staged scenes",
        quick={"items": 60, "worlds": "town,highway"},
        full={"worlds": "town,highway"},
        drives={"cruise": ("program",)},
        planner="readers",
        extra=("town", "libsumo"),
    )

    def __init__(
        self, commands: Path, readers: Sequence[str], most: int = 0, worlds: Sequence[str] = ("town",)
    ) -> None:
        """Make it.

        Args:
            commands: A JSONL file of labelled commands, or a folder of them.
            readers: `labels`, `blind` and planners.
            most: How many commands, spread evenly over the files; 0 for all.
            worlds: Where they are driven, each command wherever it can be staged.

        Raises:
            DataError: Commands cannot be read.
            ConfigError: No such world.
        """
        if unknown := set(worlds) - set(WORLDS):
            raise ConfigError(
                f"Nothing is staged in {', '.join(sorted(unknown))}.", hint=f"Worlds: {', '.join(WORLDS)}"
            )
        self._readers, self._worlds = tuple(readers), tuple(worlds)
        self._rows = tuple(_labelled(commands))
        self._most = most

    @property
    def tables(self) -> Sequence[TableSpec]:
        """See Benchmark."""
        whole = TableSpec("What was done of what was said", _MEASURES, "reader", self._readers, total=False)
        groups = {
            "set": "set",
            "world": "world",
            "first verb": "verb",
            "reference": "reference",
            "condition": "condition",
        }
        return (
            whole,
            *(
                TableSpec(f"By {name}: {reader}", _MEASURES, column, rows=_of(reader), heads=(column, "commands"))
                for reader in self._readers
                for name, column in groups.items()
                if column != "world" or len(self._worlds) > 1
            ),
        )

    @property
    def config(self) -> Mapping[str, Any]:
        """See Benchmark."""
        content = json.dumps([(row["id"], row["text"], row["acts"]) for row in self._rows], sort_keys=True)
        return {
            "commands": hashlib.sha256(content.encode()).hexdigest(),
            "staged": len(self._staged),
            "of": len(self._rows),
            "readers": list(self._readers),
            "worlds": list(self._worlds),
            "most": self._most,
        }

    @cached_property
    def _staged(self) -> tuple[tuple[Row, str], ...]:
        clear = [(row, acts_from_json(row["acts"])) for row in self._rows if row.get("clear", 1)]
        found = [(row, world) for world in self._worlds for row, acts in clear if _staged(acts, world, row["id"])]
        if not self._most or len(found) <= self._most:
            return tuple(found)
        return tuple(found[k * len(found) // self._most] for k in range(self._most))

    def items(self) -> Sequence[RealizationItem]:
        """See Benchmark."""
        return tuple(
            RealizationItem(
                f"{row['id']}/{world}/{reader}", row["id"], row["text"], tuple(row["acts"]), reader, row["set"], world
            )
            for row, world in self._staged
            for reader in self._readers
        )

    def job(self, item: RealizationItem, answer: Row | None) -> RealizationJob:
        """See Benchmark."""
        del answer
        staged = _staged(acts_from_json(item.acts), item.world, item.command)
        assert staged is not None, item.id
        parts = [VERSION, scenario_hash(staged[0]), item.text, item.acts, item.reader]
        return RealizationJob(hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:24], item)

    def rows(self, outcome: ItemOutcome[RealizationItem]) -> Sequence[RealizationRow]:
        """See Benchmark."""
        item, result = outcome.item, outcome.result
        if result is None or result["infra_failed"]:
            return ()
        acts = acts_from_json(item.acts)
        row = RealizationRow(
            item=item.command,
            reader=item.reader,
            set=item.set,
            world=item.world,
            reference=_reference(acts),
            condition=next((act.when.event for act in acts if act.when is not None and not act.purpose), "none"),
            verb=next(act["act"] for act in item.acts if not act.get("purpose")),
            text=item.text,
            came=result["came"],
            collision=result["collision"],
            acts=tuple(result["acts"]),
            detail=result["detail"],
            seconds=result["seconds"],
            latency_s=result["latency_s"],
        )
        return (row,)


def _reference(acts: Sequence[Act]) -> str:
    """How a command points at road users and things: the most telling attribute of all that it names."""
    named = [one for act in acts if not act.purpose for one in references_of(act) if one.kind != "me_here"]
    told = {"none"} if not named else {"kind alone"}
    for one in named:
        attributes = {
            "ordinal": one.ordinal, "of another": one.of, "colour": one.colour, "side": one.side, "state": one.state,
            "where": one.where, "that": one.deictic,
        }  # fmt: skip
        told |= {name for name, value in attributes.items() if value}
    return next(name for name in _TELLING if name in told)


_TELLING: Final = ("ordinal", "of another", "colour", "side", "state", "where", "that", "kind alone", "none")


def _of(reader: str) -> Callable[[Mapping[str, Any]], bool]:
    def own(row: Mapping[str, Any]) -> bool:
        return row["reader"] == reader

    return own


def _labelled(commands: Path) -> list[Row]:
    """Labelled commands of a file or a folder. Raises DataError."""
    files = sorted(commands.glob("*.jsonl")) if commands.is_dir() else [commands]
    found: list[Row] = []
    for file in files:
        try:
            if file.stat().st_size > _MOST_BYTES:
                raise DataError(f"{file} has more than {_MOST_BYTES} bytes.")
            lines = file.read_text(encoding="utf-8").splitlines()
            rows = [json.loads(line) for line in lines if line.strip()]
        except (OSError, ValueError, RecursionError) as error:
            raise DataError(f"{file} holds no labelled commands: {error}.") from error
        for row in rows:
            if not isinstance(row, dict) or not {"id", "text", "acts"} <= set(cast("dict[str, Any]", row)):
                raise DataError(f"{file}: a command has `id`, `text` and `acts`.")
            acts_from_json(cast("dict[str, Any]", row)["acts"])
            found.append({**cast("Row", row), "set": file.stem})
    if not found:
        raise DataError(f"There are no labelled commands in {commands}.", hint="Give their folder: --data FOLDER.")
    return found


def realization(
    data: str = "", readers: str = "labels,meaning,keyword,blind", items: int = 0, worlds: str = "town"
) -> RealizationBenchmark:
    """The benchmark, as its entry point gives it.

    Args:
        data: File or folder of labelled commands; by default our own, by two writers, held out.
        readers: Who reads, separated by commas.
        items: How many commands; 0 for all that can be staged.
        worlds: Where they are driven, separated by commas: town, highway.
    """
    commands = Path(data) if data else data_folder("realization")
    return RealizationBenchmark(commands, _listed(readers), items, _listed(worlds))


def _listed(text: str) -> list[str]:
    return [one.strip() for one in text.split(",") if one.strip()]
