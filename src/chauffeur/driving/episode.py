"""The control loop of a trip in simulated time.

Each control period: the policy states its set-points, limits bound them, the driver turns them into a command, the
world applies it, the referee looks. A policy that fails loses control at once: the driver goes on with fallback
set-points for a moment, and the trip ends; what it would have done without the policy is never counted as the policy's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, runtime_checkable

from chauffeur.concept import (
    STOP_ZONE_M,
    Causes,
    ChauffeurError,
    Command,
    Frame,
    JudgedBy,
    Limits,
    Metric,
    Observation,
    Outcome,
    Policy,
    Program,
    ProgramState,
    SandboxError,
    Scenario,
    Setpoints,
    WishPart,
)
from chauffeur.concept.registry import load_plugin
from chauffeur.driving.actuate import actuate, set_points
from chauffeur.driving.fallback import keep_lane_and_gap
from chauffeur.executors import executor_for
from chauffeur.executors.base import DriverLed, Executor, HeldSetpoints, PolicyTick, RunningPolicy
from chauffeur.executors.program import ProgramDrive
from chauffeur.executors.registry import OfKind
from chauffeur.programs.sandbox import Sandbox
from chauffeur.safety.bounds import least_target_mps
from chauffeur.safety.shield import Shield, shield_for
from chauffeur.worlds.base import EGO, World

FALLBACK_S = 10.0
"""How long the fallback drives after a policy failed, before the trip is ended."""
AFTER_END_S = 3.0
"""How long a trip without a referee goes on after its program finished."""


def make_world(scenario: Scenario) -> World:
    """A fresh world of the scenario's kind. Raises ConfigError for an unknown kind."""
    world: World = load_plugin("chauffeur.worlds", scenario.world)()
    return world


class CommandSource(Protocol):
    """Commands from outside, asked for once per control period in place of the world's driver."""

    def command(self) -> Command | None:
        """The command of this period; None once the source has given up: the trip ends there."""
        ...


class Referee(Protocol):
    """Judges a trip while it is driven."""

    def observe(self) -> None:
        """Look at the instant after a control period."""
        ...

    @property
    def over(self) -> bool: ...
    @property
    def success(self) -> bool: ...
    def outcome(self) -> Outcome: ...
    def metrics(self) -> tuple[Metric, ...]: ...


@runtime_checkable
class FollowsPolicy(Protocol):
    """What a referee offers that judges a trip by what its policy asks for."""

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """The set-points of a control period, and the program's state, before `observe`."""
        ...


@runtime_checkable
class TellsParts(Protocol):
    """What a referee offers that judges a wish part by part."""

    @property
    def parts(self) -> tuple[WishPart, ...]:
        """The things asked for and what became of each so far."""
        ...

    @property
    def judged_by(self) -> JudgedBy:
        """Source of what the drive is judged by."""
        ...


@dataclass(frozen=True, slots=True)
class Episode:
    """A driven trip, before it is filed.

    Attributes:
        frames: One per control period; empty when not recorded.
        final: The last instant.
        ticks: Control periods driven.
        duration_s: Simulated time driven.
        outcome, causes, metrics: What happened, why, and the scores.
        said: What the passenger was told, as (time s, text).
        success: The referee's success flag.
        interventions: Control periods in which the shield changed the command.
        bounded: Set-points that were brought within the limits, by name, with the number of control periods.
        parts: The things asked for and what became of each; empty where nothing was judged.
        judged_by: Source of what the drive was judged by; empty where nothing was judged.
    """

    frames: tuple[Frame, ...]
    final: Observation
    ticks: int
    duration_s: float
    outcome: Outcome
    causes: Causes
    metrics: tuple[Metric, ...]
    said: tuple[tuple[float, str], ...]
    success: bool
    interventions: int = 0
    bounded: tuple[tuple[str, int], ...] = ()
    parts: tuple[WishPart, ...] = ()
    judged_by: JudgedBy | Literal[""] = ""


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


