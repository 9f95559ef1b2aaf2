"""One wish driven from end to end with real parts: what `chauffeur drive` and the replay use."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from importlib.metadata import version
from typing import Any

from chauffeur.concept import (
    STOP_ZONE_M,
    CameraImage,
    Causes,
    Context,
    Feedback,
    Frame,
    History,
    Instruction,
    InstructionError,
    Limits,
    Observation,
    PersonId,
    Plan,
    PlanRequest,
    Policy,
    Program,
    Scenario,
    ScenarioError,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.concept.registry import load_plugin
from chauffeur.describe import describe_with_traffic
from chauffeur.describe.services.sources import SourceSettings
from chauffeur.driving.emergency import not_checked
from chauffeur.driving.episode import Episode, Referee, run_episode
from chauffeur.driving.events import DriveEvent, Listener, nobody_listens
from chauffeur.driving.judge.account import unused_of
from chauffeur.driving.judge.effects import effect_of
from chauffeur.driving.loop import LoopMemory, Stages, drive, steps_of
from chauffeur.driving.planning import declined, no_pictures, request_once, unusable
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.surroundings import describing, opened, weathered
from chauffeur.executors import Executor, executor_for
from chauffeur.executors.program import ProgramDrive
from chauffeur.executors.registry import OfKind
from chauffeur.memory.tolerant import TolerantMemory
from chauffeur.planners.base import Planner, looks
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.programs.catalogue import Vocabulary, vocabulary_of
from chauffeur.programs.sandbox import Sandbox
from chauffeur.safety.base import Check
from chauffeur.safety.checks import drive_checks, run_checks
from chauffeur.safety.faithfulness import DRIVEN_CHECK, FAITHFULNESS_CHECK, check_driven, check_faithfulness
from chauffeur.safety.shield import SHIELD_VERSION, Shield, shield_for
from chauffeur.worlds.base import World

MAX_WISH_CHARACTERS = 2000

RefereeMaker = Callable[[World, Scenario, Plan, str], Referee | None]
"""Makes the judge of a trip: of its world, its scenario, its plan and the words of the wish."""


def _no_referee(world: World, scenario: Scenario, plan: Plan, wish: str) -> Referee | None:
    del world, scenario, plan, wish
    return None


class Forgetful:
    """The memory of nobody: recalls nothing, keeps nothing."""

    def recall(self, person: PersonId, instruction: Instruction, context: object, k: int) -> History:
        """Nothing."""
        del person, instruction, context, k
        return History()

    def remember(self, trip: Trip, feedback: Feedback | None) -> None:
        """Nothing."""
        del trip, feedback


def parse_wish(text: str, person: PersonId) -> Instruction:
    """The wish as an instruction. Raises InstructionError when it is empty or too long to be one."""
    wish = " ".join(text.split())
    if not wish:
        raise InstructionError("The wish is empty.", hint='Say what you want, e.g. chauffeur drive "Overtake the car".')
    if len(wish) > MAX_WISH_CHARACTERS:
        raise InstructionError(
            f"The wish has {len(wish)} characters; {MAX_WISH_CHARACTERS} are the most a wish may have.",
            hint="Say it in a sentence or two.",
        )
    return Instruction(text=wish, person=person)


def make_world(scenario: Scenario) -> World:
    """A fresh world of the scenario's kind. Raises ConfigError for an unknown kind."""
    world: World = load_plugin("chauffeur.worlds", scenario.world)()
    return world


