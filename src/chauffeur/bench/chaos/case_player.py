"""One case, as it is played in a trip of a running drive: wishes are asked, the fault strikes, all is written down."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

from chauffeur.bench.chaos.cases import ChaosCase
from chauffeur.bench.chaos.judge import judge, recovery
from chauffeur.bench.chaos.model import ModelServer, Script
from chauffeur.bench.chaos.outside import HeardOutside, OutsideDrive
from chauffeur.bench.chaos.replies import WISHES
from chauffeur.bench.chaos.vandal import FORGED
from chauffeur.bench.chaos.witness import Witness
from chauffeur.drive.live.messages import Report
from chauffeur.drive.live.starts import Start

Trace = Callable[[str], None]

LATEST: Final = 0.7
"""Share of a trip after which a fault strikes, whether its stage has come or not."""
_END_S: Final = 1.0
_BETWEEN_WISHES: Final = 12
_FAULTY_MODEL_WAIT: Final = 36
_TWICE_AFTER_S: Final = 0.4


def silent(words: str) -> None:
    """No trace."""
    del words


@dataclass(slots=True)
class Asked:
    """A wish of the case.

    Attributes:
        words: Of the person.
        at_ns: When it was asked.
        after_fault: Whether the fault had struck.
        name: What the supervisor calls it; empty until it says so.
        answers: Final events, which should be one.
        events: Kinds of all events.
    """

    words: str
    at_ns: int
    after_fault: bool
    name: str = ""
    answers: list[str] = field(default_factory=list[str])
    events: list[str] = field(default_factory=list[str])


@dataclass(slots=True)
class Play:
    """A case under way.

    Attributes:
        case: Which.
        trip: Number of its trip in the drive.
        heard: Reports of control in the trip.
        asked: Wishes, in order.
        struck_ns: When the fault struck; 0 until then.
        at_stage: Whether it struck at the stage that was drawn.
        ended: Whether the trip, or the drive, is over.
    """

    case: ChaosCase
    trip: int
    drive: OutsideDrive
    server: ModelServer
    trace: Trace = silent
    heard: list[HeardOutside] = field(default_factory=list[HeardOutside])
    asked: list[Asked] = field(default_factory=list[Asked])
    struck_ns: int = 0
    at_stage: bool = False
    ended: bool = False
    fit: bool = False
    stage_tick: int | None = None
    replaced: list[str] = field(default_factory=list[str])
    notes: dict[str, Any] = field(default_factory=dict[str, Any])
    _later: list[tuple[float, Callable[[], object]]] = field(default_factory=list[tuple[float, Callable[[], object]]])
    _planning: bool = False
    _planned: bool = False
    _started: set[str] = field(default_factory=set[str])
    _last_ask_tick: int = 0

    def begin(self) -> None:
        """Set the language model up."""
        case = self.case
        script = Script(good=dict(WISHES[case.road]))
        if case.kind.family == "model":
            script.fault = case.kind.name.removeprefix("model-")
            script.times = 1 + case.draw % 3 if case.draw % 2 else 99
            script.late_s = 0.5 + 3.0 * (case.draw % 1000) / 1000.0
        self.server.script = script

    # What is heard ----------------------------------------------------------------------------------------------------

    def report(self, each: HeardOutside) -> None:
        """A report of this trip."""
        report = each.report
        self.heard.append(each)
        if not self.ended:
            self._go_on(report)
        if report.ended:
            self.ended = True
            self.notes["hits"] = self.server.script.hit
            self.trace(f"{report.tick:4d} the trip has ended: {report.outcome}")

    def line(self, said: dict[str, Any]) -> None:
        """A line of the host that is about this case."""
        if said.get("asked") is not None and said["of"] == self.case.number:
            next(one for one in self.asked if not one.name).name = said["asked"]
        elif "event" in said:
            event = said["event"]
            one = next((one for one in self.asked if one.name and one.name == event["wish"]), None)
            if one is None:
                return
            self.trace(f"     {event['wish']}: {event['kind']} {event['text'][:100]}")
            one.events.append(event["kind"])
            self._planning |= event["kind"] == "planning"
            self._planned |= event["kind"] == "planned"
            if event["kind"] in ("started", "resumed"):
                self._started.add(one.name)

    def answer(self, name: str, kind: str) -> bool:
        """A final event; whether it was for this case."""
        one = next((one for one in self.asked if one.name == name), None)
        if one is not None:
            one.answers.append(kind)
        return one is not None

    # What is done -----------------------------------------------------------------------------------------------------

    def _go_on(self, report: Report) -> None:
        tick = report.tick
        last = self.heard[-2].report if len(self.heard) > 1 else None
        if last is None or (last.level, last.plan, last.state) != (report.level, report.plan, report.state):
            self.trace(
                f"{tick:4d} {report.level:6s} plan {report.plan or '-':4s} {report.state:8s} "
                f"{report.speed_mps:5.1f} m/s lane {report.lane}"
            )
        self.breathe()
        if not self.struck_ns and self.case.stage == "before-plan" and tick >= self.case.ask_at:
            self._strike(at_stage=True)
        if self._to_ask(tick):
            self._ask(tick)
        if self.struck_ns:
            return
        if self.stage_tick is None and self._reached(report):
            self.stage_tick = tick
        at_stage = self.stage_tick is not None and tick - self.stage_tick >= self._wait
        if at_stage or tick * 0.1 > LATEST * self.case.most_s:
            self._strike(at_stage=at_stage)

    def _to_ask(self, tick: int) -> bool:
        """Whether the next wish is due: the first at its time, further ones after the fault."""
        if not self.asked:
            return tick >= self.case.ask_at
        return (
            len(self.asked) < len(self.case.wishes)
            and self.struck_ns > 0
            and tick - self._last_ask_tick >= self._pause
            and (time.monotonic_ns() - self.struck_ns) * 1e-9 > min(self.case.for_s, 0.3)
        )

    @property
    def _pause(self) -> int:
        """Control periods between two wishes: a faulty model gets the time to be so."""
        waits = self.case.kind.family == "model" and not self.asked[-1].answers
        return _FAULTY_MODEL_WAIT if waits else _BETWEEN_WISHES

    @property
    def _wait(self) -> int:
        """Control periods from the beginning of the stage to the fault."""
        return {"running": self.case.after, "lane-change": self.case.after // 2, "junction": self.case.after}.get(
            self.case.stage, 0
        )

    def _reached(self, report: Report) -> bool:
        match self.case.stage:
            case "before-plan":
                return bool(self.asked)
            case "planning":
                return self._planning
            case "ordered":
                return self._planned
            case "running":
                return report.plan in self._started and report.state == "running"
            case "lane-change":
                return report.setpoints.target_lane not in (None, report.lane) and bool(report.plan)
            case "junction":
                # Lanes of the middle lead from the inner right to the inner left nodes.
                return report.lane is not None and report.lane.startswith("ir")
            case "end":
                return report.tick * 0.1 >= self.case.most_s * LATEST - _END_S

    def _ask(self, tick: int) -> None:
        words = self.case.wishes[len(self.asked)][0]
        self.trace(f"{tick:4d} asked: {words}")
        self.asked.append(Asked(words, time.monotonic_ns(), bool(self.struck_ns)))
        self._last_ask_tick = tick
        if self.case.kind.family == "model" and not self.struck_ns:
            self._strike(at_stage=True)  # the fault lies in wait at the server
        self.drive.ask(words, self.case.number)

    def breathe(self) -> None:
        """Do what is due."""
        now_s = time.monotonic()
        due = [deed for at_s, deed in self._later if at_s <= now_s]
        self._later = [(at_s, deed) for at_s, deed in self._later if at_s > now_s]
        for deed in due:
            deed()

    def _in(self, seconds: float, deed: Callable[[], object]) -> None:
        self._later.append((time.monotonic() + seconds, deed))

    def _strike(self, *, at_stage: bool) -> None:
        case, drive = self.case, self.drive
        self.at_stage = at_stage
        # Where nobody was driving before, there is nothing to break.
        self.fit = any(each.report.level == "follow" for each in self.heard[-5:])
        name = case.kind.name.removeprefix("onboard-")
        self.trace(f"{self.heard[-1].report.tick:4d} FAULT: {case.kind.name}")
        self.struck_ns = time.monotonic_ns()
        if case.kind.family == "memory" and name != "scribbled-then-killed":
            if name == "frozen-observation":
                drive.send("policy", signal.SIGSTOP)
                self._in(case.for_s, lambda: drive.send("policy", signal.SIGCONT))
            self.notes["sent"] = drive.scribble(name, case.draw, case.for_s)
            return
        match name:
            case "worker-killed":
                self.notes["sent"] = drive.kill_workers()
            case "policy-paused" | "planner-paused":
                role = "policy" if name == "policy-paused" else "planner"
                self.notes["sent"] = drive.send(role, signal.SIGSTOP)
                self._in(case.for_s, lambda: drive.send(role, signal.SIGCONT))
            case "policy-killed":
                self.notes["sent"] = drive.send("policy", signal.SIGKILL)
            case "policy-killed-twice":
                self.notes["sent"] = drive.send("policy", signal.SIGKILL)
                self._in(_TWICE_AFTER_S, lambda: drive.send("policy", signal.SIGKILL))
            case "policy-and-spare-killed":
                drive.send("spare", signal.SIGKILL)
                self.notes["sent"] = drive.send("policy", signal.SIGKILL)
            case "policy-hangs":
                self.notes["sent"] = drive.send("policy", signal.SIGSTOP)
            case "planner-killed":
                self.notes["sent"] = drive.send("planner", signal.SIGKILL)
            case "planner-hangs":
                self.notes["sent"] = drive.send("planner", signal.SIGSTOP)
            case "scribbled-then-killed":
                rings = ("checkpoints-garbage", "wishes-garbage", "orders-garbage", "policy-events-garbage")
                self.notes["sent"] = drive.scribble(rings[case.draw % len(rings)], case.draw, 0.05)
                self._in(0.1, lambda: drive.send("policy", signal.SIGKILL))
            case "control-killed":
                self.notes["sent"] = drive.send("control", signal.SIGKILL)
            case "supervisor-killed":
                alive = "control" in drive.processes()
                self.notes["sent"] = alive and drive.send("host", signal.SIGKILL)
            case "audit-disk-full":
                drive.fill_disk("host", full=True)
                self._in(case.for_s, lambda: drive.fill_disk("host", full=False))
            case "planner-disk-full":
                drive.fill_disk("planner", full=True)
                self._in(case.for_s, lambda: drive.fill_disk("planner", full=False))
            case "profile-garbage":
                drive.spoil_profile(case.draw)
                self._in(case.for_s, drive.mend_profile)
            case _:
                pass  # it is in the server, or in the surroundings, already

    def calm(self) -> None:
        """End every fault that lasts."""
        for _, deed in self._later:
            deed()
        self._later = []

    # What it came to --------------------------------------------------------------------------------------------------

    @property
    def whole(self) -> bool:
        """Whether every report of the trip was heard."""
        return bool(self.heard) and [each.report.tick for each in self.heard] == list(range(len(self.heard)))

    @property
    def struck(self) -> bool:
        """Whether the fault really befell something."""
        if self.case.kind.family == "model":
            return self.fit and self.notes.get("hits", 0) > 0
        fit = self.fit or self.case.kind.cost == "fatal"
        return fit and self.struck_ns > 0 and bool(self.notes.get("sent", True))

    @property
    def answered(self) -> bool:
        """Whether every wish has its final answer."""
        return all(one.answers for one in self.asked)

    def row(
        self, start: Start, plans: set[str], period_s: float, later: list[HeardOutside], witness: Witness
    ) -> dict[str, Any]:
        """The case as JSON values.

        Args:
            start: Where the trip began.
            plans: Names of all plans that passed the checks.
            period_s: Control period by the clock.
            later: Reports of the trips after this one.
            witness: Who saw when the machine itself stood still.
        """
        case = self.case
        stalls = witness.stalls(self.heard[0].at_ns, self.heard[-1].at_ns)
        deeds = judge(self.heard, start, {"", *plans}, period_s, stalls)
        ignored = (FORGED,)  # whoever writes as the policy is followed as the policy is: within limits and shield
        unsafe = deeds.unsafe(ignored_plans=ignored)
        new = {one.name for one in self.asked if one.after_fault and one.name}
        back = recovery(self.heard, later, self.struck_ns, new)
        lost = [one.words for one in self.asked if not one.answers]
        left = [*self.notes.get("orphans", ())]
        if case.kind.name == "control-killed" and self.notes.get("memory_left"):
            left.append("shared memory")
        twice = [one.words for one in self.asked if len(one.answers) > 1]
        wrong = unsafe or lost or left or deeds.missed or deeds.faults
        return {
            "excerpt": [_brief(each, self.heard[0]) for each in self.heard] if wrong else [],
            "case": case.number,
            "kind": case.kind.name,
            "family": case.kind.family,
            "stage": case.stage,
            "at_stage": self.at_stage,
            "road": case.road,
            "scenario": case.scenario.id,
            "seed": case.seed,
            "ticks": len(self.heard),
            "unsafe": list(unsafe),
            "lost": lost,
            "left_behind": left,
            "answered_twice": twice,
            "wishes": [
                {"words": one.words, "after_fault": one.after_fault, "events": one.events} for one in self.asked
            ],
            "deeds": deeds.row(),
            "machine_stood_ms": max((round((one.to_ns - one.from_ns) / 1e6) for one in stalls), default=0),
            "stolen_ms": sum(one.stolen_ms for one in stalls),
            "witness": witness.able,
            "worst": back.worst,
            "to_follow_s": back.to_follow_s,
            "to_new_plan_s": back.to_new_plan_s,
            "replaced": self.replaced,
            "notes": self.notes,
        }


def _brief(heard: HeardOutside, first: HeardOutside) -> list[Any]:
    """A report in short: period, ms, lateness and missed periods, level, plan, speed, acceleration, steering, lane."""
    report = heard.report
    return [
        report.tick,
        round((heard.at_ns - first.at_ns) / 1e6, 1),
        round(report.late_ns / 1e6, 1),
        report.missed,
        report.level,
        report.plan,
        round(report.speed_mps, 2),
        report.requested.acceleration_mps2,
        report.applied.acceleration_mps2,
        report.applied.steering_rad,
        report.lane,
        [change.rule for change in report.interventions],
    ]
