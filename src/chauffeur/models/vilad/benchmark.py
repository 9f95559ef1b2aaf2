"""Tab. XIII as a plug-in of the kernel: instructions of four splits are asked, checked, driven and scored, closed loop.

Two tasks: interactive parking in the lot's world, and instruction following on open road. Commands and scenes come from
the generators of the models' own training, with writers, phrases and combinations held out; any planner can be asked.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import pairwise
from statistics import pvariance
from typing import Any, Final, Literal, get_args

import numpy as np

from chauffeur.bench.kernel.benchmark import Asks, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, mean, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.rollout import plan_adapter
from chauffeur.concept import (
    ChauffeurError,
    ConfigError,
    Frame,
    Instruction,
    Limits,
    Observation,
    Parameters,
    Plan,
    PlanRequest,
    Scenario,
    SystemMessage,
    Trajectory,
)
from chauffeur.concept.data import read_data
from chauffeur.describe.dispatch import describe
from chauffeur.driving.episode import drive_policy, make_world, trip_s
from chauffeur.driving.planning import checked, screened_request
from chauffeur.driving.trips import scenario_hash
from chauffeur.geometry import Pose, wrap_to_pi
from chauffeur.models.vilad.driving_recipe import drive_cases
from chauffeur.models.vilad.parking_words import wish
from chauffeur.models.vilad.phrases import TESTS, Split
from chauffeur.planners.vilad.driving import reference
from chauffeur.planners.vilad.driving_planning import trajectory_of
from chauffeur.planners.vilad.parking import best, free_spots
from chauffeur.worlds.parking import ParkingReferee, ParkingWorld
from chauffeur.worlds.track import StreetReferee, TrackWorld, end_of, peak_of

Task = Literal["parking", "driving"]
VERSION: Final = "instructions-v1"
SIMULATED: Final = "simulated drives; commands composed by a program from phrases that a language model wrote"
_LATERAL_S: Final = 0.2
"""Speeds and headings are compared over so much time: a world's noise is no motion."""


@dataclass(frozen=True, slots=True)
class InstructionItem:
    """A command in a scene.

    Attributes:
        id: E.g. `driving-phrasing-017`.
        task, split: Which.
        text: The words.
        asked: What they mean, by criterion.
        scenario: Where.
    """

    id: str
    task: Task
    split: Split
    text: str
    asked: Mapping[str, str]
    scenario: Scenario


def instruction_items(tasks: Sequence[Task], splits: Sequence[Split], count: int, seed: int) -> list[InstructionItem]:
    """So many commands of each task and split."""
    found: list[InstructionItem] = []
    for task in tasks:
        for split in splits:
            made = _drives(split, count, seed) if task == "driving" else _lots(split, count, seed)
            for number, (text, asked, world, config) in enumerate(made):
                name = f"{task}-{split}-{number:03d}"
                found.append(InstructionItem(name, task, split, text, asked, Scenario(name, world, config, 1)))
    return found


_Made = tuple[str, Mapping[str, str], str, dict[str, Any]]


def _drives(split: Split, count: int, seed: int) -> list[_Made]:
    return [(one.text, one.asked, "track", {"street": asdict(one.config)}) for one in drive_cases(split, count, seed)]


def _lots(split: Split, count: int, seed: int) -> list[_Made]:
    rng = np.random.default_rng([seed, 17, TESTS.index(split)])
    found: list[_Made] = []
    for _ in range(count):
        said = wish(rng, split)
        found.append((said.text, dict(said.asked), "parking", _lot(rng)))
    return found


