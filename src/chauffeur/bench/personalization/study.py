"""What one simulated passenger does for one task: trips with every system in blind order, and a profile that grows.

For each level of directness the passenger says the same words on the same scene to every system and judges each drive
without knowing whose it is. The system with memory has learnt from trips before: the same task, other words, other
scenes, levels by chance, and after each the passenger said how it was, in words, through the memory's own door.
"""

from __future__ import annotations

import asyncio
import tempfile
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.personalization.baseline import KeywordParameters
from chauffeur.bench.personalization.population import POPULATION_VERSION, draw_passengers
from chauffeur.bench.personalization.ride import RIDE_VERSION, ReadOnly, Ride, ride, ride_policy, usual
from chauffeur.bench.personalization.sayings import LEVELS, PLACE_WORDS, Half, Level, feedback_of, wishes_of
from chauffeur.bench.personalization.scenes import GROUND_OF, TASKS, Task, scenes_of
from chauffeur.bench.personalization.takeover import (
    TAKEOVER_VERSION,
    Judgement,
    Mood,
    aim_of,
    judge,
    wanted_mps,
)
from chauffeur.bench.personalization.traces import TRACE_VERSION, Trace
from chauffeur.concept import NOBODY, Limits, Parameters, PersonId, Scenario
from chauffeur.drive.session import Forgetful, make_world
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.privacy import Privacy
from chauffeur.memory.vault import VaultMemory
from chauffeur.planners.base import Planner
from chauffeur.planners.talk2drive.recent import RecentToo

BENCH_VERSION: Final = "personalization-v3"

Arm = Literal["keyword", "keyword-fair", "without", "with", "ideal"]
ARMS: Final[tuple[Arm, ...]] = ("keyword", "keyword-fair", "without", "with", "ideal")
"""`without` and `with` memory; `ideal` is a drive by somebody who knows what the passenger wants: what no system here
could do better with these parameters."""

_LIMITS: Final = Limits()


def arms_of(task: Task) -> tuple[Arm, ...]:
    """Who drives. The published rules know only spots in a lot, so they are not asked about the speed there."""
    return tuple(arm for arm in ARMS if task != "pace" or arm != "keyword")


@dataclass(frozen=True, slots=True)
class StudyJob:
    """One passenger, one task.

    Attributes:
        key: E.g. `p0007.overtake`.
        number: The passenger's, from 0.
        task: What for.
        seed: Of the study.
        planner: Who plans without and with memory.
        half: Which wordings are said.
        trips: How many trips the memory learns from.
        options: Of the planner.
    """

    key: str
    number: int
    task: Task
    seed: int
    planner: str
    half: Half
    trips: int
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def id(self) -> str:
        """See BenchItem: a sitting is asked for, and done, by itself."""
        return self.key

    @property
    def near(self) -> str:
        """See BenchJob: workers have the planner, and nothing of a passenger."""
        return ""

    def run(self) -> Row:
        """All trips, as one row. Raises ChauffeurError: an endpoint that does not answer is no takeover."""
        return asyncio.run(sit(self))

    def spoiled(self, detail: str) -> Row:
        return {"key": self.key, "infra_failed": True, "detail": detail}


def versions() -> dict[str, str]:
    """What decides a study beside its configuration."""
    return {
        "bench": BENCH_VERSION,
        "population": POPULATION_VERSION,
        "takeover": TAKEOVER_VERSION,
        "trace": TRACE_VERSION,
        "ride": RIDE_VERSION,
    }


async def sit(job: StudyJob) -> Row:
    """All trips of one passenger for one task, as one row, where a loop runs already."""
    return await _Sitting(job).rows()