@dataclass(slots=True)
class Session:
    """One trip's parts and what came of them.

    Attributes:
        planner: Who plans.
        memory: Who remembers.
        sources: Whom C is completed from; None for nobody.
        referee: Makes the judge of a trip; returning None drives freely.
        tell: Hears the loop's letters as they come, each control period, and the trip.
        seeing: Makes C of an observation in place of the descriptors that read the world's own state; None for those.
        setting: Whether S carries examples.
        max_s: Bound of the trip in simulated time; default that of the kind of world.
        shielded: Whether the run-time shield has the last word on every command.
    """

    planner: Planner
    memory: LoopMemory = field(default_factory=Forgetful)
    sources: SourceSettings | None = None
    referee: RefereeMaker = _no_referee
    tell: Listener = nobody_listens
    seeing: Callable[[Observation], Context] | None = None
    setting: Setting = "few-shot"
    max_s: float | None = None
    shielded: bool = True
    _episode: Episode | None = None
    _system: SystemMessage | None = None
    _view: tuple[CameraImage, ...] = ()

    async def drive(self, wish: Instruction, scenario: Scenario, seed: int, limits: Limits) -> RecordedTrip:
        """Drive one wish.

        Raises:
            ChauffeurError: No plan could be had, or the scenario cannot be set up. The simulated car has not moved.
        """
        self._episode, self._view = None, ()  # a wish that is refused must not be filed with the drive before it
        trip = await drive(wish, scenario, seed, limits, await self._stages(make_world(scenario), seed))
        episode = self._episode
        return RecordedTrip(
            trip=trip,
            frames=() if episode is None else episode.frames,
            scenario=scenario,
            system=self._system,
            final=None if episode is None else episode.final,
            view=self._view[-1] if self._view else None,
        )

    async def request(self, wish: Instruction, scenario: Scenario, seed: int, limits: Limits) -> PlanRequest:
        """What `drive` would ask the planner. Nobody is asked and nothing is driven.

        Raises:
            ChauffeurError: The scenario cannot be set up.
        """
        stages = await self._stages(make_world(scenario), seed)
        return await request_once(wish, steps_of(stages, stages.world.reset(scenario, seed), limits))

    async def _stages(self, world: World, seed: int) -> Stages:
        return Stages(
            world=world,
            describe=weathered(world, await self._describing()),
            memory=TolerantMemory(self.memory, lambda text: self.tell(DriveEvent("trouble", text=text))),
            system=partial(self._build_system, vocabulary_of(world.capabilities.roads[0])),
            planner=self.planner,
            check=check_drive,
            execute=partial(self._execute, world),
            tell=self.tell,
            see=partial(self._see, SeatCamera(world, seed)) if looks(self.planner) else no_pictures,
            shows=self.seeing is None,
        )

    def _see(self, camera: SeatCamera, observation: Observation) -> tuple[CameraImage, ...]:
        self._view = camera.take(observation)
        return self._view

    async def _describing(self) -> Callable[[Observation], Context]:
        async with opened(self.sources) as sources:
            return await describing(sources, self.seeing or describe_with_traffic)

    def _build_system(self, vocabulary: Vocabulary, limits: Limits) -> SystemMessage:
        self._system = build_system_message(self.setting, limits=limits, vocabulary=vocabulary)
        return self._system

    def _execute(
        self,
        world: World,
        request: PlanRequest,
        plan: Plan,
        verdicts: tuple[Verdict, ...],
        scenario: Scenario,
        seed: int,
    ) -> Trip:
        refused = declined(plan, verdicts)
        if refused:
            return make_trip(request, plan, verdicts, scenario, seed, None, refused, shielded=self.shielded)
        assert plan.policy is not None
        try:
            referee = self.referee(world, scenario, plan, request.instruction.text)
            self._episode = drive_policy(
                world,
                plan.policy,
                referee,
                self.max_s or trip_s(scenario),
                request.limits,
                watch=lambda frame: self.tell(DriveEvent("period", value=frame)),
                shielded=self.shielded,
                minimum_speed=verdicts != not_checked(plan),
            )
        except ScenarioError as error:  # the road has no such way: known only when the policy meets the world
            return make_trip(request, plan, verdicts, scenario, seed, None, str(error), shielded=self.shielded)
        told = _check_driven(plan, self._episode, request.limits)
        self.tell(DriveEvent("verdicts", value=told))
        return make_trip(request, plan, verdicts + told, scenario, seed, self._episode, "", shielded=self.shielded)


def check_drive(plan: Plan, observation: Observation, limits: Limits) -> tuple[Verdict, ...]:
    """All verdicts before a drive: of the checks that can stop it, and whether the explanation fits the program."""
    return run_checks(plan, observation, limits, drive_checks()) + informed(
        FAITHFULNESS_CHECK, plan, observation, limits, check_faithfulness
    )


