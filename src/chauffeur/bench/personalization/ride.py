"""One trip of a simulated passenger: the loop itself, with the real planner, checks, memory, driver and shield."""

from __future__ import annotations

import math
import tempfile
from collections import OrderedDict
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.bench.personalization.population import Passenger
from chauffeur.bench.personalization.scenes import DRIVE_S, GROUND_OF, Task
from chauffeur.bench.personalization.traces import Trace, trace_of
from chauffeur.concept import (
    Context,
    Feedback,
    History,
    Instruction,
    Limits,
    Parameters,
    PersonId,
    Policy,
    Scenario,
    ScenarioError,
    SystemMessage,
    Trip,
)
from chauffeur.describe import describe
from chauffeur.driving.episode import Episode, Referee, drive_policy, make_world
from chauffeur.driving.loop import LoopMemory, drive, steps_at
from chauffeur.driving.planning import Planned
from chauffeur.driving.session import check_drive
from chauffeur.driving.trips import make_trip
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.privacy import Privacy
from chauffeur.memory.vault import VaultMemory
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import build_system_message
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.base import World
from chauffeur.worlds.parking import ParkingReferee, ParkingWorld
from chauffeur.worlds.parking.lot import Spot, build_lot
from chauffeur.worlds.parking.places import PLACES

RIDE_VERSION: Final = "ride-v2"
"""Changes whenever the same plan could drive differently here."""

_KEPT: Final = 1_500
_USUAL_LOOK: Final = (12.0, 2.0)
_USUAL_LOOK_LOT: Final = (4.0, 1.0)

_driven: OrderedDict[tuple[str, str], tuple[Episode, Trace]] = OrderedDict()
"""Drives of this process by scene and policy: the same policy drives the same there, whoever sits in the car."""


@dataclass(frozen=True, slots=True)
class Ride:
    """Outcome of a trip.

    Attributes:
        trip: As it is filed.
        trace: What could be felt.
        declined: Whether the planner or a check declined; the car then drove on as it was.
    """

    trip: Trip
    trace: Trace
    declined: bool


class ReadOnly:
    """A memory that is asked and learns nothing: trips that measure must not teach."""

    def __init__(self, memory: LoopMemory) -> None:
        self._memory = memory

    def recall(self, person: PersonId, instruction: Instruction, context: Context, k: int) -> History:
        """As the memory behind it."""
        return self._memory.recall(person, instruction, context, k)

    def remember(self, trip: Trip, feedback: Feedback | None) -> None:
        """Nothing."""
        del trip, feedback


@contextmanager
def learning(passenger: Passenger) -> Generator[tuple[VaultMemory, PersonId, Callable[[str], None]]]:
    """A passenger's memory in a folder of its own, their name in it, and the call that ends a day.

    That call gives the memory what the passenger said of the day's trip, if anything, and goes on to the next day.
    """
    now = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)
    person = PersonId(f"simulated {passenger.id}")
    with tempfile.TemporaryDirectory(prefix="chauffeur-study-") as home:
        vault = VaultMemory(Path(home), passphrase="", privacy=Privacy(None), clock=lambda: now)

        def end_day(said: str) -> None:
            nonlocal now
            if said:
                vault.attach_feedback(person, interpret_feedback(said))
            now += timedelta(days=1)

        yield vault, person, end_day


@lru_cache(maxsize=2)
def planner_of(spec: str, options: tuple[tuple[str, Any], ...] = ()) -> Planner:
    """This process's planner: loading a model takes longer than a trip."""
    return make_planner(spec, **dict(options))


