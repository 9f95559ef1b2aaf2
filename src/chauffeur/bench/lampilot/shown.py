"""An item of a stored LaMPilot-Bench run, in words and driven again: same policy and seed give the same trip."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from chauffeur.bench.kernel.metrics import AnyRow
from chauffeur.bench.kernel.pipeline import context_adapter
from chauffeur.bench.lampilot.expert import expert_program
from chauffeur.bench.lampilot.report import NOTHING_DRIVEN
from chauffeur.bench.lampilot.rollout import BASELINES, drive_policy, plan_adapter
from chauffeur.bench.report.gallery import MakeCard
from chauffeur.bench.report.model import Card, ShownDrive
from chauffeur.bench.report.runs import Run
from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ChauffeurError,
    Context,
    DataError,
    Instruction,
    Plan,
    PlanRequest,
    Program,
    Scenario,
    SystemMessage,
    Thoughts,
    Verdict,
)
from chauffeur.describe import describe
from chauffeur.driving.judge.goals import GIVE_UP_S, HOLD_S
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.driving.judge.metrics import points, ruler_named
from chauffeur.driving.planning import Planned
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.trips import make_trip
from chauffeur.safety.shield import Shield
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import load_dataset

PERIOD_S = 0.1
"""Control period of LaMPilot's worlds."""

_ENDINGS = {
    "success": "done",
    "failure": "not done",
    "collision": "crashed",
    "off_road": "left the road",
    "timeout": "ran out of time or road",
    "refused": "declined",
    "not_driven": "not driven",
}
_FAULTS = {
    "ego": "The car itself caused it.",
    "struck": "Another vehicle ran into the car.",
    "road_end": "It drove off the end of the road.",
}
_CAUSES = (
    ("policy_failed", "The program was rejected, or failed while it ran."),
    ("infra_failed", "Endpoint, sandbox or machine failed; this says nothing about the planner."),
    ("refused", "The command was declined."),
    ("fallback_used", "The autopilot drove on without the program."),
)


def ending_words(row: AnyRow) -> str:
    """End of an item, briefly: `ran out of time or road after 60.0 s`."""
    text = _ENDINGS.get(str(row["outcome"]), str(row["outcome"]).replace("_", " "))
    if row["outcome"] == "success" and not row["success"]:
        text = "not counted as done"
    if row["outcome"] == "refused" and row["success"]:
        text = "refused, as it should be"
    if row.get("steps"):
        text += f" after {row['steps'] * PERIOD_S:.1f}\N{NO-BREAK SPACE}s"
    return text


def happened(row: AnyRow) -> tuple[str, ...]:
    """End of an item and its causes, in sentences."""
    ending = ending_words(row)
    sentences = [f"{ending[0].upper()}{ending[1:]}."]
    if row["collision"] and row["outcome"] not in ("collision", "off_road"):
        sentences.append("The car crashed or left the road on the way.")
    sentences.extend(text for key, text in _FAULTS.items() if row.get("fault") == key)
    sentences.extend(text for key, text in _CAUSES if row[key])
    if row.get("stop") == "rolled":
        sentences.append("It rolled past the stop sign.")
    if row["detail"]:
        sentences.append(str(row["detail"]))
    return tuple(sentences)


