"""A drive's entries in an audit log: hears what is told of any drive, and writes down what it stands for.

Everything that a person said, or that could quote them (wish, situation, history, reasoning, policy, reasons), is
handed over as a personal text, so that it can be erased or withheld; numbers and names of parts stay in the chain.
Commands are written once a second, all of the second in one record. Every `outcome` of a wish has its `result`, one of
`concept.Result`, beside what the drive calls it.

Of a drive in real time, each record has the id of its wish, and `context` with an `event` is what happened in between.
Of a vehicle, `actuation` is what it is asked for: with `done` false before anything is published, and with `done` true
for what became of it. Nothing raises into the drive. What has to be on the disk first is waited for with `kept`; a
drive in simulated time waits by itself, before it begins. A session that was killed leaves its open wishes behind;
`unanswered` finds them.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from chauffeur.concept import (
    NOBODY,
    Command,
    Context,
    Frame,
    History,
    Instruction,
    Intervention,
    Parameters,
    Plan,
    Policy,
    Program,
    Scenario,
    Setpoints,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.concept.results import Result, result_of
from chauffeur.driving.episode import make_world
from chauffeur.driving.events import DriveEvent, EventKind
from chauffeur.driving.live.messages import FallbackLevel, LiveEnd, Report
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.onroad.answers import OnRoadAnswer, Opinion, SetpointRequest, SetpointResult
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.trips import scenario_hash
from chauffeur.safety.audit.entries import Kind
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.reader import read_records
from chauffeur.safety.audit.redaction import PERSON
from chauffeur.safety.audit.texts import words_of
from chauffeur.safety.audit.writer import AuditLog, Closing, utc_now
from chauffeur.worlds.ros.base import RosVehicleState

BATCH_S: Final = 1.0
"""Seconds of a drive whose commands stand in one record."""

FLUSH_TIMEOUT_S: Final = 2.0
"""The longest the planning side waits for the disk to hold what led to a drive."""

_ROUNDING_S = 1e-6

_GUARDED: Final[dict[EventKind, Kind]] = {
    "wish": "wish", "context": "context", "history": "context", "system": "context", "plan": "plan",
    "verdicts": "verdict", "period": "actuation",
}  # fmt: skip
"""Kind of record that is lost where one of an event cannot be made."""
_DRIVEN: Final[frozenset[FallbackLevel]] = frozenset({"follow", "hold"})
"""Between these the level goes up and down without anything being let go of."""
_WRITTEN_ELSEWHERE: Final[frozenset[EventKind]] = frozenset({"planned", "declined", "answered"})
"""They say what the plan says, which has been written down."""

_log = logging.getLogger(__name__)


@dataclass(slots=True)
class _Batch:
    """Control periods not handed over yet, in columns."""

    first_tick: int
    first_s: float
    last_s: float
    requested: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    applied: list[tuple[int, float, float]] = field(default_factory=list[tuple[int, float, float]])
    speed_mps: list[float] = field(default_factory=list[float])
    setpoints: list[tuple[int, dict[str, Any]]] = field(default_factory=list[tuple[int, dict[str, Any]]])
    program: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])
    said: list[str] = field(default_factory=list[str])


class DriveRecorder:
    """Writes what is told of drives, one or several after one another, into a log; used from one thread."""

    def __init__(self, log: AuditLog, dt_s: float = 0.0) -> None:
        """Nothing is written yet.

        Args:
            log: Where it writes.
            dt_s: Control period of a drive in real time, in vehicle time.
        """
        self.log, self._dt_s = log, dt_s
        self._disk = ThreadPoolExecutor(1, "audit flush")
        self._people: dict[str, str] = {}
        self._closing: Closing | None = None
        self._open_wish = self._driven = False
        self._batch: _Batch | None = None
        self._setpoints: Setpoints | None = None
        self._program = ""
        self._interventions: dict[str, list[tuple[Any, ...]]] = {}
        self._intervened: dict[str, int] = {}
        self._live = _Live()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and self._open_wish:
            self._guarded("outcome", lambda: self._broken_off(error))
        elif error is not None and self._live.open:
            self._guarded("outcome", lambda: self._over("broken_off", {"error": type(error).__name__}))
        self.close()

    def tell(self, event: DriveEvent) -> None:
        """Hear what a drive tells.

        With the verdicts of a drive in simulated time, just before it, it waits until all that led to the drive is on
        the disk, at most `FLUSH_TIMEOUT_S`; a disk that cannot is logged, and the drive goes on.
        """
        self._guarded(_GUARDED.get(event.kind, "outcome"), lambda: self._hear(event))

    def kept(self, within_s: float = FLUSH_TIMEOUT_S) -> Future[bool]:
        """Whether all of this is on the disk, as soon as that is known: at most so long later."""
        return self._disk.submit(self.log.flush, within_s)

    def close(self) -> Closing:
        """Write what is left, close the log, and say how it ended; a second call says the same."""
        if self._closing is None:
            self._disk.shutdown()
            self._guarded("actuation", self._hand_over)
            self._closing = self.log.close()
        return self._closing

    # What is told -----------------------------------------------------------------------------------------------------

    def _hear(self, event: DriveEvent) -> None:
        match event.value:
            case Frame(observation=shot) as frame:
                self._driven = True
                self._period(
                    shot.tick, shot.time_s, shot.ego.speed_mps, frame.setpoints, frame.requested, frame.applied,
                    frame.program, frame.interventions, frame.said,
                )  # fmt: skip
            case Report() as report:
                self._report(report)
            case Trip() as trip:
                self._trip(trip)
            case Settings() as settings:
                self._begun(settings)
            case LiveEnd() as end:
                self._over(end.outcome, {"control": dict(end.figures), "lost_reports": end.lost_reports})
            case int() as lost:
                self.log.append("gap", {"lost": {"plan": lost}, "why": event.text})
            case SetpointRequest() as asking:
                self.log.append("actuation", _about(event) | _asking(asking))
            case SetpointResult() as applied:
                self.log.append("actuation", _about(event) | _applied(applied))
            case OnRoadAnswer() as answer:
                self._answer(event, answer)
            case Opinion() as opinion:
                self._opinion(event, opinion)
            case RosVehicleState() as state:
                link = {"link": state.link, "words": state.words[:500]} if event.kind == "link" else _about(event)
                self._note(event.kind, {"receivers": state.receivers, **link})
            case str() as process:
                self._note("replaced", {"process": process, "why": event.text})
            case Parameters() | None if event.kind == "over":
                in_force = None if event.value is None else event.value.target_speed_mps
                self.log.append("outcome", {"event": "over", "in_force_mps": in_force})
            case None if event.kind != "trouble":
                self._became(event)
            case _:
                self._letter(event)

    def _letter(self, event: DriveEvent) -> None:
        """One of the loop's letters: other values stand for nothing that is written down."""
        about = _about(event)
        if isinstance(event.value, Instruction):
            self._people[event.wish] = str(event.value.person)
            if not event.wish:
                self._hand_over()
                self._open_wish, self._driven = True, False
                self._setpoints, self._program = None, ""
                self._intervened.clear()
        elif event.trip:
            about["tick"] = event.tick
        for kind, body, texts in _records(event):
            if texts is None:
                self.log.append(kind, about | body)
            else:
                self._personal(kind, event.wish, about | body, texts)
        if event.kind == "verdicts" and not event.wish and not self.log.flush(FLUSH_TIMEOUT_S):
            _log.warning("the audit log is not on the disk yet: %s", self.log.trouble or "it is too slow")

    def _became(self, event: DriveEvent) -> None:
        """What became of a wish in real time, or of one that was never asked."""
        at = {"wish": event.wish, "tick": self._live.tick}
        if not event.final and event.kind not in _WRITTEN_ELSEWHERE:
            self._personal("context", event.wish, at | {"event": event.kind}, {"text": event.text})
        if event.final:
            self._open_wish = self._open_wish and bool(event.wish)
            self._personal(
                "outcome", event.wish, at | {"outcome": event.kind, "result": event.result}, {"detail": event.text}
            )

    def _trip(self, trip: Trip) -> None:
        self._hand_over()
        causes = asdict(trip.causes)
        detail = str(causes.pop("detail"))
        body: dict[str, Any] = {
            "outcome": trip.outcome,
            "result": result_of(trip),
            "causes": [name for name, holds in causes.items() if holds],
            "duration_s": trip.duration_s,
            "metrics": [asdict(metric) for metric in trip.metrics],
            "scenario": trip.scenario,
            "seed": trip.seed,
        }
        self._open_wish = False
        self._personal("outcome", "", body, {"detail": detail, "trip": trip.id})

    def _broken_off(self, error: BaseException) -> None:
        self._hand_over()
        self._open_wish = False
        outcome = "broken_off" if self._driven else "not_driven"
        body = {"outcome": outcome, "result": Result.FAILED, "error": type(error).__name__}
        self._personal("outcome", "", body, {"detail": str(error)})

    # A drive in real time ---------------------------------------------------------------------------------------------

    def _begun(self, settings: Settings) -> None:
        about = {name: value for name, value in asdict(settings).items() if name not in ("starts", "base_url")}
        starts = [{"limits": asdict(start.limits), "most_s": start.most_s} for start in settings.starts]
        self._live.open = True
        self._note("settings", {**about, "starts": starts})

    def _report(self, report: Report) -> None:
        live = self._live
        live.open = not live.over
        if live.tick >= 0 and report.tick > live.tick + 1:
            lost = report.tick - live.tick - 1
            self.log.append("gap", {"lost": {"period": lost}, "why": "reports of control were not heard"})
        live.tick = report.tick
        live.levels[report.level] += 1
        self._period(
            report.tick, report.tick * self._dt_s, report.speed_mps, report.setpoints, report.requested, report.applied,
            report.state, report.interventions,
        )  # fmt: skip
        if report.taken_over != live.taken_over:
            live.taken_over = report.taken_over
            live.takeovers += report.taken_over
            self._note("taken_over", {"on": report.taken_over, "tick": report.tick, "speed_mps": report.speed_mps})
        before, live.level = live.level, report.level
        if before != report.level and not {before, report.level} <= _DRIVEN:
            self._note(
                "level", {"wish": report.plan, "level": report.level, "age_s": report.age_s, "tick": report.tick}
            )

    def _over(self, outcome: str, body: Mapping[str, Any]) -> None:
        live = self._live
        if live.over:
            return
        live.over, live.open = True, False
        self._hand_over()
        self.log.append(
            "outcome",
            {
                "outcome": outcome,
                "duration_s": round((live.tick + 1) * self._dt_s, 6),
                "periods_by_rung": dict(live.levels),
                "takeovers": live.takeovers,
                **body,
            },
        )

    # A vehicle --------------------------------------------------------------------------------------------------------

    def _answer(self, event: DriveEvent, answer: OnRoadAnswer) -> None:
        body = {"outcome": answer.status, "result": answer.result, "took_s": round(answer.took_s, 6)}
        self._personal("outcome", event.wish, _about(event) | body, {"detail": answer.words, "trip": answer.trip})

    def _opinion(self, event: DriveEvent, opinion: Opinion) -> None:
        said = opinion.feedback
        self._people[event.wish] = opinion.person
        meant = {"speed": said.speed, "gap": said.gap, "comfort": said.comfort, "liked": said.approval}
        body = {"letter": "F", **meant, "kept": opinion.kept}
        self._personal("context", event.wish, _about(event) | body, {"feedback": said.text})

    # Writing ----------------------------------------------------------------------------------------------------------

    def _note(self, event: str, body: Mapping[str, Any]) -> None:
        self.log.append("context", {"event": event, **body})

    def _personal(self, kind: Kind, wish: str, body: Mapping[str, Any], texts: Mapping[str, str]) -> None:
        """A record with texts of, or about, the person who made a wish."""
        person = self._people.get(wish, str(NOBODY))
        self.log.append(kind, body, {PERSON: person} | {name: text for name, text in texts.items() if text})

    def _guarded(self, kind: str, write: Callable[[], None]) -> None:
        """Make a record; nothing that goes wrong with it raises.

        A value of an unexpected kind (planners are third-party code) leaves a gap, and the drive alone.
        """
        try:
            write()
        except Exception as error:  # noqa: BLE001 - an audit log must not take a drive down
            _log.exception("a record (%s) could not be made", kind)
            self.log.append("gap", {"lost": {kind: 1}, "why": f"the record could not be made ({type(error).__name__})"})

    def _hand_over(self) -> None:
        """Hand over the commands and interventions collected so far."""
        for rule in list(self._interventions):
            self._hand_over_interventions(rule)
        batch, self._batch = self._batch, None
        if batch is None:
            return
        body: dict[str, Any] = {
            "ticks": (batch.first_tick, batch.first_tick + len(batch.requested) - 1),
            "time_s": (batch.first_s, batch.last_s),
            "requested": batch.requested,
            "applied_otherwise": batch.applied,
            "speed_mps": batch.speed_mps,
            "wishes": batch.setpoints,
            "program": batch.program,
        }
        if batch.said:
            self._personal("actuation", "", body, {"said": "\n".join(batch.said)})
        else:
            self.log.append("actuation", body)

    def _period(
        self,
        tick: int,
        time_s: float,
        speed_mps: float,
        setpoints: Setpoints,
        requested: Command,
        applied: Command,
        program: str,
        interventions: Sequence[Intervention],
        said: Sequence[str] = (),
    ) -> None:
        """Record one control period.

        Args:
            tick: Control period.
            time_s: Since the trip began.
            speed_mps: Of the ego, before the command.
            setpoints: Handed to the driver.
            requested: Command that the driver asked for.
            applied: Command that the vehicle carried out.
            program: State of the program.
            interventions: Of the shield.
            said: By the program.
        """
        batch = self._batch
        if batch is not None and (
            tick != batch.first_tick + len(batch.requested) or time_s - batch.first_s >= BATCH_S - _ROUNDING_S
        ):
            self._hand_over()
            batch = None
        if batch is None:
            batch = self._batch = _Batch(tick, time_s, time_s)
        if applied != requested:
            batch.applied.append((len(batch.requested), applied.acceleration_mps2, applied.steering_rad))
        batch.requested.append((requested.acceleration_mps2, requested.steering_rad))
        batch.speed_mps.append(round(speed_mps, 3))
        if setpoints is not self._setpoints and setpoints != self._setpoints:
            self._setpoints = setpoints
            batch.setpoints.append((tick, _setpoints(setpoints)))
        if program != self._program:
            self._program = program
            batch.program.append((tick, program))
        batch.said.extend(said)
        batch.last_s = time_s
        for change in interventions:
            self._intervention(tick, time_s, change)

    def _intervention(self, tick: int, time_s: float, change: Intervention) -> None:
        rule, before, after = change.rule, change.before, change.after
        commands = [(one.acceleration_mps2, one.steering_rad) for one in (before, after)]
        self._interventions.setdefault(rule, []).append((tick, time_s, change.reason, *commands))
        goes_on = self._intervened.get(rule) in (tick - 1, tick)
        self._intervened[rule] = tick
        if not goes_on:
            self._hand_over_interventions(rule)

    def _hand_over_interventions(self, rule: str) -> None:
        if rows := self._interventions.pop(rule, []):
            self.log.append("intervention", {"rule": rule, "interventions": rows})


