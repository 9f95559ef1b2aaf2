"""Takeovers of simulated passengers in the three manoeuvres, by directness and memory (paper Sec. VI-C3, Fig. 14-15).

Each passenger rides each manoeuvre. First the memory learns: trips with wishes of any level, after which they say how
it was, in words, through the memory's own door. Then, for each level of directness, the same words in the same weather
go to every system, and each drive is judged without knowing whose it is. A manoeuvre has ten commands, so that some of
those that the memory learnt from come again, as people repeat themselves. Who is asked back instead of being driven
takes over.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np

from chauffeur.bench.kernel.benchmark import ItemOutcome, Unasked
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import TableSpec, share
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.motion.driving import DRIVE_VERSION, MAX_S, frozen
from chauffeur.bench.motion.items import MotionCommand, MotionItem, commands, data_sha256
from chauffeur.bench.motion.passengers import MANNER_VERSION, draw_manners, judged, wanted
from chauffeur.bench.personalization.ride import ReadOnly, learning, planner_of
from chauffeur.bench.personalization.sayings import sayings_sha256
from chauffeur.bench.personalization.takeover import Judgement, remark
from chauffeur.concept import (
    NOBODY,
    ActionMatrix,
    CameraImage,
    ConfigError,
    Context,
    Instruction,
    Limits,
    Observation,
    PersonId,
    Scenario,
    SystemMessage,
    Trip,
)
from chauffeur.concept.weather import WEATHERS
from chauffeur.describe.track import describe_track
from chauffeur.driving.episode import Episode, drive_policy
from chauffeur.driving.loop import LoopMemory, drive, steps_at
from chauffeur.driving.planning import Planned
from chauffeur.driving.session import Forgetful, check_drive
from chauffeur.driving.trips import make_trip
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner
from chauffeur.planners.talk2drive.recent import fitting
from chauffeur.safety.gain_box import care, gain_box
from chauffeur.worlds.track import TrackWorld
from chauffeur.worlds.track.dynamics import PLANTS, Plant
from chauffeur.worlds.track.manoeuvres import MANOEUVRES, ManoeuvreName

TAKEOVERS: Final = "motion-passengers-v1"
SIMULATED: Final = "simulated passengers on simulated drives; what they want is the authors' assumption"
"""Stands beside every figure."""

Arm = Literal["fixed", "without", "with"]
ARMS: Final[tuple[Arm, ...]] = ("fixed", "without", "with")
"""Fixed gains, and the planner without and with memory."""
LEVELS: Final = (1, 2, 3)
_KEPT: Final = 256
"""Drives and pictures that a worker keeps: many passengers are given the same gains in the same scene."""


@dataclass(frozen=True, slots=True)
class TakeoverRow:
    """A trip and what the passenger made of it.

    Attributes:
        passenger, manoeuvre, level, weather, style, wish: Who wanted what, where.
        arm: Who drove.
        phase: `learning` or `measured`.
        place: Its turn among the systems.
        wanted, gave: How careful the gains were to be, and were; the latter None where nothing was driven.
        takeover: Whether the passenger took over.
        topic, feedback: What it was about, and what was said of it.
        recalled: Remembered trips that the planner was shown.
        note: What the figures are.
    """

    passenger: str
    manoeuvre: str
    level: int
    weather: str
    style: str
    wish: str
    arm: str
    phase: str
    place: int
    wanted: float
    gave: float | None
    deviation: float
    takeover: bool
    topic: str
    feedback: str
    recalled: int
    outcome: str
    refusal: str
    planner: str
    note: str = SIMULATED


@dataclass(frozen=True, slots=True)
class RiderJob:
    """One passenger in one manoeuvre; also the item.

    Attributes:
        key: E.g. `p0007.left_turn`.
        number: The passenger's, from 0.
        manoeuvre: Which.
        planner: Who plans without and with memory.
        seed: Of the passengers and their days.
        trips: How many trips the memory learns from.
        plant: What is driven.
    """

    key: str
    number: int
    manoeuvre: ManoeuvreName
    planner: str
    seed: int
    trips: int
    plant: Plant

    @property
    def id(self) -> str:
        return self.key

    @property
    def near(self) -> str:
        """See BenchJob: drives of one manoeuvre are kept by their worker."""
        return self.manoeuvre

    def run(self) -> Row:
        return asyncio.run(_Sitting(self).row())

    def spoiled(self, detail: str) -> Row:
        return {"key": self.key, "infra_failed": True, "detail": detail}


class TakeoverBenchmark(Unasked):
    """Takeover rates with fixed gains, and with a planner that looks, without and with memory."""

    id = TAKEOVERS
    judge = (
        "Simulated passengers of our own, with the same ranges of gains as in `motion`. Shared: what they remark is "
        "what the memory can learn; nobody was asked and nobody was driven."
    )
    row = TakeoverRow
    tables = (
        TableSpec(
            "Takeovers by directness (Fig. 14)",
            (
                share("motion-takeover-1-v1", "level 1", lambda row: _taken(row, 1)),
                share("motion-takeover-2-v1", "level 2", lambda row: _taken(row, 2)),
                share("motion-takeover-3-v1", "level 3", lambda row: _taken(row, 3)),
                share("motion-takeover-v1", "all", lambda row: row["takeover"]),
            ),
            group="arm",
            order=ARMS,
            cluster="passenger",
            rows=lambda row: row["phase"] == "measured",
            heads=("system", "trips"),
            total=False,
        ),
    )

    card = CardPart(
        (
            Headline("takeovers, without memory", tables[0], tables[0].measures[-1], "without"),
            Headline("takeovers, with memory", tables[0], tables[0].measures[-1], "with"),
        ),
        evidence="simulated passengers in simulated drives (CommonRoad vehicle models)",
        quick={"passengers": 3},
        drives={"track-lane-change": ("action_matrix",)},
        extra=("motion", "osqp"),
    )

    def __init__(
        self, planner: str = "vlm", passengers: int = 20, seed: int = 1, trips: int = 5, plant: Plant = "std"
    ) -> None:
        """Make it.

        Args:
            planner: Who sets the gains, as for `--planner`.
            passengers: How many.
            seed: Of the passengers and their days.
            trips: How many trips of each manoeuvre the memory learns from.
            plant: The vehicle model.

        Raises:
            ConfigError: An option that cannot be, or there is no such planner.
        """
        if passengers < 1 or trips < 0:
            raise ConfigError(f"{passengers} passengers and {trips} trips make no study.", hint="Take at least one.")
        if plant not in PLANTS:
            raise ConfigError(f"There is no plant {plant!r}.", hint=f"Plants: {', '.join(PLANTS)}.")
        self._planner, self._passengers, self._seed, self._trips = planner, passengers, seed, trips
        self._plant: Plant = plant
        self._model = make_planner(planner).model

    @property
    def config(self) -> Mapping[str, Any]:
        box = gain_box()
        return {
            "planner": self._planner,
            "model": self._model,
            "passengers": self._passengers,
            "seed": self._seed,
            "trips": self._trips,
            "plant": self._plant,
            "data_sha256": data_sha256(),
            "sayings_sha256": sayings_sha256(),
            "box": {name: [box.low[name], box.high[name]] for name in box.low},
            "versions": [TAKEOVERS, MANNER_VERSION, DRIVE_VERSION],
            "simulated": SIMULATED,
        }

    def items(self) -> Sequence[RiderJob]:
        """See Benchmark: person by person, so that what is done at any time is a whole study."""
        return [
            RiderJob(
                f"{manner.who.id}.{manoeuvre}",
                number,
                manoeuvre,
                self._planner,
                self._seed,
                self._trips,
                self._plant,
            )
            for number, manner in enumerate(draw_manners(self._passengers, self._seed))
            for manoeuvre in MANOEUVRES
        ]

    def job(self, item: RiderJob, answer: Row | None) -> RiderJob:
        del answer
        return item

    def rows(self, outcome: ItemOutcome[RiderJob]) -> Sequence[TakeoverRow]:
        found = outcome.result
        if found is None or found["infra_failed"]:
            return ()
        return [TakeoverRow(**trip) for trip in found["trips"]]


def _taken(row: Mapping[str, Any], level: int) -> bool | None:
    return row["takeover"] if row["level"] == level else None


class _Sitting:
    """A passenger in a manoeuvre: their words, days, and the order of the systems."""

    def __init__(self, job: RiderJob) -> None:
        self._job = job
        self._manner = draw_manners(job.number + 1, job.seed)[job.number]
        self._rng = np.random.default_rng([job.seed, job.number, MANOEUVRES.index(job.manoeuvre), 59])
        self._commands = [one for one in commands() if one.manoeuvre == job.manoeuvre]

    async def row(self) -> Row:
        """All trips, as one row."""
        job, trips = self._job, list[Row]()
        planner = planner_of(job.planner)
        with learning(self._manner.who) as (vault, person, end_day):
            memory = fitting(vault, job.planner)
            for _ in range(job.trips):
                item, want = self._day(self._commands[int(self._rng.integers(len(self._commands)))])
                trip, found = await self._ride(planner, memory, person, item, want)
                said = remark(self._manner.who, found, "test", self._rng)
                end_day(said)
                trips.append(self._trip_row("with", "learning", 0, item, want, trip, found, said))
            learnt = ReadOnly(memory)
            for level in LEVELS:
                direct = [one for one in self._commands if one.directness == level]
                item, want = self._day(direct[int(self._rng.integers(len(direct)))])
                for place, index in enumerate(self._rng.permutation(len(ARMS)), start=1):
                    arm = ARMS[int(index)]
                    asked, recalls, who = {
                        "fixed": (planner_of("gains"), Forgetful(), NOBODY),
                        "without": (planner, Forgetful(), NOBODY),
                        "with": (planner, learnt, person),
                    }[arm]
                    trip, found = await self._ride(asked, recalls, who, item, want)
                    trips.append(self._trip_row(arm, "measured", place, item, want, trip, found, ""))
        return {"key": job.key, "infra_failed": False, "trips": trips}

    def _day(self, command: MotionCommand) -> tuple[MotionItem, float]:
        """Weather and mood of a day: what is said in which weather, and how careful it is meant."""
        weather = WEATHERS[int(self._rng.integers(len(WEATHERS)))]
        item = MotionItem(command, weather, self._job.plant, self._job.seed)
        return item, wanted(self._manner, command.style, weather, float(self._rng.normal()))

    async def _ride(
        self, planner: Planner, memory: LoopMemory, person: PersonId, item: MotionItem, want: float
    ) -> tuple[Trip, Judgement]:
        driven: list[Episode] = []

        def execute(planned: Planned) -> Trip:
            policy = planned.plan.policy
            if not planned.refusal and isinstance(policy, ActionMatrix):
                driven.append(_driven(frozen(item.scenario), policy))
            return make_trip(planned, item.scenario, item.seed, driven[-1] if driven else None, planned.refusal)

        def see(observation: Observation) -> tuple[CameraImage, ...]:
            del observation  # the item renders its own beginning, and another place for each command
            return _picture(item)

        def describe(observation: Observation) -> Context:
            return item.told(describe_track(observation), "told")

        steps = steps_at(
            TrackWorld().reset(item.scenario, item.seed),
            planner,
            memory,
            Limits(),
            describe=describe,
            system=_no_system,
            check=check_drive,
            see=see,
        )
        wish = Instruction(item.command.text, person, source="benchmark")
        trip = await drive(wish, steps, execute, memory)
        policy = trip.plan.policy if driven and isinstance(trip.plan.policy, ActionMatrix) else None
        return trip, judged(self._manner, want, policy, trip.outcome, item.command.manoeuvre)

    def _trip_row(
        self,
        arm: Arm,
        phase: str,
        place: int,
        item: MotionItem,
        want: float,
        trip: Trip,
        found: Judgement,
        said: str,
    ) -> Row:
        policy = trip.plan.policy
        return {
            "passenger": self._manner.who.id,
            "manoeuvre": item.command.manoeuvre,
            "level": item.command.directness,
            "weather": item.weather,
            "style": item.command.style,
            "wish": item.command.text,
            "arm": arm,
            "phase": phase,
            "place": place,
            "wanted": round(want, 4),
            "gave": round(care(policy), 4) if isinstance(policy, ActionMatrix) else None,
            "deviation": round(found.deviation, 3),
            "takeover": found.takes_over,
            "topic": found.topic,
            "feedback": said,
            "recalled": len(trip.history.items),
            "outcome": trip.outcome,
            "refusal": trip.causes.detail if trip.causes.refused or trip.causes.policy_failed else "",
            "planner": trip.plan.planner,
        }


@lru_cache(maxsize=_KEPT)
def _driven(scenario: str, policy: ActionMatrix) -> Episode:
    """A drive with gains, its frames dropped. Raises ChauffeurError: it cannot be set up."""
    scene = Scenario(**json.loads(scenario))
    world = TrackWorld()
    world.reset(scene)
    return replace(drive_policy(world, policy, None, MAX_S, Limits()), frames=())


@lru_cache(maxsize=_KEPT)
def _picture(item: MotionItem) -> tuple[CameraImage, ...]:
    return item.shown("on")


def _no_system(limits: Limits) -> SystemMessage:
    """S is the planner's own: it says how gains are to be given."""
    del limits
    return SystemMessage("")