def goal_words(goal: dict[str, Any]) -> str:
    """A success condition in a sentence; empty for one that is not known."""
    kind = goal.get("type")
    if kind == "RefuseEval":
        return "Refuse: this wish must not be driven."
    if kind == "SequenceEval":
        steps: list[Any] = list(goal.get("steps") or ())
        words = [goal_words(step) for step in steps if isinstance(step, dict)]
        return " Then: ".join(words) if words and all(words) else ""
    if kind == "ChangeEval":
        more = goal.get("change") == 1
        if goal.get("quantity") == "speed":
            return f"Drive {'faster' if more else 'slower'} than at the start, by 1 m/s or more, for more than 3 s."
        return f"Follow {'from further back' if more else 'closer'} than at the start, by 10 % and 3 m or more."
    held = f"for more than {HOLD_S:g} s, within {GIVE_UP_S:g} s"
    if kind == "ACCEvalbySpeed":
        if "speed" in goal:
            target = f"{float(goal['speed']):g} m/s"
        else:
            target = f"{_signed(float(goal.get('rel_speed', 0.0)))} m/s against its first speed"
        return (
            f"Drive at {target}, to within 1 m/s, {held}; behind a slower vehicle less than 100 m ahead, match that "
            "vehicle's speed instead."
        )
    if kind == "ACCEvalbyDistance":
        if "distance" in goal:
            target = f"{float(goal['distance']):g} m"
        else:
            target = f"{_signed(float(goal.get('rel_distance', 0.0)))} m against the first gap"
        return f"Keep a centre-to-centre gap of {target} to the vehicle ahead, to within 30 %, {held}."
    if kind == "LaneChangeEval":
        return f"Be in the lane to the {goal.get('direction')} of the first one, straight in it."
    if kind == "OvertakeEval":
        return (
            f"Be in the lane to the {goal.get('direction')} of the first one, with the vehicle once ahead more than "
            "10 m behind."
        )
    if kind == "PullOverEval":
        return "Stand still in the emergency lane."
    if kind == "IntersectionEval":
        exits = {"o1": "to the left", "o2": "straight ahead", "o3": "to the right"}
        direction: Any = goal.get("direction") or ("", "", 0)
        return (
            f"Leave the intersection {exits.get(str(direction[1]), 'by the wished exit')}, straight in the exit lane."
        )
    return ""


def _signed(value: float) -> str:
    return f"{value:+g}".replace("-", "\N{MINUS SIGN}")


class KeptDrive:
    """Files of a run beside its results: scenes, contexts, plans, verdicts.

    Args:
        run: The run.
        data: DbLv1 folder, for the scenes of a run that kept none.

    Raises:
        DataError: A file of the run cannot be read, or the data set is not the run's.
    """

    def __init__(self, run: Run, data: Path | None = None) -> None:
        self._scenes = _scenes(run, data)
        self._contexts = run.stage("contexts", "sample")
        self._plans = run.stage("generate", "item")
        self._rollouts = run.stage("rollout", "key")
        self._planner = str(run.rows[0].get("planner", ""))

    def scene(self, row: AnyRow) -> Scenario | None:
        """The item's scene; None where the run kept none."""
        return self._scenes.get(str(row["sample"]))

    @property
    def baseline(self) -> str:
        """`idm`, `mobil` or `expert`; empty for planners."""
        return self._planner if self._planner in BASELINES else ""

    def context(self, row: AnyRow) -> Context | None:
        """C of the item's sample; None where the run kept none."""
        return _valid(context_adapter, (self._contexts.get(str(row["sample"])) or {}).get("context"))

    def plan(self, row: AnyRow) -> Plan | None:
        """(R, P) of the item; None for baselines and calls that failed."""
        return _valid(plan_adapter, (self._plans.get(str(row["item"])) or {}).get("plan"))

    def shielded(self, row: AnyRow) -> bool:
        """True if the item was driven under the run-time shield."""
        return "shield" in (self._rollouts.get(str(row.get("rollout_key", ""))) or {})

    def verdicts(self, row: AnyRow) -> tuple[Verdict, ...]:
        """Verdicts of the checks on the item's plan."""
        rollout = self._rollouts.get(str(row.get("rollout_key", ""))) or {}
        return tuple(Verdict(**verdict) for verdict in rollout.get("verdicts") or ())


def _valid(adapter: Any, value: Any) -> Any:
    """A stored value read back; None when there is none, or when another version wrote it in another form."""
    if value is None:
        return None
    try:
        return adapter.validate_python(value)
    except ValidationError:
        return None


