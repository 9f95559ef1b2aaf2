"""Study of one simulated passenger and task: trips with every system in blind order, and a profile that grows.

For each level of directness the passenger says the same words on the same scene to every system and judges each drive
without knowing whose it is. The system with memory has learnt from trips before: the same task, other words, other
scenes, levels by chance, and after each the passenger said how it was, in words, through the memory's own door.
"""

from __future__ import annotations

import asyncio
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.personalization.baseline import KeywordParameters
from chauffeur.bench.personalization.population import POPULATION_VERSION, draw_passengers
from chauffeur.bench.personalization.ride import (
    RIDE_VERSION,
    ReadOnly,
    Ride,
    learning,
    planner_of,
    ride,
    ride_policy,
    usual,
)
from chauffeur.bench.personalization.sayings import LEVELS, PLACE_WORDS, Half, Level, wishes_of
from chauffeur.bench.personalization.scenes import GROUND_OF, TASKS, Task, scenes_of
from chauffeur.bench.personalization.takeover import (
    TAKEOVER_VERSION,
    Judgement,
    Mood,
    aim_of,
    judge,
    remark,
    wanted_mps,
)
from chauffeur.bench.personalization.traces import TRACE_VERSION, Trace, limit_of
from chauffeur.concept import NOBODY, Limits, Parameters, Scenario
from chauffeur.driving.episode import make_world
from chauffeur.driving.session import Forgetful
from chauffeur.planners.talk2drive.recent import RecentToo

BENCH_VERSION: Final = "personalization-v3"

Arm = Literal["keyword", "keyword-fair", "without", "with", "ideal"]
ARMS: Final[tuple[Arm, ...]] = ("keyword", "keyword-fair", "without", "with", "ideal")
"""`without` and `with` memory; `ideal` is a drive by somebody who knows what the passenger wants: what no system here
could do better with these parameters."""

_LIMITS: Final = Limits()


def arms_of(task: Task) -> tuple[Arm, ...]:
    """Systems that drive. The published rules know only spots in a lot, so they are not asked about the speed there."""
    return tuple(arm for arm in ARMS if task != "pace" or arm != "keyword")


@dataclass(frozen=True, slots=True)
class StudyConfig:
    """Settings that decide a run.

    Attributes:
        passengers: How many simulated people.
        seed: They, their moods and their words are drawn from it.
        planner: Who plans without and with memory.
        half: Which half of the wordings is said.
        trips: How many trips the memory learns from, for each task.
    """

    passengers: int = 100
    seed: int = 1
    planner: str = "talk2drive"
    half: Half = "test"
    trips: int = 5


@dataclass(frozen=True, slots=True)
class StudyJob:
    """One passenger, one task.

    Attributes:
        key: E.g. `p0007.overtake`.
        number: The passenger's, from 0.
        task: What for.
        study: What decides the run.
        options: Of the planner.
    """

    key: str
    number: int
    task: Task
    study: StudyConfig
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def id(self) -> str:
        return self.key

    @property
    def near(self) -> str:
        """See BenchJob: workers have the planner, and nothing of a passenger."""
        return ""

    def run(self) -> Row:
        """All trips, as one row. Raises ChauffeurError: an endpoint that does not answer is no takeover."""
        return asyncio.run(_Sitting(self).row())

    def spoiled(self, detail: str) -> Row:
        return {"key": self.key, "infra_failed": True, "detail": detail}


def versions() -> dict[str, str]:
    """Versions that decide a study beside its configuration."""
    return {
        "bench": BENCH_VERSION,
        "population": POPULATION_VERSION,
        "takeover": TAKEOVER_VERSION,
        "trace": TRACE_VERSION,
        "ride": RIDE_VERSION,
    }


@dataclass(frozen=True, slots=True)
class _Day:
    """An occasion: what is wanted, where, and the words for it."""

    mood: Mood
    scene: Scenario
    words: str