def _lot(rng: np.random.Generator) -> dict[str, Any]:
    """A lot: its size, who stands where, kinds of bays, roofs and places are drawn; nobody else drives."""
    aisles, a_row = int(rng.integers(1, 4)), int(rng.integers(4, 11))
    rows = [chr(ord("A") + i) for i in range(2 * aisles)]
    names = [f"{row}{number + 1}" for row in rows for number in range(a_row)]
    bays: dict[str, str] = {}
    for kind in ("ev", "accessible", "family"):
        row, first = rows[int(rng.integers(len(rows)))], int(rng.integers(1, a_row - 1))
        bays |= {f"{row}{first + k}": kind for k in range(3) if first + k <= a_row}
    free = [str(one) for one in rng.choice(names, size=min(len(names) - 1, int(rng.integers(6, 16))), replace=False)]
    free += [name for name in bays if rng.random() < 0.4]
    covered = [row for row in rows if rng.random() < 0.35]
    wide, high = 4.0 + 3.0 * a_row, 18.0 * aisles
    places = {
        name: (float(rng.uniform(0.0, wide)), float(rng.uniform(0.0, high)))
        for name in ("lift", "stairs", "machine")
        if rng.random() < 0.88
    }
    return {
        "aisles": aisles, "spots_a_row": a_row, "taken": 0.95, "cars": 0, "walkers": 0,
        "free": sorted(set(free)), "bays": bays, "covered": covered, "places": places,
    }  # fmt: skip


@dataclass(frozen=True, slots=True)
class DriveStatistics:
    """Measures of a drive from Tab. XIII; x is along the car, y across it.

    Attributes:
        speed_variance_x, speed_variance_y: m2/s2.
        acceleration_x, acceleration_y: Greatest size, m/s2.
    """

    speed_variance_x: float
    speed_variance_y: float
    acceleration_x: float
    acceleration_y: float


def drive_statistics(frames: Sequence[Frame], dt_s: float) -> DriveStatistics | None:
    """Measure a drive; None where it is too short to be measured."""
    every = max(1, round(_LATERAL_S / dt_s))
    egos = [frame.observation.ego for frame in frames[::every]]
    if len(egos) < 4:
        return None
    step = every * dt_s
    across: list[float] = []
    along: list[float] = []
    sideways: list[float] = []
    for a, b in pairwise(egos):
        turned = wrap_to_pi(b.heading_rad - a.heading_rad)
        heading = a.heading_rad + turned / 2.0
        across.append((-math.sin(heading) * (b.x_m - a.x_m) + math.cos(heading) * (b.y_m - a.y_m)) / step)
        along.append((b.speed_mps - a.speed_mps) / step)
        sideways.append((a.speed_mps + b.speed_mps) / 2.0 * turned / step)
    return DriveStatistics(
        pvariance([ego.speed_mps for ego in egos]),
        pvariance(across),
        max(map(abs, along)),
        max(map(abs, sideways)),
    )


@dataclass(frozen=True, slots=True)
class InstructionJob:
    """A plan to be driven in a scene, and what was meant."""

    key: str
    task: Task
    scenario: Scenario
    asked: Mapping[str, str]
    plan: Row

    @property
    def near(self) -> str:
        return self.task

    def run(self) -> Row:
        row: Row = {"key": self.key, "infra_failed": False, "refused": False, "policy_failed": False, "detail": ""}
        row |= {"success": False, "outcome": "not_driven", "measured": None}
        plan: Plan = plan_adapter.validate_python(self.plan)
        try:
            world = make_world(self.scenario)
            shown = world.reset(self.scenario)
            found = checked(plan, shown, Limits())
            meant = _meant_spots(shown, self.asked) if self.task == "parking" else _meant_drive(shown, self.asked)
            if found.refusal or plan.policy is None:
                right, why = not meant and not found.unusable, found.refusal
                answered = {"refused": not found.unusable, "policy_failed": found.unusable, "detail": why}
                return row | answered | {"success": right}
            if not meant:
                return row | {"outcome": "failure", "detail": "It was driven though it cannot be done."}
            referee = _referee(world, plan, meant)
            episode = drive_policy(world, plan.policy, referee, trip_s(self.scenario), Limits())
            measured = drive_statistics(episode.frames, world.dt_s)
            return row | {
                "success": episode.outcome == "success",
                "outcome": episode.outcome,
                "measured": None if measured is None else asdict(measured),
                "metres": _way_m(episode.frames),
            }  # fmt: skip
        except ChauffeurError as error:
            return row | {"infra_failed": True, "detail": str(error)}

    def spoiled(self, detail: str) -> Row:
        return {
            "key": self.key, "infra_failed": True, "refused": False, "policy_failed": False, "detail": detail,
            "success": False, "outcome": "not_driven", "measured": None,
        }  # fmt: skip


