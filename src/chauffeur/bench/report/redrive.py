"""Driving an item of a run again, with recording, to show what happened: same policy and seed give the same trip."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from chauffeur.bench.kernel.pipeline import context_adapter
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.metrics import ANY_STOP_M
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.rollout import BASELINES, MAX_EPISODE_S, plan_adapter
from chauffeur.bench.report.runs import NOTHING_DRIVEN, Run
from chauffeur.bench.report.sentences import ending_words
from chauffeur.concept import (
    LAMPILOT_LIMITS,
    ChauffeurError,
    Context,
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
from chauffeur.drive.episode import Episode
from chauffeur.drive.recording import RecordedTrip
from chauffeur.drive.session import drive_program, drive_without_program, make_trip
from chauffeur.safety.shield import Shield
from chauffeur.worlds.highway import HighwayWorld, MobilBaseline


class KeptDrive:
    """What a run kept of its items beside the results: contexts, plans, verdicts.

    Raises:
        DataError: A stage file cannot be read.
    """

    def __init__(self, run: Run) -> None:
        self._contexts = run.stage("contexts", "sample")
        self._plans = run.stage("generate", "item")
        self._rollouts = run.stage("rollout", "key")
        self._planner = str(run.rows[0].get("planner", ""))

    @property
    def baseline(self) -> str:
        """`idm` or `mobil`; empty for planners."""
        return self._planner if self._planner in BASELINES else ""

    def context(self, row: Row) -> Context | None:
        """C of the item's sample; None where the run kept none."""
        return _valid(context_adapter, (self._contexts.get(str(row["sample"])) or {}).get("context"))

    def plan(self, row: Row) -> Plan | None:
        """(R, P) of the item; None for baselines and calls that failed."""
        return _valid(plan_adapter, (self._plans.get(str(row["item"])) or {}).get("plan"))

    def shielded(self, row: Row) -> bool:
        """Whether the item was driven under the run-time shield."""
        return "shield" in (self._rollouts.get(str(row.get("rollout_key", ""))) or {})

    def verdicts(self, row: Row) -> tuple[Verdict, ...]:
        """What the checks said of the item's plan."""
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


def drive_again(row: Row, scenario: Scenario, kept: KeptDrive) -> tuple[RecordedTrip | None, str]:
    """Drive a row's item again.

    Returns:
        The recorded drive and what is to be said of it; no drive, and why, where none can be had.
    """
    if row["outcome"] in NOTHING_DRIVEN or not row.get("steps"):
        return None, "Nothing was driven."
    plan = kept.plan(row)
    world = HighwayWorld()
    try:
        observation = world.reset(scenario)
        referee = LampilotReferee(world, scenario)
        episode = _drive(row, plan, world, referee, kept)
    except ChauffeurError as error:
        return None, f"It could not be driven again: {error}"
    if episode is None:
        return None, "The run kept no program that could be driven again."
    note = ""
    if (episode.outcome, episode.ticks) != (row["outcome"], row["steps"]):
        again = ending_words({"outcome": episode.outcome, "success": episode.success, "steps": episode.ticks})
        note = (
            f"Driven again for this report, it ended differently: {again}. Another version or machine made the run, or "
            "the program ran out of computing time there."
        )
    context = kept.context(row) or describe(observation)
    request = PlanRequest(Instruction(str(row["command"]), source="benchmark"), context, SystemMessage(""))
    made = plan or Plan(Thoughts(""), None, planner=str(row.get("planner", "")))
    trip = make_trip(request, made, kept.verdicts(row), scenario, scenario.seed, episode, "")
    return RecordedTrip(trip, episode.frames, scenario, final=episode.final), note


def _drive(
    row: Row, plan: Plan | None, world: HighwayWorld, referee: LampilotReferee, kept: KeptDrive
) -> Episode | None:
    shield = Shield(world.dt_s, LAMPILOT_LIMITS) if kept.shielded(row) else None
    if kept.baseline == "mobil":
        adjust = MobilBaseline(world.perception()).choose
        return drive_without_program(world, referee, MAX_EPISODE_S, adjust=adjust, shield=shield)
    if kept.baseline:
        return drive_without_program(world, referee, MAX_EPISODE_S, shield=shield)
    if plan is None or not isinstance(plan.policy, Program):
        return None
    return drive_program(
        world,
        plan.policy.source,
        referee,
        MAX_EPISODE_S,
        library=plan.policy.library,
        shield=shield,
        limits=None if shield is None else LAMPILOT_LIMITS,
        stop_zone_m=ANY_STOP_M,
    )