def _check_driven(plan: Plan, episode: Episode, limits: Limits) -> tuple[Verdict, ...]:
    """Whether the drive went as explained; nothing where nothing was driven."""
    if not episode.frames:
        return ()

    def driven(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
        del limits
        return check_driven(plan, observation, effect_of(episode))

    return informed(DRIVEN_CHECK, plan, episode.frames[0].observation, limits, driven)


def informed(name: str, plan: Plan, observation: Observation, limits: Limits, check: Check) -> tuple[Verdict, ...]:
    """What a check says that only informs: one that breaks has compared nothing, which is told, and stops nothing."""
    verdicts = run_checks(plan, observation, limits, (check,))
    return tuple(replace(verdict, check=name, vetoes=False) for verdict in verdicts)


def trip_s(scenario: Scenario) -> float:
    """How long a trip may take, in simulated time."""
    return make_world(scenario).capabilities.horizon_s


def drive_policy(
    world: World,
    policy: Policy,
    referee: Referee | None,
    max_s: float,
    limits: Limits,
    *,
    watch: Callable[[Frame], None] | None = None,
    shielded: bool = True,
    sandbox: Sandbox | None = None,
    minimum_speed: bool = False,
) -> Episode:
    """Drive a checked policy of any kind that drives simulated cars, on a world just reset.

    `sandbox` lends a program one that is open already; `minimum_speed` holds it to the least speed of a highway.

    Raises:
        ScenarioError: The road has no such way, or this kind of policy drives no car here.
    """
    return drive_executed(
        world,
        policy,
        referee,
        max_s=max_s,
        limits=limits,
        shield=shield_for(world, limits) if shielded else None,
        watch=watch,
        minimum_speed=minimum_speed and policy.kind == "program",
        executor=ProgramDrive(world, sandbox=sandbox) if policy.kind == "program" else None,
    )


def drive_program(
    world: World,
    source: str,
    referee: Referee | None,
    max_s: float,
    watch: Callable[[Frame], None] | None = None,
    *,
    record: bool = True,
    library: str = "",
    sandbox: Sandbox | None = None,
    shield: Shield | None = None,
    limits: Limits | None = None,
    minimum_speed: bool = False,
    stop_zone_m: float = STOP_ZONE_M,
) -> Episode:
    """Run a checked program, with the helper functions it may call, on a world just reset.

    Simulated time waits for the program, so its budgets are wide: how busy the machine is must not change a trip.
    `sandbox` lends one that is open already; otherwise one is opened for this drive. `shield` has the last word on
    every command, `limits` bound the set-points, and a stop within `stop_zone_m` of its sign serves it; LaMPilot's own
    rules know neither shield nor bounds.
    """
    return drive_executed(
        world,
        Program(source, library=library),
        referee,
        max_s=max_s,
        limits=limits,
        shield=shield,
        record=record,
        watch=watch,
        minimum_speed=minimum_speed,
        executor=ProgramDrive(world, sandbox=sandbox, stop_zone_m=stop_zone_m),
    )


def drive_executed(
    world: World,
    policy: OfKind,
    referee: Referee | None = None,
    *,
    max_s: float,
    limits: Limits | None = None,
    shield: Shield | None = None,
    record: bool = True,
    watch: Callable[[Frame], None] | None = None,
    minimum_speed: bool = False,
    executor: Executor | None = None,
) -> Episode:
    """The one way a policy of any kind is driven in simulated time, on a world just reset.

    `executor` drives it, by default the one that is registered for its kind; it is closed in the end.

    Raises:
        ScenarioError: It cannot be driven in this world.
        MissingExtraError: What its executor needs is not installed.
    """
    with closing(executor_for(policy, world) if executor is None else executor) as driving:
        driving.start(policy, world.observe(), Limits() if limits is None else limits)
        return run_episode(
            world,
            driving,
            referee,
            max_s=max_s,
            record=record,
            watch=watch,
            shield=shield,
            limits=limits,
            minimum_speed=minimum_speed,
        )


def drive_without_program(world: World, referee: Referee | None, max_s: float, **options: Any) -> Episode:
    """Let the world's own driver keep its initial wishes: the IDM baseline."""
    return run_episode(world, None, referee, max_s=max_s, **options)


def make_trip(
    request: PlanRequest,
    plan: Plan,
    verdicts: tuple[Verdict, ...],
    scenario: Scenario,
    seed: int,
    episode: Episode | None,
    refusal: str,
    *,
    shielded: bool = False,
) -> Trip:
    """File what happened, with its provenance."""
    record = provenance(plan, scenario, seed, request.limits)
    if shielded:
        record = (*record, ("shield", SHIELD_VERSION))
    if verdicts[: len(own := not_checked(plan))] != own:
        record = (*record, ("minimum_speed", True))
    if episode is not None and episode.bounded:
        record = (*record, ("bounded", dict(episode.bounded)))
    if episode is None:
        failed = unusable(plan, verdicts)
        causes = Causes(refused=not failed, policy_failed=failed, detail=refusal)
    else:
        causes = episode.causes
    return Trip(
        id=trip_id(request.instruction, request.limits, plan, scenario, seed),
        instruction=request.instruction,
        context=request.context,
        history=request.history,
        plan=plan,
        verdicts=verdicts,
        outcome="refused" if episode is None else episode.outcome,
        causes=causes,
        metrics=() if episode is None else episode.metrics,
        duration_s=0.0 if episode is None else episode.duration_s,
        scenario=scenario.id,
        seed=seed,
        said=() if episode is None else episode.said,
        record=record,
        unused=() if episode is None else unused_of(request.instruction.text, plan),
        parts=() if episode is None else episode.parts,
        judged_by="" if episode is None else episode.judged_by,
    )


def trip_id(
    instruction: Instruction, limits: Limits, plan: Plan, scenario: Scenario, seed: int, *, tick: int = 0
) -> str:
    """Content hash of what decides a trip: wish, scenario, seed, limits, planner and policy, and when it was wished."""
    policy = str(plan.policy)
    if isinstance(plan.policy, Program):
        policy = "\0".join(text for text in (plan.policy.source, plan.policy.library) if text)
    parts = [
        instruction.text,
        str(instruction.person),
        scenario_hash(scenario),
        str(seed),
        str(limits),
        plan.planner,
        plan.model,
        policy,
        plan.refusal,
        *([str(tick)] if tick else []),
    ]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def scenario_hash(scenario: Scenario) -> str:
    """SHA-256 of a scenario's content."""
    return hashlib.sha256(json.dumps(asdict(scenario), sort_keys=True).encode()).hexdigest()


def provenance(plan: Plan, scenario: Scenario, seed: int, limits: Limits) -> tuple[tuple[str, Any], ...]:
    """What a result must name to be repeated."""
    return (
        ("chauffeur", version("chauffeur")),
        ("engine", make_world(scenario).engine),
        ("python", platform.python_version()),
        ("planner", plan.planner),
        ("model", plan.model),
        ("scenario_sha256", scenario_hash(scenario)),
        ("seed", seed),
        ("limits", asdict(limits)),
        ("simulated", True),
    )
