"""Work of a worker process: drive a policy on a sample. Values in, JSON values out."""

from __future__ import annotations

import atexit
import multiprocessing
import os
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

from pydantic import TypeAdapter

from chauffeur.bench.lampilot.expert import expert_program
from chauffeur.concept import ChauffeurError, Limits, Plan, Program, Scenario
from chauffeur.driving.episode import Episode, drive_program, drive_without_program
from chauffeur.driving.judge.lampilot import LampilotReferee
from chauffeur.driving.judge.metrics import ANY_STOP_M
from chauffeur.driving.planning import checked
from chauffeur.programs import UNHURRIED, Sandbox
from chauffeur.programs.library import standalone
from chauffeur.safety.checks import run_checks
from chauffeur.safety.shield import SHIELD_VERSION, Shield
from chauffeur.worlds.highway import HighwayWorld, MobilBaseline

ROLLOUT_VERSION = "lampilot-rollout-v3"
"""Changes whenever the same policy could drive differently."""

REHEARSAL_SEED = 0
"""Seed of the variants that a rehearsal draws."""

MAX_EPISODE_S = 1000.0
"""LaMPilot's own bound; each road ends its episodes earlier."""

BASELINES = ("idm", "mobil", "expert")
"""Methods that read no words: two drivers of traffic research, and the scripted expert, which is told the goal."""

plan_adapter: TypeAdapter[Plan] = TypeAdapter(Plan)


@dataclass(frozen=True, slots=True)
class RolloutJob:
    """A policy to drive on a sample.

    Attributes:
        key: Content hash of the job.
        scenario: The sample.
        baseline: One of BASELINES, or empty when `plan` drives.
        plan: JSON form of the plan.
        limits: Bounds for the checks.
        rehearse: Variants of the program to try on copies of the scene first; 0 drives the program itself.
        shield: Whether the run-time shield has the last word on every command.
    """

    key: str
    scenario: Scenario
    baseline: str
    plan: dict[str, Any] | None
    limits: Limits
    rehearse: int = 0
    shield: bool = False

    @property
    def near(self) -> str:
        return self.scenario.id

    def run(self) -> dict[str, Any]:
        return roll_out(self)

    def spoiled(self, detail: str) -> dict[str, Any]:
        about = {"key": self.key, "sample": self.scenario.id}
        return about | not_driven("not_driven", detail, infra_failed=True)


def roll_out(job: RolloutJob) -> dict[str, Any]:
    """Drive one job; a row keyed by `key`. Never raises for the policy's or the sample's faults."""
    row: dict[str, Any] = {"key": job.key, "sample": job.scenario.id, "rollout": ROLLOUT_VERSION}
    world = HighwayWorld()
    try:
        observation = world.reset(job.scenario)
        referee = LampilotReferee(world, job.scenario)
    except ChauffeurError as error:
        return row | not_driven("not_driven", str(error), infra_failed=True)
    shield = Shield(world.dt_s, job.limits) if job.shield else None
    if shield is not None:
        row["shield"] = SHIELD_VERSION
    program = None
    try:
        if job.baseline == "expert":
            program = Program(expert_program(job.scenario.goal))
        elif not job.baseline:
            found = checked(plan_adapter.validate_python(job.plan), observation, job.limits)
            row["verdicts"] = [asdict(v) for v in found.verdicts]
            if found.refusal:
                failed = found.unusable
                return row | not_driven("refused", found.refusal, refused=not failed, policy_failed=failed)
            assert isinstance(found.plan.policy, Program)
            program = found.plan.policy
        if job.rehearse and program is not None:
            program, row["rehearsal"] = _rehearsed(job, world, program)
        sandbox = None if program is None else _sandbox()
        episode = drive_policy(world, referee, job.baseline, program, shield, job.limits, sandbox=sandbox)
    except ChauffeurError as error:
        return row | not_driven("not_driven", str(error), infra_failed=True)
    return row | _driven(episode, referee)