class _Sitting:
    """A passenger with their words, moods and the order of their trips."""

    def __init__(self, job: StudyJob) -> None:
        self._job = job
        self._passenger = draw_passengers(job.number + 1, job.seed)[job.number]
        self._rng = np.random.default_rng([job.seed, job.number, TASKS.index(job.task), 1])
        self._scenes = scenes_of(job.task)
        self._planner = _planner(job.planner, job.options)

    async def rows(self) -> Row:
        """The row."""
        job = self._job
        trips: list[Row] = []
        now = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)
        with tempfile.TemporaryDirectory(prefix="chauffeur-study-") as home:
            clock = Calendar(now)
            vault = VaultMemory(Path(home), passphrase="", privacy=Privacy(None), clock=clock)
            memory = RecentToo(vault)
            person = PersonId(f"simulated {self._passenger.id}")
            for number in range(1, job.trips + 1):
                mood, scene, words = self._occasion(self._level())
                done = await ride(self._planner, memory, words, person, job.task, scene, _LIMITS)
                found = judge(done.trace, self._passenger, mood)
                said = self._say(found, mood)
                if said:
                    vault.attach_feedback(person, interpret_feedback(said))
                clock.forward()
                trips.append(self._row("with", number, mood, words, done, found, said, 0, "learning"))
            learnt = ReadOnly(memory)
            for level in LEVELS:
                mood, scene, words = self._occasion(level)
                arms = arms_of(job.task)
                order: list[Arm] = [arms[int(index)] for index in self._rng.permutation(len(arms))]
                for place, arm in enumerate(order, start=1):
                    if arm == "ideal":
                        trace = ride_policy(self._ideal(mood, scene), job.task, scene, _LIMITS)
                        found = judge(trace, self._passenger, mood)
                        trips.append(self._bare(arm, mood, words, scene, trace, found, place))
                        continue
                    planner, who, recalls = {
                        "keyword": (_keyword(fair=False), NOBODY, Forgetful()),
                        "keyword-fair": (_keyword(fair=True), NOBODY, Forgetful()),
                        "without": (self._planner, NOBODY, Forgetful()),
                        "with": (self._planner, person, learnt),
                    }[arm]
                    done = await ride(planner, recalls, words, who, job.task, scene, _LIMITS)
                    found = judge(done.trace, self._passenger, mood)
                    trips.append(self._row(arm, job.trips + 1, mood, words, done, found, "", place, "measured"))
        row: Row = {"key": job.key, "infra_failed": False, "passenger": self._passenger.id, "task": job.task}
        return row | {"trips": trips}

    def _level(self) -> Level:
        return LEVELS[int(self._rng.integers(len(LEVELS)))]

    def _occasion(self, level: Level) -> tuple[Mood, Scenario, str]:
        """A day: a scene, what is wanted, and the words for it."""
        passenger, job, rng = self._passenger, self._job, self._rng
        scene = self._scenes[int(rng.integers(len(self._scenes)))]
        start, limit = _start(job.task, scene.id)
        aim = aim_of(passenger, job.task, int(rng.integers(3)), start, limit)
        pace = float(1.0 + passenger.noise * rng.normal())
        words = wishes_of(aim, level, job.half)
        return Mood(job.task, aim, level, pace), scene, words[int(rng.integers(len(words)))]

    def _ideal(self, mood: Mood, scene: Scenario) -> Parameters:
        """What the passenger would choose, who knows what they want."""
        _, limit = _start(mood.task, scene.id)
        ground = GROUND_OF[mood.task]
        step = 0.5 if ground == "highway" else 0.25  # as exactly as anybody sets a speed
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
        talk = self._passenger.talk
        if not found.takes_over:
            chance = {"silent": 0.0, "brief": 0.5, "open": 1.0}[talk]
            if self._rng.random() >= chance:
                return ""
        texts = feedback_of(found.topic, found.force, self._job.half)
        text = texts[int(self._rng.integers(len(texts)))]
        choice = mood.aim.partition(".")[2]  # a place, or a direction of speed
        return text.format(place=PLACE_WORDS.get(choice, "in a free spot"), pace=choice)

    def _row(
        self,
        arm: Arm,
        number: int,
        mood: Mood,
        words: str,
        done: Ride,
        found: Judgement,
        said: str,
        place: int,
        phase: str,
    ) -> Row:
        plan = done.trip.plan
        row = self._bare(arm, mood, words, None, done.trace, found, place)
        row |= {
            "scene": done.trip.scenario,
            "trip": number,
            "phase": phase,
            "declined": done.declined,
            "refusal": plan.refusal,
            "intent": plan.intent,
            "policy": None if plan.policy is None else asdict(plan.policy),
            "recalled": len(done.trip.history.items),
            "feedback": said,
            "latency_s": round(plan.latency_s, 4),
        }
        return row

    def _bare(
        self,
        arm: Arm,
        mood: Mood,
        words: str,
        scene: Scenario | None,
        trace: Trace,
        found: Judgement,
        place: int,
    ) -> Row:
        return {
            "arm": arm,
            "task": mood.task,
            "ground": GROUND_OF[mood.task],
            "aim": mood.aim,
            "level": mood.level,
            "scene": "" if scene is None else scene.id,
            "trip": self._job.trips + 1,
            "phase": "measured",
            "place": place,
            "wish": words,
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


class Calendar:
    """A clock that stands still until the next day."""

    def __init__(self, start: datetime) -> None:
        self._now = start

    def __call__(self) -> datetime:
        return self._now

    def forward(self) -> None:
        """The next day."""
        self._now += timedelta(days=1)


@lru_cache(maxsize=64)
def _start(task: Task, scene: str) -> tuple[float, float]:
    """Speed and limit at the beginning of a scene, m/s."""
    found = next(one for one in scenes_of(task) if one.id == scene)
    shot = make_world(found).reset(found)
    here = shot.road.get(shot.ego.lane) or shot.road.lanes[0]
    return shot.ego.speed_mps, here.speed_limit_mps


@lru_cache(maxsize=2)
def _planner(spec: str, options: tuple[tuple[str, Any], ...]) -> Planner:
    """This process's planner: loading a model takes longer than a trip."""
    from chauffeur.planners.registry import make_planner

    return make_planner(spec, **dict(options))


@lru_cache(maxsize=2)
def _keyword(*, fair: bool) -> Planner:
    return KeywordParameters(fair=fair)