async def ride(
    planner: Planner, memory: LoopMemory, words: str, person: PersonId, task: Task, scene: Scenario, limits: Limits
) -> Ride:
    """Drive one wish.

    Raises:
        ChauffeurError: No plan could be had, or the scene cannot be set up.
    """
    world = make_world(scene)
    felt: list[tuple[Trace, bool]] = []

    def execute(planned: Planned) -> Trip:
        refusal = planned.refusal
        policy = planned.plan.policy
        if not refusal and policy is not None:
            try:
                episode, trace = _drive(world, scene, policy, task, limits)
            except ScenarioError as error:  # no such way here
                refusal = str(error)
            else:
                felt.append((trace, False))
                return make_trip(planned, scene, scene.seed, episode, shielded=True)
        _, trace = _drive(world, scene, as_it_was(world, task), task, limits)
        felt.append((trace, True))
        return make_trip(planned, scene, scene.seed, None, refusal, shielded=True)

    steps = steps_at(
        world.reset(scene, scene.seed),
        planner,
        memory,
        limits,
        describe=describe,
        system=_system,
        check=check_drive,
    )
    trip = await drive(Instruction(words, person, source="benchmark"), steps, execute, memory)
    trace, refused = felt[-1]
    return Ride(trip, trace, refused)


def ride_policy(policy: Policy, task: Task, scene: Scenario, limits: Limits) -> Trace:
    """The drive of a policy that nobody had to be asked for."""
    world = make_world(scene)
    world.reset(scene)
    return _drive(world, scene, policy, task, limits)[1]


def as_it_was(world: World, task: Task) -> Parameters:
    """Parameters that drive on where a wish is declined: the present speed, the present lane."""
    return usual(task, world.observe().ego.speed_mps)


def usual(task: Task, speed_mps: float, lane: Literal[-1, 0, 1] = 0, place: str = "") -> Parameters:
    """A speed, and a lane or a place to park, with the usual look-ahead; over a crossing straight on."""
    ground = GROUND_OF[task]
    look = _USUAL_LOOK_LOT if ground == "parking" else _USUAL_LOOK
    return Parameters(speed_mps, *look, lane, "straight" if ground == "intersection" else place)


def _drive(world: World, scene: Scenario, policy: Policy, task: Task, limits: Limits) -> tuple[Episode, Trace]:
    """Drive on a world just reset, or take the same drive from before."""
    key = (scene.id, f"{policy}|{limits}")
    found = _driven.get(key)
    if found is None:
        episode = drive_policy(world, policy, _referee(world, policy), DRIVE_S[task], limits)
        parked, walk = _stand(world, scene)
        trace = trace_of(episode, world.dt_s, parked=parked, walk_m=walk)
        found = _driven[key] = replace(episode, frames=()), trace
        if len(_driven) > _KEPT:
            _driven.popitem(last=False)
    _driven.move_to_end(key)
    return found


def _referee(world: World, policy: Policy) -> Referee | None:
    """Ends a trip that has parked."""
    if isinstance(world, ParkingWorld) and isinstance(policy, Parameters) and policy.route:
        return ParkingReferee(world, world.spot(policy.route))
    return None


def _stand(world: World, scene: Scenario) -> tuple[str, dict[str, float]]:
    """Position of the car in a lot, and its excess distance from each place.

    From the stadium on foot, from the exit by car, and from the entrance along the way driven.
    """
    if not isinstance(world, ParkingWorld) or (name := world.parked()) is None:
        return "", {}
    fresh = ParkingWorld()
    fresh.reset(scene)
    spot, best = fresh.spot(name), {place: fresh.spot(place) for place in PLACES}
    lot = build_lot(scene.config.get("aisles", 3), scene.config.get("spots_a_row", 8))
    gate, (exit_x, exit_y) = lot.gate_m, lot.exit_m

    def away(one: Spot, place: str) -> float:
        if place == "stadium":
            return math.dist((one.box.x_m, one.box.y_m), gate)
        if place == "exit":
            return one.box.x_m - exit_x + one.box.y_m - exit_y
        way = fresh.way_to(one)
        return math.inf if way is None else way.path.length_m

    return name, {place: max(0.0, away(spot, place) - away(best[place], place)) for place in PLACES}


@lru_cache(maxsize=8)
def _system(limits: Limits) -> SystemMessage:
    return build_system_message("few-shot", limits=limits)
