"""The referee of acts: when a drive is over, and what came of it.

A benchmark has goals of its own, and ends the instant one is met. A passenger who says "overtake and come back" has not
been served in the left lane, nor one who wants 40 m when 38 m flash by. So every act is done in its order, what is set
(lane, speed, gap) is reached and held, and a program that still has something to do has done it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

from chauffeur.concept import JudgedBy, Metric, Outcome, ProgramState, Setpoints, WishPart
from chauffeur.concept.utterance import Act, Verb
from chauffeur.driving.judge.acts import JudgedAct, judge, wanted
from chauffeur.driving.judge.setpoints import gap_asked, planned_gap, speed_asked
from chauffeur.driving.judge.trace import PERIOD_S, DriveTrace, Referents, TracedDrive
from chauffeur.language.meaning.words import act_words
from chauffeur.worlds.base import World

SETTLES_S: Final = 12.0
"""How long what a program that has ended asked for has time to be reached."""
WAY_S: Final = 30.0
"""The same for a way at a junction that the car was set to take."""
_EVERY_S, _EVERY_IN_TOWN_S = 0.5, 1.0
_STEPS: Final[frozenset[Verb]] = frozenset({"pass", "lane"})
"""What may take several steps: a program that is still at it may have one to go, e.g. coming back."""
_WAYS: Final[frozenset[Verb]] = frozenset({"turn", "straight"})
_GAPS: Final[frozenset[Verb]] = frozenset({"gap", "follow", "yield"})


class ActsReferee:
    """Judges a drive by acts, right from where the world was reset."""

    def __init__(
        self,
        world: World,
        acts: Sequence[Act],
        judged_by: JudgedBy,
        referents: Referents | None = None,
        settings: Mapping[str, float] | None = None,
    ) -> None:
        """Take a task.

        Args:
            world: Where it is driven.
            acts: What was asked for.
            judged_by: Where they come from: the reading of the words, the plan, or people's labels.
            referents: Whom references mean, where a stage names them.
            settings: Numbers that the plan sets.
        """
        self._world, self._acts, self._referents, self._settings = world, wanted(acts), referents, settings or {}
        self._source: JudgedBy = judged_by
        seen = world.observe()
        self._trace = DriveTrace(seen.road, seen)
        self._every_s = _EVERY_S if seen.road.uninterrupted else _EVERY_IN_TOWN_S
        self._setpoints, self._state = Setpoints(), "none"
        self._kept_s = self._judged_s = -math.inf
        self._ended_s: float | None = None
        self._done_s: float | None = None
        self._found: tuple[JudgedAct, ...] = ()
        self._look()

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the policy asks for in this period, before `observe`."""
        self._setpoints, self._state = setpoints, state

    def observe(self) -> None:
        """Look at the instant after a control period."""
        self._look()

    def _look(self) -> None:
        seen = self._world.observe()
        if seen.time_s - self._kept_s < PERIOD_S - 1e-6 and not seen.ended:
            return
        self._kept_s = seen.time_s
        self._trace.add(seen, self._setpoints)
        if self._state == "finished" and self._ended_s is None:
            self._ended_s = seen.time_s
        if seen.time_s - self._judged_s >= self._every_s - 1e-6 or seen.ended:
            self._judge()

    def _judge(self) -> None:
        self._judged_s = self._kept_s
        self._found = judge(self._acts, self._trace, self._referents, self._settings)
        self._done_s = None if not self._is_done else self._kept_s if self._done_s is None else self._done_s

    @property
    def judged(self) -> tuple[JudgedAct, ...]:
        """What became of each act so far."""
        if self._judged_s < self._kept_s:
            self._judge()
        return self._found

    @property
    def _is_done(self) -> bool:
        known = [one.result for one in self._found if one.result != "not_judged"]
        return bool(known) and all(result == "done" for result in known)

    @property
    def over(self) -> bool:
        """Whether all is done, the opposite was done, or the program ended without."""
        if any(one.result == "opposite" for one in self._found):
            return True
        ended_s = -math.inf if self._ended_s is None else self._kept_s - self._ended_s
        open_ended = any(one.act.negated or one.act.act == "keep" or one.result == "not_judged" for one in self._found)
        at_it = self._state == "running" and any(act.act in _STEPS for act in self._acts)
        if self._is_done and not open_ended and not (at_it and self._trace.road.uninterrupted):
            return True
        missing = {one.act.act for one in self._found if one.result == "not_done"}
        return ended_s >= (WAY_S if missing & _WAYS else SETTLES_S)

    @property
    def success(self) -> bool:
        """Whether every act that can be judged was done, and one can."""
        return bool(self.judged) and self._is_done

    @property
    def parts(self) -> tuple[WishPart, ...]:
        """The acts in plain words, and what became of each."""
        return tuple(WishPart(one.result, act_words(one.act).replace(" —", ","), one.why) for one in self.judged)

    @property
    def judged_by(self) -> JudgedBy:
        """Where the acts come from; the plan, where a number of its own decided."""
        return "plan" if any(one.planned for one in self.judged) else self._source

    def outcome(self) -> Outcome:
        """What came of it, collisions apart: not done by a program that ended, or not in the time there was."""
        if self.success:
            return "success"
        if all(one.result == "not_judged" for one in self.judged):
            return "ended"
        failed = self._state == "finished" or any(one.result == "opposite" for one in self.judged)
        return "failure" if failed else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """Share of the acts that were done, how long it took, and what was asked for and reached in numbers."""
        done, count = sum(one.result == "done" for one in self.judged), len(self.judged)
        return (
            Metric("meaning-acts-v1", done / count if count else 0.0, "share", applies=count > 0),
            Metric("meaning-time-v1", self._done_s or 0.0, "s", applies=self._done_s is not None),
            *self._numbers(),
        )

    def _numbers(self) -> tuple[Metric, ...]:
        drive, end = TracedDrive(self._trace, {}, self._settings), self._trace.instants[-1]
        found: list[Metric] = []
        for act in self._acts:
            if act.act == "speed":
                asked = speed_asked(drive, act, 0)
                asked = self._settings.get("target_speed_mps") if asked is None else asked
                found += [] if asked is None else [Metric("asked-speed-v1", asked, "m/s")]
            if act.act in _GAPS:
                asked = gap_asked(drive, act, 0, -1)
                asked = planned_gap(drive, -1) if asked is None else asked
                found += [] if asked is None else [Metric("asked-gap-v1", asked, "m")]
        if not drive.road.has_parking:
            found.append(Metric("end-speed-v1", end.ego.speed_mps, "m/s"))
        if end.front is not None and self._acts and (self._acts[-1].act in _GAPS or self._acts[-1].style):
            found.append(Metric("end-gap-v1", end.front.distance_m, "m"))
        if drive.road.uninterrupted and end.ego.lane is not None:
            found.append(Metric("end-lane-v1", float(drive.places[-1]), "lanes"))
        return tuple(found)
