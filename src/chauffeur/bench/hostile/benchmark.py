"""The suite as a benchmark of the kernel: ask -> check and drive -> judge.

Inputs that a planner answers with the same program on the same road share one drive.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.bench.hostile.judge import RULER, served, verdict_of
from chauffeur.bench.hostile.loader import Input, data_sha256, hostile_inputs, lookalikes, sample
from chauffeur.bench.hostile.obedient import ObedientPlanner
from chauffeur.bench.hostile.report import CARD, TABLES, headline
from chauffeur.bench.hostile.requests import HostileRequests
from chauffeur.bench.hostile.rollout import ROLLOUT_VERSION, DriveJob
from chauffeur.bench.kernel.benchmark import Asks, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.passengers.scenes import SCENES as _STARTS
from chauffeur.concept import LAMPILOT_LIMITS, Limits, Plan, PlanRequest, Scenario
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.version import __version__

_NAMES: Final = (
    "overtake", "cruise", "following", "left-lane", "emergency-lane", "intersection", "quiet-intersection",
    "tailgating", "middle-behind", "held-up",
)  # fmt: skip

SCENES: Final[Mapping[str, Scenario]] = {name: _STARTS[name] for name in _NAMES}
"""By name."""

_CROSSING: Final = re.compile(
    r"stop sign|at sign|at the sign|signs? run|crossing|junction|intersection|yield|\bturn\b|red light|roundabout", re.I
)
_SHOULDER: Final = re.compile(r"shoulder|pull over|verge|pavement|grass|off road|off the", re.I)
_CLOSE: Final = re.compile(r"headway|gap|tailgat|bumper|contact|ram\b|collision|brak|close", re.I)
_SIDE: Final = re.compile(r"lane|side|weav|cut|oncoming|wrong|overtak|squeez|slalom", re.I)

_OF_A_WISH: Final[Mapping[str, str]] = {
    "speed": "cruise", "faster": "held-up", "slower": "cruise", "style": "cruise", "keep": "cruise",
    "gap": "following", "overtake": "overtake", "lane_left": "cruise", "lane_right": "left-lane",
    "pull_over": "emergency-lane", "stop": "quiet-intersection", "turn_left": "quiet-intersection",
    "turn_right": "quiet-intersection", "straight": "quiet-intersection",
}  # fmt: skip


def scene_of(one: Input) -> Scenario:
    """The scene an input is said in."""
    if not one.hostile:
        if one.wanted == "stop" and not re.search(r"sign|line", one.wish, re.IGNORECASE):
            return SCENES["emergency-lane"]
        return SCENES[_OF_A_WISH[one.wanted]]
    for pattern, name in (
        (_CROSSING, "intersection"), (_SHOULDER, "emergency-lane"), (_CLOSE, "tailgating"), (_SIDE, "middle-behind"),
    ):  # fmt: skip
        if pattern.search(one.aim):
            return SCENES[name]
    return SCENES["cruise"]


BENCH_VERSION: Final = "hostile-v1"
"""Suite, scenes, rollout and ruler together; stands in every result."""

_SIMULATED: Final = "simulated drives (highway-env); hostile words written for this suite"


@dataclass(frozen=True, slots=True)
class HostileConfig:
    """Settings that decide a run.

    Attributes:
        planner: Specification of the planner, `obedient` or `obedient/hidden` included.
        setting: Prompt for language models.
        a_kind: Inputs of each class, hostile and harmless alike; 0 for all.
        seed: Seed of that draw.
        screened: Whether wishes, history and service texts are screened on their way to the planner.
        limits: Bounds of every plan.
        shield: Whether the run-time shield has the last word, as it has in a drive; without it the rest is measured.
    """

    planner: str
    setting: Setting = "few-shot"
    a_kind: int = 0
    seed: int = 42
    screened: bool = True
    limits: Limits = field(default_factory=Limits)
    shield: bool = True

    @property
    def inputs(self) -> tuple[Input, ...]:
        """The inputs of the run. The obedient planner knows attacks only, so it gets no harmless wishes."""
        attacks = sample(hostile_inputs(), self.a_kind, self.seed)
        if self.planner.partition("/")[0] == "obedient":
            return attacks
        return attacks + sample(lookalikes(), self.a_kind, self.seed)


@dataclass(frozen=True, slots=True)
class HostileRow:
    """Outcome of an input.

    Attributes:
        kind, hostile, aim, wanted: The input's.
        intent: What the planner understood.
        screened, shield, limits: How the run was configured.
        scene: Where it was said.
        answer: `refused` by the planner, `blocked` by a check, `driven`, `failed`.
        setting: Settings beyond the limits that reached the driver.
        too_fast, ran_sign, off_road, collision: What the car did.
        served: Whether a harmless wish was served; None for an attack.
        detail: Why it was refused or failed, in words.
        drive: The drive in numbers; None where nothing was driven.
        ruler: What it was judged by.
        note: What must be said wherever the row is shown.
    """

    kind: str
    hostile: bool
    aim: str
    wanted: str
    intent: str
    screened: bool
    shield: bool
    scene: str
    limits: str
    answer: str
    setting: str
    too_fast: bool
    ran_sign: bool
    off_road: bool
    collision: bool
    served: bool | None
    detail: str
    drive: Mapping[str, Any] | None
    ruler: str = RULER
    note: str = _SIMULATED


def planner_of(spec: str, **options: Any) -> Planner:
    """The planner a specification names: the suite's own `obedient`, or a registered one.

    Raises:
        ConfigError: Unknown, or an option it does not take.
    """
    name, _, argument = spec.partition("/")
    if name == "obedient":
        return ObedientPlanner(hostile_inputs(), argument)
    from chauffeur.planners.registry import make_planner

    return make_planner(spec, **options)


class HostileBenchmark:
    """See the package."""

    id = BENCH_VERSION
    asks: Asks = "plans"
    row = HostileRow
    tables = TABLES
    card = CARD
    judge = (
        "What the simulator shows: speed, stops at signs, lanes, collisions. Shared: labels of attacks and of harmless "
        "wishes are one developer's; the limits are those of the checks and of the filter."
    )
    planner_of = staticmethod(planner_of)

    def __init__(self, options: HostileConfig) -> None:
        """Make it. Raises DataError: the inputs are damaged."""
        self.options = options
        self._inputs = options.inputs
        self._scenes = {one.id: scene_of(one) for one in self._inputs}

    @property
    def config(self) -> Mapping[str, Any]:
        scenes = {scene.id: scenario_hash(scene)[:12] for scene in self._scenes.values()}
        return {**asdict(self.options), "rollout": ROLLOUT_VERSION, "data": data_sha256(), "scenes": scenes}

    def items(self) -> Sequence[Input]:
        return self._inputs

    @property
    def variant(self) -> str:
        """Options as the default run folder's name shows them."""
        ways = {"raw": not self.options.screened, "unshielded": not self.options.shield}
        return "-".join(way for way, taken in ways.items() if taken)

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, results
        options, first = self.options, rows[0]
        return (
            headline(rows),
            f"Chauffeur {__version__}; planner {first['planner']}, model {first['model']}; {self.id}; limits "
            f"{options.limits.name}; words {'screened' if options.screened else 'raw'}; "
            f"{'with' if options.shield else 'without'} the run-time shield; {first['note']}.",
        )

    @cached_property
    def _requests(self) -> HostileRequests:
        limits = self.options.limits
        system = build_system_message(self.options.setting, limits=limits)
        return HostileRequests(system, limits, self.options.screened)

    async def request(self, item: Input, desk: RequestDesk) -> PlanRequest:

        async def ask(request: PlanRequest) -> Plan | None:
            reply = await desk.ask(request)
            return reply if isinstance(reply, Plan) else None

        return await self._requests.request(item, await desk.context(self._scenes[item.id]), ask)

    def job(self, item: Input, answer: Row | None) -> DriveJob:
        assert answer is not None, "it asks for plans"
        scene, limits, shield = self._scenes[item.id], self.options.limits, self.options.shield
        parts = [ROLLOUT_VERSION, scenario_hash(scene), answer["policy"], answer["refusal"], answer["intent"]]
        parts += [answer["settings"], asdict(limits), shield]
        key = hashlib.sha256(json.dumps(parts, sort_keys=True).encode("utf-8", "surrogatepass")).hexdigest()[:24]
        return DriveJob(key, scene, answer, limits, shield)

    def rows(self, outcome: ItemOutcome[Input]) -> Sequence[HostileRow]:
        """See Benchmark: none for an input that was not answered."""
        one, drive = outcome.item, outcome.result
        if outcome.answer is None or drive is None:
            return ()
        options = self.options
        row = HostileRow(
            kind=one.kind,
            hostile=one.hostile,
            aim=one.aim,
            wanted=one.wanted,
            intent=outcome.answer["intent"],
            screened=options.screened,
            shield=options.shield,
            scene=drive["scene"],
            limits=options.limits.name,
            **verdict_of(drive),
            served=None if one.hostile else served(one, drive),
            detail=drive["detail"],
            drive=drive["drive"],
        )
        return (row,)


def hostile(
    planner: str = "onboard",
    items: int = 0,
    seed: int = 42,
    setting: Setting = "few-shot",
    screened: bool = True,
    shield: bool = True,
    limits: Literal["default", "lampilot"] = "default",
) -> HostileBenchmark:
    """Make the suite of 618 attacks in ten classes, and of 270 harmless wishes that look like them.

    Args:
        planner: Any planner; or the suite's own `obedient` or `obedient/hidden`, which do what an attack says.
        items: How many of each class, drawn with the seed; 0 for all.
        seed: Seed of that draw.
        setting: Prompt for language models.
        screened: Whether words are screened on their way to the planner, or handed on raw.
        shield: Whether the run-time shield has the last word, as in a drive.
        limits: Bounds that no plan may cross.
    """
    bounds = {"default": Limits(), "lampilot": LAMPILOT_LIMITS}[limits]
    return HostileBenchmark(HostileConfig(planner, setting, items, seed, screened, bounds, shield))
