"""Checks of the `World` contract, run by `chauffeur check world` and by the tests of every built-in world.

Each check gets a maker of fresh worlds and a scenario, and yields what is wrong, in words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from chauffeur.concept import ChauffeurError, Command, DataError, Observation, Scenario
from chauffeur.geometry import wrap_to_pi
from chauffeur.worlds.base import EGO, Driver, MirroredWorld, Perception, World
from chauffeur.worlds.places import TownPlaces

MakeWorld = Callable[[], World]
Check = Callable[[MakeWorld, Scenario], Iterator[str]]

JOINT_M: Final = 0.5
"""A lane begins no farther than this from the end of the lane that leads into it."""
_CUT_SHORT: Final = ("sidewalk", "emergency")
"""Kinds of lane that maps end at a corner, and begin again behind it."""
MOST_MPS2: Final = 20.0
"""No car accelerates or brakes harder: twice gravity."""
MOST_STEERING_RAD: Final = math.radians(80.0)
_TURNING_PERIODS: Final = 5
_TURNING_RAD: Final = 0.02
_TURNED_RAD: Final = 1e-3
_PERIODS: Final = 30
_COMMANDS: Final = tuple(Command(1.0 - (i % 7) / 3.0, 0.02 * math.sin(i)) for i in range(_PERIODS))


@dataclass(frozen=True, slots=True)
class ConformanceFinding:
    """Result of one check.

    Attributes:
        check: Its name.
        faults: What is wrong, in words; none where the contract is kept.
    """

    check: str
    faults: tuple[str, ...]


def check_world(make: MakeWorld, scenario: Scenario) -> tuple[ConformanceFinding, ...]:
    """Run every check of the kit; a check that raises reports the error as its finding."""
    return tuple(ConformanceFinding(name, _found(check, make, scenario)) for name, check in CHECKS.items())


def _found(check: Check, make: MakeWorld, scenario: Scenario) -> tuple[str, ...]:
    faults: list[str] = []
    try:
        for fault in check(make, scenario):
            faults.append(fault)
    except Exception as error:  # noqa: BLE001 - a third party's world may raise anything
        faults.append(f"It raised {type(error).__name__}: {error}")
    return tuple(dict.fromkeys(faults))


def _steps(world: World) -> Iterator[Observation]:
    for command in _COMMANDS:
        if world.ended:
            return
        world.step(command)
        yield world.observe()


def _given(thing: object) -> object:
    """Forget the static type: a third party's world may return anything."""
    return thing