def drive_policy(
    world: HighwayWorld,
    referee: LampilotReferee,
    baseline: str,
    program: Program | None,
    shield: Shield | None,
    limits: Limits,
    *,
    record: bool = False,
    sandbox: Sandbox | None = None,
) -> Episode:
    """Drive a sample from the world's present instant.

    Args:
        world: Just reset to the sample.
        referee: Judges the drive.
        baseline: `idm` or `mobil` where there is no program.
        program: What drives otherwise, checked.
        shield: Has the last word on every command; None for none.
        limits: Bound the set-points where there is a shield.
        record: Whether frames are kept.
        sandbox: Where the program runs; None opens one for this drive.

    Raises:
        SandboxError: No worker can be had.
    """
    if program is None:
        adjust = MobilBaseline(world.perception()).choose if baseline == "mobil" else None
        return drive_without_program(world, referee, MAX_EPISODE_S, record=record, adjust=adjust, shield=shield)
    return drive_program(
        world,
        program.source,
        referee,
        MAX_EPISODE_S,
        record=record,
        library=program.library,
        sandbox=sandbox,
        shield=shield,
        limits=None if shield is None else limits,
        stop_zone_m=ANY_STOP_M,
    )


def _rehearsed(job: RolloutJob, world: HighwayWorld, program: Program) -> tuple[Program, dict[str, int]]:
    """The variant to drive, and which of how many it was. Raises ScenarioError, SandboxError."""
    from chauffeur.bench.lampilot.rehearse import candidates, rehearsed

    if not job.baseline and program.library:
        # The numbers that drive are the library's: what is varied has to hold them.
        program = replace(program, source=standalone(program.source, "drive", program.library), library="")
    written = "" if job.baseline else program.source
    sources = candidates(job.scenario.goal, job.rehearse, REHEARSAL_SEED, written)
    plan = None if job.baseline else plan_adapter.validate_python(job.plan)
    while True:
        choice = rehearsed(world, job.scenario, sources, library=program.library)
        chosen = replace(program, source=choice.source)
        # What is driven has passed the checks: the first program has, and of the others only the best need be asked.
        if plan is None or choice.index == 0 or _passes(replace(plan, policy=chosen), world, job.limits):
            return chosen, {"tried": len(sources), "chosen": choice.index}
        sources = [source for source in sources if source != choice.source]


def _passes(plan: Plan, world: HighwayWorld, limits: Limits) -> bool:
    return all(verdict.passed for verdict in run_checks(plan, world.observe(), limits))


@lru_cache(maxsize=1)
def _sandbox() -> Sandbox:
    """This process's sandbox: opening one takes longer than most programs run.

    A rollout process stays on one core, where its programs run too: they take turns, and changing cores costs more
    than a turn.
    """
    if multiprocessing.parent_process() is not None and hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))
        number = multiprocessing.current_process().name.rpartition("-")[2]  # workers are numbered as they start
        os.sched_setaffinity(0, {cores[(int(number) if number.isdigit() else os.getpid()) % len(cores)]})
    sandbox = Sandbox(UNHURRIED)
    atexit.register(sandbox.close)
    return sandbox


def _driven(episode: Episode, referee: LampilotReferee) -> dict[str, Any]:
    return {
        "outcome": episode.outcome,
        "success": episode.success,
        "steps": episode.ticks,
        "signals": referee.signals().as_row(),
        **({"interventions": episode.interventions} if episode.interventions else {}),
        **_causes(asdict(episode.causes)),
    }


def not_driven(outcome: str, detail: str, **flags: bool) -> dict[str, Any]:
    """Columns of a job that was not driven, with its causes."""
    return {
        "outcome": outcome,
        "success": False,
        "steps": 0,
        "signals": None,
        **_causes({**flags, "detail": detail}),
    }


def _causes(flags: dict[str, Any]) -> dict[str, Any]:
    names = ("policy_failed", "infra_failed", "refused", "fallback_used")
    return {name: bool(flags.get(name, False)) for name in names} | {"detail": str(flags.get("detail", ""))}