def _way_m(frames: Sequence[Frame]) -> float:
    egos = [frame.observation.ego for frame in frames]
    return sum(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in pairwise(egos))


def _meant_spots(shown: Observation, asked: Mapping[str, str]) -> tuple[str, ...]:
    """Spots that are as good as any for what was meant; none where none is what was asked for."""
    lot = describe(shown).lot
    assert lot is not None
    spots, names = free_spots(lot)
    good = best(spots, asked)[1]
    return tuple(name for name, fine in zip(names, good[1:], strict=True) if fine)


def _meant_drive(shown: Observation, asked: Mapping[str, str]) -> Trajectory | None:
    """The ideal drive for what was meant; None where it cannot be done."""
    context = describe(shown)
    assert context.street is not None
    values = reference(context.street, asked)
    if values["way"] == 0:
        return None
    return trajectory_of(context.street, values, Limits(), context.situation.speed_limit_mps)


def _referee(world: Any, plan: Plan, meant: tuple[str, ...] | Trajectory) -> Any:
    if isinstance(world, TrackWorld) and isinstance(meant, Trajectory):
        ego = world.observe().ego
        return StreetReferee(world, end_of(meant, Pose(ego.x_m, ego.y_m, ego.heading_rad)), peak_of(meant))
    assert isinstance(world, ParkingWorld)
    assert isinstance(meant, tuple)
    named = plan.policy.route if isinstance(plan.policy, Parameters) else ""
    return ParkingReferee(world, world.spot(named if named in meant else meant[0]))


@dataclass(frozen=True, slots=True)
class InstructionRow:
    """A command, and how it was driven.

    Attributes:
        task, split, text, asked: What was said, and meant.
        intent: What the planner made of it, in short.
        success: It was done as meant; or declined, where it cannot be done.
        agreed: Whether what the model wrote did what it said it understood, before it was made to.
        passes: Forward passes, or requests.
        latency_s: Wish in, plan out.
        outcome: Of the drive.
        metres: Way driven.
        note: What the figures are.
    """

    task: str
    split: str
    text: str
    asked: Mapping[str, str]
    intent: str
    success: bool
    agreed: bool | None
    passes: float | None
    latency_s: float | None
    outcome: str
    refused: bool
    policy_failed: bool
    infra_failed: bool
    detail: str
    measured: Mapping[str, Any] | None
    metres: float | None
    note: str = SIMULATED


def _measured(name: str) -> Any:
    def of(row: AnyRow) -> float | None:
        return None if row["measured"] is None else float(row["measured"][name])

    return of


TABLE: Final[tuple[Measure, ...]] = (
    share("instructions-success-v1", "success", lambda row: row["success"]),
    mean("instructions-latency-v1", "latency", "s", lambda row: row["latency_s"], 3),
    mean("instructions-variance-x-v1", "long. var.", "m2/s2", _measured("speed_variance_x"), 2),
    mean("instructions-variance-y-v1", "lat. var.", "m2/s2", _measured("speed_variance_y"), 5),
    mean("instructions-acceleration-x-v1", "max long. acc.", "m/s2", _measured("acceleration_x"), 2),
    mean("instructions-acceleration-y-v1", "max lat. acc.", "m/s2", _measured("acceleration_y"), 2),
    mean("instructions-passes-v1", "passes", "", lambda row: row["passes"], 1),
    share("instructions-agreed-v1", "agreed unaided", lambda row: row["agreed"]),
    mean("instructions-way-v1", "way", "m", lambda row: row["metres"], 0),
)