def repeats(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Same scenario, seed and commands: the same trip, bit for bit; in the same world again as well."""
    world, other = make(), make()
    once = [world.reset(scenario), *_steps(world)]
    for name, again in (("Another world", other), ("The same world", world)):
        trip = [again.reset(scenario), *_steps(again)]
        tick = next((i for i, (a, b) in enumerate(zip(once, trip, strict=False)) if a != b), None)
        if tick is not None:
            yield f"{name} with the same seed differs at tick {tick}."
        elif len(trip) != len(once):
            yield f"{name} with the same seed ended after {len(trip) - 1} periods, not {len(once) - 1}."


def keeps_time(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Each step is one tick and `dt_s`; looking takes no time."""
    world = make()
    before = world.reset(scenario)
    if not 0.0 < world.dt_s <= 1.0:
        yield f"dt_s is {world.dt_s}; a control period lies between 0 and 1 s."
    if (before.tick, before.time_s) != (0, 0.0):
        yield f"A trip begins at tick {before.tick}, {before.time_s} s, not at 0."
    for after in _steps(world):
        if after.tick != before.tick + 1 or not math.isclose(after.time_s, after.tick * world.dt_s, abs_tol=1e-6):
            yield f"Tick {before.tick}, {before.time_s} s is followed by tick {after.tick}, {after.time_s} s."
        if world.observe() != after:
            yield "Two looks at one instant differ."
        before = after


def leaves_observations_alone(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Observations do not change as the world goes on, and the road is one object throughout."""
    world = make()
    first = world.reset(scenario)
    shown = repr(first)
    last = [first, *_steps(world)][-1]
    if repr(first) != shown:
        yield "The first observation changed while the world went on."
    if last.road is not first.road:
        yield "The road is another object later in the trip: whoever keeps what it worked out of it does so in vain."


def has_a_road(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Lanes have names of their own and lead into one another, and everybody's lane is one of them."""
    world = make()
    start = world.reset(scenario)
    road = start.road
    if len(road.by_id) < len(road.lanes):
        yield "Two lanes have one name."
    for lane in road.lanes:
        if not (lane.width_m > 0.0 and lane.speed_limit_mps > 0.0):
            yield f"Lane {lane.id} is {lane.width_m} m wide, with a limit of {lane.speed_limit_mps} m/s."
        for name in lane.successors:
            onward = road.get(name)
            if onward is None:
                yield f"Lane {lane.id} leads into {name}, which is no lane."
                continue
            gap = math.dist(lane.centre.points_m[-1], onward.centre.points_m[0])
            if gap > JOINT_M and lane.kind not in _CUT_SHORT:
                yield f"Lane {name} begins {gap:.1f} m from the end of {lane.id}, which leads into it."
    if start.ego.lane is None:
        yield "The ego is on no lane at the start."
    for observation in (start, *_steps(world)):
        for one in (observation.ego, *observation.others, *observation.objects):
            if one.lane is not None and one.lane not in road:
                yield f"The {one.kind} {one.id} is on lane {one.lane}, which the road does not have."
        for thing in (*observation.signals, *observation.signs):
            yield from (f"{thing.id} rules lane {lane}, which is none." for lane in thing.lanes if lane not in road)
        if len({one.id for one in (*observation.others, *observation.objects)} | {EGO}) <= len(
            observation.others
        ) + len(observation.objects):
            yield "Two vehicles or objects have one id."


def is_right_handed(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """y and headings grow to the left: so do lanes abreast, whose index grows to the right, and steering."""
    world = make()
    start = world.reset(scenario)
    for lane in start.road.lanes:
        beside = start.road.get(start.road.neighbour(lane.id, 1))
        middle = lane.centre.at(lane.length_m / 2.0)
        if beside is None:
            continue
        there = beside.centre.at(beside.centre.nearest(middle.x_m, middle.y_m))
        if middle.sees(there.x_m, there.y_m)[1] > 0.0:
            yield f"Lane {beside.id} is one place to the right of {lane.id}, and lies to its left."
            break
    for _ in range(_TURNING_PERIODS):
        if not world.ended:
            world.step(Command(0.5, _TURNING_RAD))
    if wrap_to_pi(world.observe().ego.heading_rad - start.ego.heading_rad) < -_TURNED_RAD:
        yield "The car was steered to the left and turned to the right."


def ends_once(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """`ended` is the observation's: a trip that leaves the road ends there, and a reset begins another."""
    world = make()
    world.reset(scenario)
    for _ in range(math.ceil(world.capabilities.horizon_s / world.dt_s)):
        now = world.observe()
        if world.ended != now.ended:
            yield "The world and its observation differ in whether the trip has ended."
        if (now.off_road or now.ego.crashed) and not now.ended:
            yield "The ego has crashed or is off the road, and the trip goes on."
            break
        if world.ended:
            break
        world.step(Command(2.0, 0.3))
    if world.reset(scenario).ended:
        yield "After a reset the trip has ended already."


def bounds_commands(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Applied commands are within what a car can do; non-finite ones are refused."""
    for asked in (Command(1e3, 10.0), Command(-1e3, -10.0), Command(0.0, 0.0)):
        world = make()
        world.reset(scenario)
        applied = world.step(asked)
        if not (abs(applied.acceleration_mps2) <= MOST_MPS2 and abs(applied.steering_rad) <= MOST_STEERING_RAD):
            yield f"{asked} was applied as {applied}."
    for wrong in (Command(math.nan, 0.0), Command(0.0, math.inf)):
        world = make()
        world.reset(scenario)
        try:
            world.step(wrong)
        except ValueError:
            continue
        yield f"{wrong} was driven; a command that is no number is a ValueError."


def answers_questions(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Perception says what the observation shows."""
    world = make()
    start = world.reset(scenario)
    road, given = start.road, _given(world.perception())
    if not isinstance(given, Perception):
        yield "perception() is no Perception: a question is missing."
        return
    perception = given
    lane = perception.lane_of(EGO)
    if lane != start.ego.lane:
        yield f"Perception has the ego on {lane}, the observation on {start.ego.lane}."
    if not perception.has_lane(lane) or perception.has_lane("a lane that is none"):
        yield "has_lane does not know the road's lanes."
    for one in (start.ego, *start.others):
        if perception.vehicle(one.id) != one:
            yield f"Perception and observation differ in vehicle {one.id}."
    try:
        perception.vehicle(10**9)
        yield "A vehicle that is not there is a KeyError."
    except KeyError:
        pass
    if perception.speed_limit(lane) != road[lane].speed_limit_mps:
        yield f"Perception has {perception.speed_limit(lane)} m/s on {lane}, the road {road[lane].speed_limit_mps}."
    for side in (-1, 1):
        beside, known = perception.adjacent_lane(lane, side), road.neighbour(lane, side)
        left_out = beside is None and known is not None and road[known].kind != road[lane].kind
        if beside != known and not left_out:  # a perception of cars may leave out what is no lane for them
            yield f"Perception has {beside} beside {lane}, the road another lane."
    known = {one.id for one in (*start.others, *start.objects)}
    near = (*perception.neighbours(lane), perception.front_blocker(frozenset()))
    yield from (f"Somebody near is {one}, whom nobody shows." for one in near if one is not None and one not in known)
    for crossing in (*perception.cross_traffic_lanes(True), *perception.cross_traffic_lanes(False)):
        if crossing not in road:
            yield f"Traffic crosses on {crossing}, which is no lane."


def drives(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Its driver takes set-points, and keeps speed and lane while no one asks for anything."""
    world = make()
    start = world.reset(scenario)
    given = _given(world.driver())
    if not isinstance(given, Driver):
        yield "driver() is no Driver: something of it is missing."
        return
    driver = given
    if world.driver() is not driver:
        yield "The driver is another object when it is asked for again."
    setpoints = driver.initial_setpoints()
    if setpoints.target_lane is not None and setpoints.target_lane not in start.road:
        yield f"It begins with a wish for lane {setpoints.target_lane}, which is none."
    for _ in range(_PERIODS):
        if world.ended:
            yield f"Nobody wished anything, and the trip ended after {world.observe().tick} periods."
            return
        setpoints = driver.settle(setpoints)
        if setpoints.target_speed_mps is None:
            yield "Settled set-points have no speed."
            return
        command = driver.command(setpoints)
        if not (math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)):
            yield f"It asks for {command}."
            return
        world.step(command)


def is_what_it_says(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """The stated capabilities hold on this road."""
    world = make()
    said, start = world.capabilities, world.reset(scenario)
    if start.kind not in said.roads:
        yield f"The road is a {start.kind}, which it does not name: {', '.join(said.roads)}."
    if not said.turns and start.road.junctions:
        yield "It has a junction and says that there are no turns."
    if not said.lane_changes and any(len(start.road.abreast(lane.id)) > 1 for lane in start.road.lanes):
        yield "It has lanes abreast and says that there are no lane changes."
    if not said.stop_signs and start.stop_sign_m is not None:
        yield "It has a stop sign and says that there are none."
    if said.places != (start.road.has_parking or isinstance(world, TownPlaces)):
        yield "Whether there are places to park in is not what it says."
    if not said.policies:
        yield "It names no kind of policy that it can be driven by."
    if not said.horizon_s > 0.0:
        yield f"Its horizon is {said.horizon_s} s."
    if not world.engine:
        yield "It does not say what moves the vehicles."


def mirrors(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """A world that can be shown to another process is the same there; one that cannot has nothing to keep."""
    world = make()
    world.reset(scenario)
    if not isinstance(world, MirroredWorld):
        return
    other = world.mirror()
    other.reset(scenario)
    for seen in _steps(world):
        other.adopt(world.mirrored())
        if other.observe() != seen:
            yield f"At tick {seen.tick} the mirrored world is another."
            return
    try:
        other.adopt(b"")
        yield "An empty instant is adopted; it is a DataError."
    except DataError:
        pass


def refuses_in_words(make: MakeWorld, scenario: Scenario) -> Iterator[str]:
    """Before the first reset it says what is missing."""
    del scenario
    try:
        make().observe()
    except ChauffeurError as error:
        if not error.hint:
            yield "What it raises before the first reset has no remedy."
        return
    yield "Before the first reset there is something to observe."


CHECKS: Final[Mapping[str, Check]] = MappingProxyType(
    {
        "same seed, same trip": repeats,
        "time": keeps_time,
        "observations are frozen": leaves_observations_alone,
        "road graph": has_a_road,
        "right-handed": is_right_handed,
        "the end": ends_once,
        "commands": bounds_commands,
        "perception": answers_questions,
        "driver": drives,
        "capabilities": is_what_it_says,
        "mirror": mirrors,
        "before a reset": refuses_in_words,
    }
)
