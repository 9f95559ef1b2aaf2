"""Learning to follow instructions in a town (paper, Sec. IV-B: the human-feedback row of Tab. V).

Lesson by lesson: the planner writes a program, it is checked and driven, and the evaluator, which is a program and no
person, says what was wrong. Its words go back to the planner with the last program. What was driven without fault joins
the policy repository, where later lessons, and any planner, find it.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

from chauffeur.bench.lampilot.coaching import fallback_description, learned_entry
from chauffeur.bench.leaderboard.instructed import system_for
from chauffeur.bench.leaderboard.lessons import Lesson, LessonDrive, LessonResult, lessons_of
from chauffeur.bench.leaderboard.routes import LeaderboardRoute
from chauffeur.concept import (
    ChauffeurError,
    Context,
    Instruction,
    Limits,
    Plan,
    PlanRequest,
    Program,
    ProgramError,
    Round,
    Thoughts,
)
from chauffeur.driving.planning import screened_request
from chauffeur.memory.policies import PolicyRepository
from chauffeur.planners.base import Planner

_WANTED: Final = re.compile(r"asks for the way (left|right|straight)")
_LANE: Final = re.compile(r"asks for the lane to the (left|right)")
_MOVE_OVER: Final = """    for _ in range(400):
        if change_lane_{side}():
            break
        yield proceed(check_speed_limit())
"""
_CALLS: Final = {
    "left": "turn_left_at_next_intersection()",
    "right": "turn_right_at_next_intersection()",
    "straight": "go_straight_at_next_intersection()",
}


class Apprentice:
    """Writes the plainest program there is, and mends it by what the evaluator says. It reads no instruction.

    It stands in where no language model is at hand: all that its programs know was learned from feedback.
    """

    id = model = "apprentice"

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan."""
        said = " ".join(one.feedback for one in request.rounds)
        body, name = "", "drive_on"
        if lane := _LANE.search(said):
            body, name = _MOVE_OVER.format(side=lane[1]), f"move_over_{lane[1]}"
        if way := _WANTED.search(said):
            body += f"    {_CALLS[way[1]]}\n"
            name = f"{name}_and_go_{way[1]}" if lane else f"go_{way[1]}"
        source = f"def {name}():\n{body}    while True:\n        yield proceed(check_speed_limit())\n"
        return Plan(Thoughts("As I was told."), Program(source), planner=self.id, model=self.model)


@dataclass(frozen=True, slots=True)
class TownLesson:
    """Outcome of coaching on a lesson: its attempts, the words on the last one, and the name of what was kept."""

    lesson: Lesson
    attempts: int
    words: str
    kept: str = ""


@dataclass(slots=True)
class TownCoach:
    """Coaches a planner on training routes.

    Attributes:
        planner: Who writes.
        repository: Where programs go that did well.
        limits: Bounds of the programs.
        seed: Of traffic, of where lessons begin, and of their words.
        rounds: Attempts at most at a lesson.
        tell: Is told of every lesson when it is over.
    """

    planner: Planner
    repository: PolicyRepository
    limits: Limits
    seed: int = 0
    rounds: int = 5
    tell: Callable[[TownLesson], None] = lambda _: None

    def coach(self, routes: Sequence[LeaderboardRoute], lessons: int) -> tuple[TownLesson, ...]:
        """Go through lessons, each kind of instruction first once, until so many programs are kept or none is left.

        What the repository holds already is not learned again. An interrupt keeps what is done.

        Raises:
            ChauffeurError: No route can be set up, or the repository cannot be written.
        """
        done: list[TownLesson] = []
        known = {entry.item for entry in self.repository.entries}
        kept = len(self.repository.entries)
        with asyncio.Runner() as runner:
            for lesson in self._chosen(routes):
                if kept >= lessons:
                    break
                if lesson.id in known:
                    continue
                found = self._lesson(lesson, runner)
                kept += bool(found.kept)
                done.append(found)
                self.tell(found)
        return tuple(done)

    def _chosen(self, routes: Sequence[LeaderboardRoute]) -> list[Lesson]:
        """Lessons of all routes in turn; those whose kind of instruction came already are put behind."""
        found = [list(lessons_of(route, self.seed)) for route in routes if not route.fault]
        kinds: dict[str, int] = {}
        order: list[tuple[int, int, Lesson]] = []
        for i in range(max(map(len, found), default=0)):
            for of_route in found:
                if i < len(of_route):
                    kind = of_route[i].said.kind
                    order.append((kinds.get(kind, 0), len(order), of_route[i]))
                    kinds[kind] = kinds.get(kind, 0) + 1
        return [lesson for _, _, lesson in sorted(order, key=lambda one: one[:2])]

    def _lesson(self, lesson: Lesson, runner: asyncio.Runner) -> TownLesson:
        rounds: list[Round] = []
        result = LessonResult(False, "")
        for number in range(1, self.rounds + 1):
            try:
                drive = LessonDrive(lesson, self.limits)
                context = drive.context
                system = system_for("human-feedback", self.repository, lesson.said.text, context, self.limits)
                request = screened_request(
                    Instruction(lesson.said.text, source="benchmark"), context, system,
                    rounds=tuple(rounds), limits=self.limits,
                )  # fmt: skip
                plan = runner.run(self.planner.plan(request))
                result = drive.attempt(plan)
            except ChauffeurError as error:
                return TownLesson(lesson, number, str(error))
            if result.done and isinstance(plan.policy, Program):
                return self._kept(lesson, number, plan, context, rounds)
            source = plan.policy.source if isinstance(plan.policy, Program) else plan.refusal
            rounds.append(Round(source, f"The evaluator (a program, not a person) says: {result.words}"))
        return TownLesson(lesson, self.rounds, result.words)

    def _kept(self, lesson: Lesson, attempts: int, plan: Plan, context: Context, rounds: Sequence[Round]) -> TownLesson:
        command = lesson.said.text
        try:
            entry = learned_entry(
                plan,
                command,
                context,
                lambda _source: fallback_description(command),
                scenario=lesson.town,
                item=lesson.id,
                judge="evaluator",
                critiques=[one.feedback for one in rounds],
                learned=datetime.now(UTC),
            )
            return TownLesson(lesson, attempts, "", self.repository.commit(entry).callable_name)
        except ProgramError as error:
            return TownLesson(lesson, attempts, str(error))