@dataclass(slots=True)
class _Live:
    """A drive in real time, as far as it was told."""

    open: bool = False
    over: bool = False
    tick: int = -1
    level: FallbackLevel = "follow"
    levels: Counter[FallbackLevel] = field(default_factory=Counter[FallbackLevel])
    taken_over: bool = False
    takeovers: int = 0


def open_audit(
    path: Path,
    scenario: Scenario,
    seed: int,
    *,
    key_file: Path | None = None,
    private: bool = False,
    clock: Callable[[], datetime] = utc_now,
) -> DriveRecorder:
    """Begin, or go on with, the audit log of simulated drives on a scenario.

    Args:
        path: The log.
        scenario: The start situation.
        seed: Seed of the drive.
        key_file: Key that seals the records.
        private: Whether nothing of the person's words is kept.
        clock: Present time, with a time zone.

    Raises:
        DataError: The log cannot be written or continued.
        ConfigError: The key file cannot be used.
    """
    about = {
        "world": scenario.world,
        "scenario": scenario.id,
        "scenario_sha256": scenario_hash(scenario),
        "seed": seed,
        "simulated": True,
    }
    log = AuditLog(path, about=about, clock=clock, key=_key(key_file), private=private)
    return DriveRecorder(log, make_world(scenario).dt_s)


