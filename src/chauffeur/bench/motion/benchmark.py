"""Tab. XI as a plug-in of the kernel: every command in every weather is asked, checked, driven and scored."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, get_args

from chauffeur.bench.kernel.benchmark import Asks, ItemOutcome, RequestDesk
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, mean, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.motion.driving import MotionJob, job_key
from chauffeur.bench.motion.items import MotionItem, Shown, Told, data_sha256, motion_items, style_ranges
from chauffeur.bench.motion.scoring import SCORE_VERSION, WEIGHTS, MotionStatistics, command_alignment, driving_score
from chauffeur.concept import ActionMatrix, ConfigError, Instruction, PlanRequest, SystemMessage
from chauffeur.driving.planning import screened_request
from chauffeur.safety.gain_box import care, gain_box
from chauffeur.worlds.track import FRICTION, MANOEUVRES
from chauffeur.worlds.track.dynamics import PLANTS, Plant

SIMULATED: Final = (
    "simulated drives on CommonRoad's vehicle models; the styles of the commands are the authors' reading"
)
"""Stands beside every figure."""


@dataclass(frozen=True, slots=True)
class MotionRow:
    """A command in a weather, and how it was driven.

    Attributes:
        command, text, style, directness: What was said, and meant.
        manoeuvre, weather, plant: Where.
        gains: What was planned; None without a plan.
        care: How conservative the gains are, 0 to 1.
        command_alignment: Eq. 27, points; 0 where nothing usable was planned.
        scenario_aligned: Whether the gains are more conservative than for the same command in sunshine.
        latency_s: Wish in, gains out.
        outcome: Of the drive.
        score: Eq. 26, points; 0 for what was not driven or ended in a collision or off the road.
        note: What the figures are.
    """

    command: str
    text: str
    style: str
    directness: int
    manoeuvre: str
    weather: str
    plant: str
    gains: tuple[float, ...] | None
    care: float | None
    command_alignment: float
    scenario_aligned: bool | None
    latency_s: float | None
    outcome: str
    refused: bool
    policy_failed: bool
    infra_failed: bool
    detail: str
    measured: Mapping[str, Any] | None
    baseline: Mapping[str, Any] | None
    score: float | None
    note: str = SIMULATED


def _measure(name: str) -> Callable[[AnyRow], float | None]:
    return lambda row: None if row["measured"] is None else row["measured"][name]


TABLE: Final[tuple[Measure, ...]] = (
    mean("motion-ttc-v1", "TTC", "s", _measure("min_ttc_s"), 2),
    mean("motion-speed-variance-x-v1", "σx", "m2/s2", _measure("speed_variance_x"), 2),
    mean("motion-speed-variance-y-v1", "σy", "m2/s2", _measure("speed_variance_y"), 4),
    mean("motion-acceleration-x-v1", "|ax|", "m/s2", _measure("acceleration_x"), 2),
    mean("motion-jerk-x-v1", "|Jx|", "m/s3", _measure("jerk_x"), 2),
    mean("motion-acceleration-y-v1", "|ay|", "m/s2", _measure("acceleration_y"), 3),
    mean("motion-jerk-y-v1", "|Jy|", "m/s3", _measure("jerk_y"), 2),
    mean("motion-latency-v1", "latency", "s", lambda row: row["latency_s"], 3),
    mean("motion-command-alignment-v1", "command alignment", "points", lambda row: row["command_alignment"]),
    share("motion-scenario-alignment-v1", "scenario alignment", lambda row: row["scenario_aligned"]),
    mean("motion-score-v1", "driving score", "points", lambda row: row["score"]),
    share("motion-driven-v1", "driven", lambda row: row["outcome"] == "ended"),
)


_SCORE: Final = TABLE[10]
_PRINTED: Final = ("Ours, acceleration", "Ours, lane change", "Ours, left turn")
"""The paper's own system in Tab. XI, which has no line over all manoeuvres."""