def run_episode(
    world: World,
    policy: Executor | RunningPolicy | None,
    referee: Referee | None,
    *,
    max_s: float,
    record: bool = True,
    adjust: Callable[[Setpoints], Setpoints] | None = None,
    watch: Callable[[Frame], None] | None = None,
    command_source: CommandSource | None = None,
    shield: Shield | None = None,
    limits: Limits | None = None,
    minimum_speed: bool = False,
) -> Episode:
    """Drive until the referee says that it is over, the world ends, the program has ended, or `max_s` have passed.

    Args:
        world: A world just reset.
        policy: An executor that was started, or what states set-points for the world's own driver; None leaves that
            driver alone (the IDM baseline).
        referee: Says when it is over and what came of it; None drives on until the program has ended.
        max_s: Bound of the trip in simulated time, s.
        record: Whether to keep frames (a benchmark does not need them).
        adjust: Baseline that rewrites settled set-points each period, e.g. MOBIL's lane choice.
        watch: Called with each recorded frame, for live display.
        command_source: Acts in place of the driver; what a policy beside it asks for is shown, not driven.
        shield: Has the last word on every command; None where a benchmark's own rules allow none.
        limits: Bounds of the set-points, whatever the policy answers in a period; None where a benchmark's own rules
            know none.
        minimum_speed: Whether they hold the least speed of a highway, too: all but the car's own stop does.
    """
    driver = world.driver()
    steers = policy if isinstance(policy, Executor) and not isinstance(policy, DriverLed) else None
    follows = referee if isinstance(referee, FollowsPolicy) else None  # a protocol's check costs as much as a step
    frames: list[Frame] = []
    said: list[tuple[float, str]] = []
    failure: ChauffeurError | None = None
    held = driver.initial_setpoints()
    bounded = Counter[str]()
    idle = 0
    ticks = changed = 0
    end = round(max_s / world.dt_s)
    while ticks < end:
        at_s = ticks * world.dt_s
        if command_source is not None:
            held = driver.initial_setpoints()  # a person tells nobody what they want: what is stands for it
        tick = _ask(policy, held) if failure is None else HeldSetpoints(held, state="failed")
        said.extend((at_s, text) for text in tick.said)
        if tick.error is not None:
            failure = tick.error
            ego = world.perception().vehicle(EGO)
            safe = keep_lane_and_gap(tick.setpoints, max(0.0, ego.speed_mps), ego.lane)
            tick = HeldSetpoints(safe, state="failed", line=tick.line, said=tick.said, calls=tick.calls)
            end = min(end, ticks + round(FALLBACK_S / world.dt_s))
        setpoints = tick.setpoints if steers is not None and failure is None else driver.settle(tick.setpoints)
        if adjust is not None:
            setpoints = adjust(setpoints)
        looks = record or shield is not None or limits is not None or steers is not None
        before = world.observe() if looks else None
        if limits is not None and before is not None:
            least = least_target_mps(before, setpoints, limits) if minimum_speed and failure is None else 0.0
            setpoints, names = set_points(world, before, setpoints, limits, least)
            bounded.update(names)
        held = setpoints
        acts = command_source is not None and (policy is None or failure is None)
        if command_source is not None and acts:
            requested = command_source.command()
        elif steers is not None and before is not None and failure is None:
            requested = steers.step(before, setpoints)
        else:
            requested = driver.command(setpoints)
        if requested is None:
            failure = ChauffeurError(f"Given up by the driver after {at_s:.1f} s.")
            break
        done = actuate(world, before, requested, setpoints.target_lane, shield)
        changed += bool(done.interventions)
        ticks += 1
        if record and before is not None:
            frame = Frame(
                before,
                setpoints,
                requested,
                done.applied,
                tick.state,
                tick.line,
                tick.said,
                tick.calls,
                done.interventions,
            )
            frames.append(frame)
            if watch is not None:
                watch(frame)
        if referee is not None:
            if follows is not None:
                follows.follow(setpoints, tick.state)
            referee.observe()
            if referee.over and failure is None:
                break
        if world.ended:
            break
        if referee is None and tick.state == "finished":
            idle += 1
            if idle * world.dt_s >= AFTER_END_S:
                break
    final = world.observe()
    success = referee is not None and referee.success and failure is None
    return Episode(
        frames=tuple(frames),
        final=final,
        ticks=ticks,
        duration_s=round(ticks * world.dt_s, 3),
        outcome=_outcome(final, referee, failure),
        causes=Causes()
        if failure is None
        else _causes(failure, fallback_used=command_source is None or policy is not None),
        metrics=() if referee is None else referee.metrics() if failure is None else _void(referee.metrics()),
        said=tuple(said),
        success=success,
        interventions=changed,
        bounded=tuple(bounded.items()),
        parts=_parts(referee, success=success),
        judged_by="" if referee is None else referee.judged_by if isinstance(referee, TellsParts) else "goal",
    )


def _parts(referee: Referee | None, *, success: bool) -> tuple[WishPart, ...]:
    """The things asked for and what became of each; of a judge that knows one goal, that."""
    if isinstance(referee, TellsParts):
        return referee.parts
    return () if referee is None else (WishPart("done" if success else "not_done"),)


def _ask(policy: RunningPolicy | None, held: Setpoints) -> PolicyTick:
    """The policy's tick; a broken sandbox is a failed tick with the set-points held, never an exception here."""
    if policy is None:
        return HeldSetpoints(held)
    try:
        return policy.tick()
    except SandboxError as error:
        return HeldSetpoints(held, state="failed", error=error)


def _outcome(final: Observation, referee: Referee | None, failure: ChauffeurError | None) -> Outcome:
    if final.ego.crashed:
        return "collision"
    if final.off_road:
        return "off_road"
    if failure is not None:
        return "failure"
    return "ended" if referee is None else referee.outcome()


def _causes(failure: ChauffeurError, *, fallback_used: bool) -> Causes:
    infra = isinstance(failure, SandboxError)
    return Causes(policy_failed=not infra, infra_failed=infra, fallback_used=fallback_used, detail=str(failure))


def _void(metrics: tuple[Metric, ...]) -> tuple[Metric, ...]:
    """Scores of a failed policy: its parts do not apply and its total is 0, whatever the fallback achieved."""
    return tuple(
        replace(m, value=0.0) if m.id.startswith("lampilot-score") else replace(m, applies=False) for m in metrics
    )