def open_vehicle_audit(
    path: Path,
    vehicle_file: Path,
    interface: str,
    *,
    dry_run: bool,
    key_file: Path | None = None,
    private: bool = False,
) -> DriveRecorder:
    """Begin, or go on with, the audit log of a vehicle; it says whether one is at the other end, or a dry run.

    Args:
        path: The log.
        vehicle_file: The vehicle's configuration file; its hash stands in the log.
        interface: The way to it.
        dry_run: Whether nothing is published.
        key_file, private: As of `open_audit`, and so are the errors.
    """
    real = f"a real vehicle over {interface}; nothing of it is simulated here"
    about = {
        "drive": "a dry run: nothing was published to a vehicle" if dry_run else real,
        "interface": interface,
        "dry_run": dry_run,
        "simulated": False,
        "vehicle_file": vehicle_file.name,
        "vehicle_sha256": hashlib.sha256(vehicle_file.read_bytes()).hexdigest(),
    }
    return DriveRecorder(AuditLog(path, about=about, key=_key(key_file), private=private))


def _key(file: Path | None) -> bytes | None:
    return None if file is None else read_key(file)


@dataclass(frozen=True, slots=True)
class Unanswered:
    """A wish of a session that ended before it was answered.

    Attributes:
        wish: Its id there.
        text: The words, or in brackets why they are not kept.
        person: Who said it.
    """

    wish: str
    text: str
    person: str


