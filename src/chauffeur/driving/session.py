"""One wish driven from end to end with real parts: what `chauffeur drive` and the replay use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

from chauffeur.concept import (
    CameraImage,
    Context,
    Feedback,
    History,
    Instruction,
    InstructionError,
    Limits,
    Observation,
    PersonId,
    Plan,
    PlanRequest,
    Scenario,
    ScenarioError,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.describe import describe_with_traffic
from chauffeur.describe.services.sources import SourceSettings
from chauffeur.driving.emergency import not_checked
from chauffeur.driving.episode import Episode, Referee, drive_policy, make_world, trip_s
from chauffeur.driving.events import DriveEvent, Listener, nobody_listens
from chauffeur.driving.judge.effects import effect_of
from chauffeur.driving.loop import LoopMemory, drive, steps_at
from chauffeur.driving.planning import Planned, PlanSteps, no_pictures, request_once
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.surroundings import describing, opened, weathered
from chauffeur.driving.trips import make_trip
from chauffeur.memory.tolerant import TolerantMemory
from chauffeur.planners.base import Planner, looks
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.programs.catalogue import Vocabulary, vocabulary_of
from chauffeur.safety.base import Check
from chauffeur.safety.checks import drive_checks, run_checks
from chauffeur.safety.faithfulness import DRIVEN_CHECK, FAITHFULNESS_CHECK, check_driven, check_faithfulness
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
        world = make_world(scenario)
        steps, memory = await self._steps(world, scenario, seed, limits)
        trip = await drive(wish, steps, partial(self._execute, world, scenario, seed), memory)
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
        steps, _ = await self._steps(make_world(scenario), scenario, seed, limits)
        return await request_once(wish, steps)

    async def _steps(self, world: World, scenario: Scenario, seed: int, limits: Limits) -> tuple[PlanSteps, LoopMemory]:
        memory = TolerantMemory(self.memory, lambda text: self.tell(DriveEvent("trouble", text=text)))
        describe = weathered(world, await self._describing())
        steps = steps_at(
            world.reset(scenario, seed),
            self.planner,
            memory,
            limits,
            describe=describe,
            system=partial(self._build_system, vocabulary_of(world.capabilities.roads[0])),
            check=check_drive,
            tell=self.tell,
            see=partial(self._see, SeatCamera(world, seed)) if looks(self.planner) else no_pictures,
            shows=self.seeing is None,
        )
        return steps, memory

    def _see(self, camera: SeatCamera, observation: Observation) -> tuple[CameraImage, ...]:
        self._view = camera.take(observation)
        return self._view

    async def _describing(self) -> Callable[[Observation], Context]:
        async with opened(self.sources) as sources:
            return await describing(sources, self.seeing or describe_with_traffic)

    def _build_system(self, vocabulary: Vocabulary, limits: Limits) -> SystemMessage:
        self._system = build_system_message(self.setting, limits=limits, vocabulary=vocabulary)
        return self._system

    def _execute(self, world: World, scenario: Scenario, seed: int, planned: Planned) -> Trip:
        file = partial(make_trip, scenario=scenario, seed=seed, shielded=self.shielded)
        plan, limits = planned.plan, planned.request.limits
        if planned.refusal:
            return file(planned, episode=None, refusal=planned.refusal)
        assert plan.policy is not None
        try:
            self._episode = episode = drive_policy(
                world,
                plan.policy,
                self.referee(world, scenario, plan, planned.request.instruction.text),
                self.max_s or trip_s(scenario),
                limits,
                watch=lambda frame: self.tell(DriveEvent("period", value=frame)),
                shielded=self.shielded,
                minimum_speed=planned.verdicts != not_checked(plan),
            )
        except ScenarioError as error:  # the road has no such way: known only when the policy meets the world
            return file(planned, episode=None, refusal=str(error))
        told = _check_driven(plan, episode, limits)
        self.tell(DriveEvent("verdicts", value=told))
        return file(replace(planned, verdicts=planned.verdicts + told), episode=episode)


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