class InstructionBenchmark:
    """Parking wishes and driving commands of four splits."""

    id = VERSION
    asks: Asks = "plans"
    row = InstructionRow
    judge = (
        "The exact solver that also stands behind every row. Shared: what differs between rows is how words are "
        "read, and nothing else."
    )
    tables = (
        TableSpec("Open road (Tab. XIII, second row)", TABLE, group="split", order=TESTS, cluster="text",
                  heads=("split", "commands"), rows=lambda row: row["task"] == "driving",
                  published="vilad/table13.json"),
        TableSpec("Parking (Tab. XIII, first row)", TABLE, group="split", order=TESTS, cluster="text",
                  heads=("split", "commands"), rows=lambda row: row["task"] == "parking",
                  published="vilad/table13.json"),
    )  # fmt: skip
    card = CardPart(
        (
            Headline("parking as meant", tables[1], TABLE[0], paper=("ViLaD, parking selection",)),
            Headline("open road as meant", tables[0], TABLE[0], paper=("ViLaD, E2E instruction following",)),
        ),
        evidence="simulated drives (kinematic bicycle, CommonRoad vehicle models)",
        quick={"count": 10},
        drives={"parking-exit": ("parameters",), "open-road": ("trajectory",)},
        extra=("motion", "osqp"),
    )

    def __init__(self, task: str = "both", split: str = "all", count: int = 300, seed: int = 2024) -> None:
        """Make it.

        Args:
            task: `parking`, `driving` or `both`.
            split: One split of the commands, or `all`.
            count: Commands of each task and split.
            seed: Of commands and scenes.

        Raises:
            ConfigError: There is no such task or split.
        """
        tasks: tuple[Task, ...] = get_args(Task)
        chosen: list[Task] = [one for one in tasks if task in (one, "both")]
        splits: list[Split] = [one for one in TESTS if split in (one, "all")]
        self._tasks, self._splits = chosen, splits
        if not self._tasks or not self._splits or int(count) < 1:
            raise ConfigError(
                f"Task {task!r}, split {split!r} or count {count!r} is unknown.",
                hint=f"Tasks: both, {', '.join(tasks)}; splits: all, {', '.join(TESTS)}; a count of 1 or more.",
            )
        self._count, self._seed = int(count), int(seed)

    @property
    def config(self) -> Mapping[str, Any]:
        data = b"".join(read_data("vilad", name) for name in ("parking.txt", "driving.txt"))
        return {
            "tasks": list(self._tasks),
            "splits": list(self._splits),
            "count": self._count,
            "seed": self._seed,
            "data_sha256": hashlib.sha256(data).hexdigest(),
            "simulated": SIMULATED,
        }

    @cached_property
    def _items(self) -> list[InstructionItem]:
        return instruction_items(self._tasks, self._splits, self._count, self._seed)

    def items(self) -> Sequence[InstructionItem]:
        return self._items

    async def request(self, item: InstructionItem, desk: RequestDesk) -> PlanRequest:
        context = await desk.context(item.scenario)
        return screened_request(Instruction(item.text, source="benchmark"), context, SystemMessage(""))

    def job(self, item: InstructionItem, answer: Row | None) -> InstructionJob | None:
        if answer is None:
            return None
        parts = [VERSION, scenario_hash(item.scenario), dict(item.asked), answer["policy"], answer["refusal"]]
        key = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]
        return InstructionJob(key, item.task, item.scenario, item.asked, answer)

    def rows(self, outcome: ItemOutcome[InstructionItem]) -> Sequence[InstructionRow]:
        item, answer, result = outcome.item, outcome.answer or {}, outcome.result or {}
        settings = dict(answer.get("settings") or ())
        usage = answer.get("usage") or {}
        return [
            InstructionRow(
                task=item.task,
                split=item.split,
                text=item.text,
                asked=dict(item.asked),
                intent=str(answer.get("intent", "")),
                success=bool(result.get("success")),
                agreed=None if "agreed" not in settings else bool(settings["agreed"]),
                passes=settings.get("passes", usage.get("requests")),
                latency_s=answer.get("latency_s") or None,
                outcome=str(result.get("outcome", "not_driven")),
                refused=bool(result.get("refused")),
                policy_failed=bool(result.get("policy_failed")),
                infra_failed=bool(result.get("infra_failed", outcome.result is None)),
                detail=str(result.get("detail") or outcome.error),
                measured=result.get("measured"),
                metres=result.get("metres"),
            )
        ]