def unanswered(path: Path) -> tuple[Unanswered, ...]:
    """Wishes of the last session in a log to which nothing was answered, oldest first; none where there is no log.

    Raises:
        DataError: The log cannot be read.
    """
    waiting: dict[str, Unanswered] = {}
    if not path.is_file():
        return ()
    for _, record in read_records(path):
        wish = str(record.body.get("wish", ""))
        match record.kind:
            case "opened":
                waiting.clear()
            case "wish":
                words = words_of(record)
                waiting[wish] = Unanswered(wish, words.get("wish", ""), words.get(PERSON, ""))
            case "outcome":
                waiting.pop(wish, None)
            case _:
                pass
    return tuple(waiting.values())


def with_head(recorded: RecordedTrip, closing: Closing) -> RecordedTrip:
    """The trip with the head of its audit log among its provenance: the recording then vouches for the log's length."""
    trip = recorded.trip
    return replace(recorded, trip=replace(trip, record=(*trip.record, ("audit_head", closing.head))))


def _about(event: DriveEvent) -> dict[str, Any]:
    """Number of a wish for a vehicle, id of one in real time; nothing where a drive has but one."""
    return {"wish": int(event.wish) if event.wish.isdecimal() else event.wish} if event.wish else {}


def _asking(asked: SetpointRequest) -> dict[str, Any]:
    before, state = asked.in_force, asked.state
    return {
        "done": False,
        "parameters": asdict(asked.parameters),
        "in_force": None if before is None else asdict(before),
        "link": state.link,
        "speed_mps": state.speed_mps,
    }


