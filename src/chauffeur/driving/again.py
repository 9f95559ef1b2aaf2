"""A recorded trip driven again, with its own policy or another planner's.

A recording may come from anywhere: its policy passes what a planner's would today.
Checks, safety filter and bounds are today's. Of the recording's own limits only what is stricter counts.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

from pydantic import TypeAdapter, ValidationError

from chauffeur.concept import (
    Context,
    DataError,
    Feedback,
    History,
    Instruction,
    Limits,
    Observation,
    PersonId,
    Scenario,
    Trip,
    Verdict,
)
from chauffeur.driving import event_loop
from chauffeur.driving.emergency import not_checked, planned_for
from chauffeur.driving.episode import drive_policy, make_world, trip_s
from chauffeur.driving.events import Listener, nobody_listens
from chauffeur.driving.planning import declined
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.session import (
    RefereeMaker,
    Session,
    check_drive,
    parse_wish,
)
from chauffeur.planners.base import Planner
from chauffeur.worlds.base import World

_limits = TypeAdapter(Limits)
_FOREIGN = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)
"""What a scenario that no world wrote can make one raise."""


@dataclass(frozen=True, slots=True)
class DrivenAgain:
    """What came of a recorded policy today.

    Attributes:
        trip: The drive; None where it was refused.
        refusal: Why, in words.
        notes: What differs between how it was driven and how it is driven now, in words.
        verdicts: Those of today's checks.
    """

    trip: RecordedTrip | None
    refusal: str = ""
    notes: tuple[str, ...] = ()
    verdicts: tuple[Verdict, ...] = ()


def drive_again(recorded: RecordedTrip, most: Limits, referee: RefereeMaker) -> DrivenAgain:
    """Drive the same policy on the same scenario with the same seed.

    Args:
        recorded: The recording.
        most: Today's limits for whose trip it is.
        referee: Makes the judge of the trip.

    Raises:
        DataError: The recording holds no drive, or its scenario cannot be set up.
    """
    trip, scenario = recorded.trip, recorded.scenario
    policy = trip.plan.policy
    if not recorded.frames or policy is None:
        raise DataError(f"The recording holds no drive: its outcome is {trip.outcome}.", hint="Replay a driven trip.")
    world = make_world(scenario)
    observation = _reset(world, scenario, trip.seed)
    record = dict(trip.record)
    limits, notes = _bounds(record.get("limits"), most)
    own = planned_for(trip.instruction.text, observation)
    if own is not None and own.policy == policy:
        verdicts = not_checked(own)
    else:
        verdicts = check_drive(trip.plan, observation, limits)
        own = None
    if refusal := declined(trip.plan, verdicts):
        return DrivenAgain(None, refusal, notes, verdicts)
    if "shield" not in record:
        notes = (*notes, "It was recorded without the safety filter, which drives along today.")
    if own is None and "minimum_speed" not in record:
        notes = (*notes, "It was recorded without the least speed of a highway, which holds today.")
    words = trip.instruction.text if trip.judged_by else ""  # older versions judged by the plan alone
    judge = referee(world, scenario, trip.plan, words)
    episode = drive_policy(world, policy, judge, trip_s(scenario), limits, minimum_speed=own is None)
    driven = replace(
        trip,
        outcome=episode.outcome,
        causes=episode.causes,
        metrics=episode.metrics,
        duration_s=episode.duration_s,
        said=episode.said,
    )
    again = replace(recorded, trip=driven, frames=episode.frames, final=episode.final, cut_off=False)
    return DrivenAgain(again, "", notes, verdicts)


class _AsRemembered:
    """H as the recording holds it, whoever's it is; nothing is kept of the drive."""

    def __init__(self, history: History) -> None:
        self._history = history

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """The recorded history."""
        del person, instruction, context, k
        return self._history

    def remember(self, trip: Trip, feedback: Feedback | None) -> None:
        """Nothing."""
        del trip, feedback


def drive_otherwise(
    recorded: RecordedTrip, planner: Planner, most: Limits, referee: RefereeMaker, tell: Listener = nobody_listens
) -> DrivenAgain:
    """Drive the recorded situation with another planner: same wish, scenario, seed, history and person's limits.

    The planner is asked anew, with the situation as it is described today. Whatever becomes of the wish is a trip, also
    that it is declined.

    Args:
        recorded: The recording; of one that was declined, too.
        planner: Who plans now.
        most: Today's limits for whose trip it is.
        referee: Makes the judge of the trip.
        tell: Hears the drive.

    Raises:
        DataError: Its scenario cannot be set up, or it does not say under which limits it was driven.
        ChauffeurError: No plan could be had.
    """
    trip, scenario = recorded.trip, recorded.scenario
    _reset(make_world(scenario), scenario, trip.seed)
    limits, notes = _bounds(dict(trip.record).get("limits"), most)
    began_s = recorded.frames[0].observation.time_s if recorded.frames else 0.0
    if began_s > 0.0:
        notes = (*notes, f"It was wished {began_s:.1f} s into a longer drive; now it is driven from the beginning.")
    said = trip.instruction
    wish = replace(parse_wish(said.said or said.text, said.person), confirmed=said.confirmed)
    session = Session(planner, memory=_AsRemembered(trip.history), referee=referee, tell=tell)
    driven = event_loop.run(session.drive(wish, scenario, trip.seed, limits))
    return DrivenAgain(driven, "", notes, driven.trip.verdicts)


def _reset(world: World, scenario: Scenario, seed: int) -> Observation:
    try:
        return world.reset(scenario, seed)
    except _FOREIGN as error:
        raise DataError(
            f"The recording's scenario {scenario.id[:80]!r} cannot be set up: {type(error).__name__} {error}.",
            hint="Was it recorded by Chauffeur, and left as it was?",
        ) from error


def _bounds(stored: Any, most: Limits) -> tuple[Limits, tuple[str, ...]]:
    """(limits to drive under, what that changes in words): of two bounds the stricter one."""
    try:
        own = _limits.validate_python(stored)
    except ValidationError as error:
        raise DataError("The recording does not say under which limits it was driven.") from error
    speeds = [one for one in (own.max_speed_mps, most.max_speed_mps) if one is not None and not math.isnan(one)]
    over, headway = own.max_over_limit_mps, own.min_time_headway_s
    longest = own.max_time_headway_s
    held = Limits(
        own.name,
        over if over <= most.max_over_limit_mps else most.max_over_limit_mps,
        headway if headway >= most.min_time_headway_s else most.min_time_headway_s,
        longest if longest <= most.max_time_headway_s else most.max_time_headway_s,
        min(speeds, default=None),
    )
    before, now = asdict(own), asdict(held)
    changed = [f"{name} {now[name]} (recorded: {before[name]})" for name in now if now[name] != before[name]]
    if not changed:
        return own, ()
    return held, (f"It was recorded under wider limits than today's, which hold: {', '.join(changed)}.",)
