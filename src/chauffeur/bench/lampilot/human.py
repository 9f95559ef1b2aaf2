"""LaMPilot-Bench driven by hand (paper Tab. IV, row Human Driver): a person's drive on a sample, recorded and judged.

The drive is judged by the same referee as every program. What the hands did is kept as a trace, and driving the trace
again gives the same row: the person stands where a planner stands, the trace where its program stands.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from typing import Literal

from pydantic import TypeAdapter

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.referee import LampilotReferee
from chauffeur.bench.lampilot.rollout import MAX_EPISODE_S, not_driven
from chauffeur.concept import Command, Plan, Scenario, Thoughts
from chauffeur.drive.episode import CommandSource, run_episode
from chauffeur.worlds.highway import HighwayWorld

PLANNER = "human"
"""What a human driver's rows have in the column `planner`; the driver's name stands in `model`."""

TRACE_VERSION = "hands-v2"
"""Changes whenever what a trace holds, or how keys become commands, changes; `hands-v1` had steering to the right."""


@dataclass(frozen=True, slots=True)
class Pause:
    """The drive stood still before control period `tick` for `seconds`, as the person asked or because the page fell
    silent."""

    tick: int
    seconds: float
    why: Literal["asked", "silent"]


@dataclass(frozen=True, slots=True)
class HandTrace:
    """What a person's hands did in a drive.

    Attributes:
        period_s: Control period.
        keys: Keys held in each period, as bits (left 1, right 2, gas 4, brake 8).
        commands: What was asked of the vehicle in each period, as (acceleration m/s2, steering rad, left positive).
        pauses: Where the drive stood still.
        releases: How often the page fell silent and the keys were taken as released.
        late: Periods that began late on the driver's machine.
        worst_late_s: By how much at most.
        assist: Whether the lane-keeping assist was on.
        version: See TRACE_VERSION.
    """

    period_s: float
    keys: tuple[int, ...]
    commands: tuple[tuple[float, float], ...]
    pauses: tuple[Pause, ...] = ()
    releases: int = 0
    late: int = 0
    worst_late_s: float = 0.0
    assist: bool = False
    version: str = TRACE_VERSION


trace_adapter: TypeAdapter[HandTrace] = TypeAdapter(HandTrace)


class RecordedCommands:
    """The hands of a trace; where it ends, they leave the wheel."""

    def __init__(self, trace: HandTrace) -> None:
        left = -1.0 if trace.version == "hands-v1" else 1.0
        self._commands = iter([(acceleration, 0.0 + left * steering) for acceleration, steering in trace.commands])

    def command(self) -> Command | None:
        """See Hands."""
        recorded = next(self._commands, None)
        return None if recorded is None else Command(*recorded)


def drive_by_hand(world: HighwayWorld, scenario: Scenario, command_source: CommandSource) -> Row:
    """Drive a world just reset to `scenario`; what happened, as columns of a rollout row.

    Raises:
        ScenarioError: The scenario's goal cannot apply to this start.
    """
    referee = LampilotReferee(world, scenario)
    episode = run_episode(world, None, referee, max_s=MAX_EPISODE_S, record=False, command_source=command_source)
    return {
        "outcome": episode.outcome,
        "success": episode.success,
        "steps": episode.ticks,
        "signals": referee.signals().as_row(),
        **asdict(episode.causes),
    }


def drive_again(scenario: Scenario, trace: HandTrace) -> Row:
    """What happens when the commands of a trace are driven again: the row of the drive itself.

    Raises:
        ScenarioError: The scenario cannot be set up.
    """
    world = HighwayWorld()
    world.reset(scenario)
    return noted(drive_by_hand(world, scenario, RecordedCommands(trace)), trace)


def noted(row: Row, trace: HandTrace) -> Row:
    """What happened, with the pauses of the drive added to its detail."""
    if not trace.pauses:
        return row
    seconds = sum(pause.seconds for pause in trace.pauses)
    times = "once" if len(trace.pauses) == 1 else f"{len(trace.pauses)} times"
    return row | {"detail": f"{row['detail']} Paused {times}, {seconds:.1f} s in all.".strip()}


def hand_plan(driver: str, trace: HandTrace | None) -> Plan:
    """What stands where other methods have their plan: no policy, but whose command_source, and which trace of them.

    The trace's hash is in the intent, so that the key of the rollout, which is made of it, names this drive alone.
    """
    which = "broken off"
    if trace is not None:
        content = json.dumps([trace.version, [list(pair) for pair in trace.commands]])
        which = f"trace {hashlib.sha256(content.encode()).hexdigest()[:16]}"
    words = Thoughts(f"Driven by hand by {driver}.")
    return Plan(words, None, planner=PLANNER, model=driver, intent=f"by hand, {which}")


BROKEN_OFF = not_driven(
    "failure",
    "The drive was begun and broken off: the program stopped before its end was stored.",
    policy_failed=True,
)
"""What is known of a drive that has no stored end: it was begun, so it counts, as failed."""