def _applied(applied: SetpointResult) -> dict[str, Any]:
    answer, state, published = applied.answer, applied.state, applied.answer.published
    return {
        "done": True,
        "status": answer.status,
        "confirmed_s": answer.confirmed_s,
        "link": state.link,
        "receivers": state.receivers,
        "number": None if published is None else published.number,
        "messages": [] if published is None else [{"topic": m.topic, **m.fields} for m in published.messages],
    }


def _records(event: DriveEvent) -> Iterator[tuple[Kind, dict[str, Any], dict[str, str] | None]]:
    """What a log holds of a letter: numbers and names of parts, and the personal texts by name (None: no such)."""
    match event.value:
        case Instruction() as said:
            yield "wish", {"source": said.source}, {"wish": said.text}
        case Context() as context:
            situation = json.dumps(asdict(context.situation), sort_keys=True)
            yield "context", {"letter": "C"}, {"context": context.text, "situation": situation}
        case History() as history:
            # A trip's id is a hash that somebody who guesses the wish can compute: it counts as a text.
            trips = " ".join(item.trip_id for item in history.items)
            yield "context", {"letter": "H", "items": len(history.items)}, {"trips": trips}
        case SystemMessage() as system:
            digest = hashlib.sha256(system.text.encode("utf-8", "surrogatepass")).hexdigest()
            yield "context", {"letter": "S", "setting": system.setting, "sha256": digest}, None
        case Plan() as plan:
            yield "plan", *_plan_record(plan)
        case tuple() as several:
            for verdict in several:
                if isinstance(verdict, Verdict):
                    body = {"check": verdict.check, "passed": verdict.passed, "vetoes": verdict.vetoes}
                    texts = {"reason": verdict.reason, "remedy": verdict.remedy}
                    yield "verdict", {**body, "line": verdict.line}, texts
        case _:
            pass


def _plan_record(plan: Plan) -> tuple[dict[str, Any], dict[str, str]]:
    policy = plan.policy
    body = {
        "planner": plan.planner,
        "model": plan.model,
        "policy": None if policy is None else policy.kind,
        "refused": bool(plan.refusal),
        "latency_s": plan.latency_s,
        "usage": asdict(plan.usage),
    }
    settings = ", ".join(f"{name}={value!r}" for name, value in plan.settings)
    texts = {
        "thoughts": plan.thoughts.text,
        "refusal": plan.refusal,
        "intent": plan.intent,
        "settings": settings,
        "reply": plan.raw,
        **_policy_texts(policy),
    }
    return body, texts


def _policy_texts(policy: Policy | None) -> dict[str, str]:
    if policy is None:
        return {}
    if isinstance(policy, Program):
        return {"program": policy.source, "library": policy.library}
    return {"policy": json.dumps(asdict(policy), sort_keys=True)}


def _setpoints(setpoints: Setpoints) -> dict[str, Any]:
    return {
        "target_speed_mps": setpoints.target_speed_mps,
        "time_headway_s": setpoints.time_headway_s,
        "target_lane": setpoints.target_lane,
        "turn": setpoints.turn,
        "served_stops": sorted(setpoints.served_stops),
    }