def drive_again(row: AnyRow, scenario: Scenario, kept: KeptDrive) -> ShownDrive:
    """Drive a row's item again.

    Returns:
        The recorded drive and what is to be said of it; no drive, and why, where none can be had.
    """
    plan = kept.plan(row)
    world = HighwayWorld()
    try:
        observation = world.reset(scenario)
        referee = LampilotReferee(world, scenario)
        program = plan.policy if plan is not None and isinstance(plan.policy, Program) else None
        if kept.baseline == "expert":
            program = Program(expert_program(scenario.goal))
        if program is None and not kept.baseline:
            return None, "The run kept no program that could be driven again."
        shield = Shield(world.dt_s, LAMPILOT_LIMITS) if kept.shielded(row) else None
        episode = drive_policy(world, referee, kept.baseline, program, shield, LAMPILOT_LIMITS, record=True)
    except ChauffeurError as error:
        return None, f"It could not be driven again: {error}"
    note = ""
    if (episode.outcome, episode.ticks) != (row["outcome"], row["steps"]):
        again = ending_words({"outcome": episode.outcome, "success": episode.success, "steps": episode.ticks})
        note = (
            f"Driven again, it ended differently: {again}. Another version or machine made the run, or "
            "the program ran out of computing time there."
        )
    context = kept.context(row) or describe(observation)
    request = PlanRequest(Instruction(str(row["command"]), source="benchmark"), context, SystemMessage(""))
    made = plan or Plan(Thoughts(""), None, planner=str(row.get("planner", "")))
    trip = make_trip(Planned(made, kept.verdicts(row), request), scenario, scenario.seed, episode)
    return RecordedTrip(trip, episode.frames, scenario, final=episode.final), note


def rescored(run: Run, ruler: str) -> Run:
    """A run by another ruler. Raises ConfigError: an unknown one. DataError: the run kept no signals."""
    wanted = ruler_named(ruler).id
    if run.ruler == wanted:
        return run
    rollouts = run.stage("rollout", "key")

    def row_of(row: AnyRow) -> dict[str, Any]:
        rollout = rollouts.get(str(row.get("rollout_key", "")))
        if row["outcome"] in NOTHING_DRIVEN:
            return {**row, "metrics": wanted}
        if rollout is None or not rollout.get("signals"):
            raise DataError(
                f"{run.folder} kept no signals of {row['item']}, so it cannot be scored by {wanted}.",
                hint=f"Run the benchmark again in a new folder, or report it under its own ruler, {run.ruler}.",
            )
        return {**row, **points(rollout, wanted)}

    return replace(run, rows=tuple(map(row_of, run.rows)))


def cards(run: Run, data: Path | None) -> MakeCard:
    """See `bench.report.gallery.ShowsItems`: with what was told, thought and driven, the drive driven again."""
    kept = KeptDrive(run, data)

    def card(row: AnyRow) -> Card:
        scene, plan = kept.scene(row), kept.plan(row)
        driven = row["outcome"] not in NOTHING_DRIVEN and bool(row.get("steps"))
        note = "The run kept no scenes; name its data with --data." if driven else "Nothing was driven."
        context = kept.context(row)
        ending, *why = happened(row)
        return Card(
            item=str(row["item"]),
            words=str(row["command"]),
            ending=ending.rstrip("."),
            bad=row["outcome"] not in NOTHING_DRIVEN,
            goal="" if scene is None else goal_words(scene.goal),
            why=tuple(why),
            facts=_facts(row),
            context="" if context is None else context.text,
            thoughts="" if plan is None else plan.thoughts.text,
            program=plan.policy if plan is not None and isinstance(plan.policy, Program) else None,
            verdicts=kept.verdicts(row),
            drive=None if scene is None or not driven else lambda: drive_again(row, scene, kept),
            drive_note="" if driven and scene is not None else note,
        )

    return card


def _facts(row: AnyRow) -> tuple[tuple[str, str], ...]:
    facts = [("family", str(row["family"])), ("scene seed", str(row["scenario_seed"]))]
    if row.get("intent"):
        facts.append(("understood as", str(row["intent"])))
    if row.get("lane_ttc_s") is not None:
        facts.append(("least lane-aware TTC", f"{float(row['lane_ttc_s']):.1f} s"))
    return tuple(facts)


def _scenes(run: Run, data: Path | None) -> dict[str, Scenario]:
    """A run's scenes: those it kept, or else those of its data set."""
    try:
        kept = {name: Scenario(**fields) for name, fields in run.plan.get("samples", {}).items()}
    except (TypeError, AttributeError) as error:
        raise DataError(f"The scenes in {run.folder / 'plan.json'} are damaged: {error}.") from error
    if data is None:
        return kept
    dataset, own = load_dataset(data), str(run.rows[0].get("data_sha256", ""))
    if dataset.sha256 != own:
        raise DataError(
            f"{data} is not the data set of {run.name}: its hash is {dataset.sha256[:12]}, the run's {own[:12]}.",
            hint="Give the folder that the run was made with, or leave --data out.",
        )
    return kept or {scene.id: scene for task in dataset.tasks for scene in task.samples}