class _Sitting:
    """A passenger with their words, moods and the order of their trips."""

    def __init__(self, job: StudyJob) -> None:
        self._job, self._study = job, job.study
        self._passenger = draw_passengers(job.number + 1, job.study.seed)[job.number]
        self._rng = np.random.default_rng([job.study.seed, job.number, TASKS.index(job.task), 1])
        self._scenes = scenes_of(job.task)

    async def row(self) -> Row:
        """All trips, as one row."""
        job = self._job
        own = planner_of(self._study.planner, job.options)
        trips: list[Row] = []
        with learning(self._passenger) as (vault, person, end_day):
            memory = RecentToo(vault)
            for number in range(1, self._study.trips + 1):
                day = self._day(LEVELS[int(self._rng.integers(len(LEVELS)))])
                done = await ride(own, memory, day.words, person, job.task, day.scene, _LIMITS)
                found = judge(done.trace, self._passenger, day.mood)
                said = self._say(found, day.mood)
                end_day(said)
                trips.append(self._row("with", day, number, 0, done.trace, found) | _planned(done, "learning", said))
            asked = {
                "keyword": (KeywordParameters(), NOBODY, Forgetful()),
                "keyword-fair": (KeywordParameters(fair=True), NOBODY, Forgetful()),
                "without": (own, NOBODY, Forgetful()),
                "with": (own, person, ReadOnly(memory)),
            }
            arms = arms_of(job.task)
            for level in LEVELS:
                day = self._day(level)
                for place, index in enumerate(self._rng.permutation(len(arms)), start=1):
                    arm = arms[int(index)]
                    if arm == "ideal":
                        trace, plan = ride_policy(self._ideal(day), job.task, day.scene, _LIMITS), Row()
                    else:
                        planner, who, recalls = asked[arm]
                        done = await ride(planner, recalls, day.words, who, job.task, day.scene, _LIMITS)
                        trace, plan = done.trace, _planned(done, "measured", "")
                    found = judge(trace, self._passenger, day.mood)
                    trips.append(self._row(arm, day, self._study.trips + 1, place, trace, found) | plan)
        row: Row = {"key": job.key, "infra_failed": False, "passenger": self._passenger.id, "task": job.task}
        return row | {"trips": trips}

    def _day(self, level: Level) -> _Day:
        passenger, job, rng = self._passenger, self._job, self._rng
        scene = self._scenes[int(rng.integers(len(self._scenes)))]
        start, limit = _start(job.task, scene.id)
        aim = aim_of(passenger, job.task, int(rng.integers(3)), start, limit)
        pace = float(1.0 + passenger.noise * rng.normal())
        words = wishes_of(aim, level, self._study.half)
        return _Day(Mood(job.task, aim, level, pace), scene, words[int(rng.integers(len(words)))])

    def _ideal(self, day: _Day) -> Parameters:
        """Choice that the passenger, who knows what they want, would make."""
        mood = day.mood
        _, limit = _start(mood.task, day.scene.id)
        step = 0.5 if GROUND_OF[mood.task] == "highway" else 0.25  # as exactly as anybody sets a speed
        speed = min(step * round(wanted_mps(self._passenger, mood, limit) / step), limit)
        shy = mood.level == "III" and self._passenger.lane_habit == "stays"
        lane: Literal[-1, 0, 1] = 0
        if mood.task == "overtake" and not shy:
            lane = -1
        elif mood.task == "right_lane" and not shy:
            lane = 1
        place = mood.aim.partition(".")[2] if mood.task == "park" else ""
        return usual(mood.task, round(speed, 2), lane, place)

    def _say(self, found: Judgement, mood: Mood) -> str:
        """Feedback after a drive, in words of their own; empty where they say nothing."""
        choice = mood.aim.partition(".")[2]  # a place, or a direction of speed
        words = remark(self._passenger, found, self._study.half, self._rng)
        return words.format(place=PLACE_WORDS.get(choice, "in a free spot"), pace=choice)

    def _row(self, arm: Arm, day: _Day, trip: int, place: int, trace: Trace, found: Judgement) -> Row:
        mood = day.mood
        return {
            "arm": arm,
            "task": mood.task,
            "ground": GROUND_OF[mood.task],
            "aim": mood.aim,
            "level": mood.level,
            "scene": day.scene.id,
            "trip": trip,
            "phase": "measured",
            "place": place,
            "wish": day.words,
            "wanted_mps": round(wanted_mps(self._passenger, mood, trace.limit_mps), 2),
            "outcome": trace.outcome,
            "seconds": round(trace.seconds, 1),
            "takeover": found.takes_over,
            "topic": found.topic,
            "at_s": found.at_s,
            "force": found.force,
            "deviation": found.deviation,
            "statistics": asdict(trace.statistics()),
        }


def _planned(done: Ride, phase: str, said: str) -> Row:
    """The columns of a trip that a planner drove."""
    plan = done.trip.plan
    return {
        "phase": phase,
        "declined": done.declined,
        "refusal": plan.refusal,
        "intent": plan.intent,
        "policy": None if plan.policy is None else asdict(plan.policy),
        "recalled": len(done.trip.history.items),
        "feedback": said,
        "latency_s": round(plan.latency_s, 4),
    }


@lru_cache(maxsize=64)
def _start(task: Task, scene: str) -> tuple[float, float]:
    """Speed and limit at the beginning of a scene, m/s."""
    found = next(one for one in scenes_of(task) if one.id == scene)
    shot = make_world(found).reset(found)
    return shot.ego.speed_mps, limit_of(shot)