class MotionBenchmark:
    """Three manoeuvres, ten commands each, five kinds of weather."""

    id = "motion-v1"
    judge = (
        "Ranges of gains a style that we chose (`data/motion/styles.json`); the driving score compares with these "
        "fixed gains themselves. Shared: a planner that is taught a table inside them cannot miss once it reads words."
    )
    asks: Asks = "plans"
    row = MotionRow
    tables = (
        TableSpec("Driving performance (Tab. XI)", TABLE, group="manoeuvre", order=MANOEUVRES, cluster="command",
                  heads=("manoeuvre", "drives"), published="motion/table11.json"),
        TableSpec("By weather", TABLE[8:], group="weather", order=tuple(FRICTION), cluster="command",
                  heads=("weather", "drives"), total=False),
        TableSpec("By style", TABLE[8:], group="style", cluster="command", heads=("style meant", "drives"),
                  total=False),
        TableSpec("By directness", TABLE[8:], group="directness", cluster="command", heads=("level", "drives"),
                  total=False),
    )  # fmt: skip

    card = CardPart(
        (
            Headline("driving score", tables[0], _SCORE, paper=_PRINTED),
            Headline("driven to the end", tables[0], TABLE[-1]),
        ),
        evidence="simulated drives (CommonRoad vehicle models)",
        drives={"track-lane-change": ("action_matrix",)},
        extra=("motion", "osqp"),
    )

    def __init__(self, plant: Plant = "std", seed: int = 1, weather: Told = "told", camera: Shown = "off") -> None:
        """Make it.

        Args:
            plant: The vehicle model.
            seed: Of the actuators' noise and of places.
            weather: What planners hear of the weather.
            camera: What they see.

        Raises:
            ConfigError: There is no such plant, telling or camera.
        """
        if plant not in PLANTS or weather not in get_args(Told):
            raise ConfigError(
                f"Plant {plant!r} or weather {weather!r} is unknown.",
                hint=f"Plants: {', '.join(PLANTS)}; weather: {', '.join(get_args(Told))}.",
            )
        if camera not in get_args(Shown):
            raise ConfigError(f"Camera {camera!r} is unknown.", hint=f"Choose of: {', '.join(get_args(Shown))}.")
        self._plant: Plant = plant
        self._seed = seed
        self._told: Told = weather
        self._shown: Shown = camera

    @property
    def config(self) -> Mapping[str, Any]:
        box = gain_box()
        return {
            "plant": self._plant,
            "seed": self._seed,
            "weather": self._told,
            "camera": self._shown,
            "friction": FRICTION,
            "data_sha256": data_sha256(),
            "box": {name: [box.low[name], box.high[name]] for name in box.low},
            "weights": {name: dict(weights) for name, weights in WEIGHTS.items()},
            "score": SCORE_VERSION,
            "simulated": SIMULATED,
        }

    def items(self) -> Sequence[MotionItem]:
        return motion_items(self._plant, self._seed)

    async def request(self, item: MotionItem, desk: RequestDesk) -> PlanRequest:
        """See Benchmark. S is the planner's own: it says how gains are to be given."""
        context = item.told(await desk.context(item.scenario), self._told)
        said = Instruction(item.command.text, source="benchmark")
        return screened_request(said, context, SystemMessage(""), images=item.shown(self._shown))

    def job(self, item: MotionItem, answer: Row | None) -> MotionJob | None:
        if answer is None:
            return None
        return MotionJob(job_key(item.scenario, answer), item.scenario, answer)

    def rows(self, outcome: ItemOutcome[MotionItem]) -> Sequence[MotionRow]:
        item, found = outcome.item, outcome.result
        answer: Row = outcome.answer or {}
        policy = _matrix(answer.get("policy"))
        usable = policy is not None and not gain_box().outside(policy)
        aligned = command_alignment(policy, style_ranges()[item.command.style]) if usable and policy else 0.0
        latency = answer.get("latency_s") or None
        result: Row = found or {}
        driven = result.get("measured") is not None
        return [
            MotionRow(
                command=item.command.id,
                text=item.command.text,
                style=item.command.style,
                directness=item.command.directness,
                manoeuvre=item.command.manoeuvre,
                weather=item.weather,
                plant=self._plant,
                gains=None if policy is None else (*policy.pid, *policy.mpc),
                care=care(policy) if usable and policy else None,
                command_alignment=aligned,
                scenario_aligned=None,
                latency_s=latency,
                outcome=str(result.get("outcome", "refused" if result.get("refused") else "not_driven")),
                refused=bool(result.get("refused")),
                policy_failed=bool(result.get("policy_failed")),
                infra_failed=bool(result.get("infra_failed", found is None)),
                detail=str(result.get("detail") or outcome.error),
                measured=result["measured"] if driven else None,
                baseline=result["baseline"] if driven else None,
                score=None,
            )
        ]

    def together(self, rows: Sequence[Row]) -> Sequence[Row]:
        """Scenario alignment, which compares a command's weathers, and the score it is part of."""
        sunny = {row["command"]: row["care"] for row in rows if row["weather"] == "sunny"}
        return [row | _compared(row, sunny.get(row["command"])) for row in rows]


def _compared(row: Row, sunny: float | None) -> Row:
    aligned: bool | None = None
    if row["weather"] != "sunny":
        aligned = row["care"] is not None and sunny is not None and row["care"] > sunny + 1e-6
    if row["infra_failed"]:
        return {"scenario_aligned": None, "score": None}
    if row["measured"] is None or row["outcome"] not in ("ended", "success"):
        return {"scenario_aligned": aligned, "score": 0.0}
    score = driving_score(
        row["manoeuvre"],
        MotionStatistics(**row["measured"]),
        MotionStatistics(**row["baseline"]),
        row["latency_s"],
        row["command_alignment"],
        None if aligned is None else 100.0 * aligned,
    )
    return {"scenario_aligned": aligned, "score": score}


def _matrix(policy: Mapping[str, Any] | None) -> ActionMatrix | None:
    if policy is None or policy.get("kind") != "action_matrix":
        return None
    (kp, ki, kd), (wl, wh, ws) = policy["pid"], policy["mpc"]
    return ActionMatrix((kp, ki, kd), (wl, wh, ws))
