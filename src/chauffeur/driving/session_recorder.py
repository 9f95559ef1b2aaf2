"""A drive's entries in an audit log: hears what is told of the drive and writes down what it stands for.

Everything that a person said, or that could quote them (wish, situation, history, reasoning, policy, reasons), is
handed over as a personal text, so that it can be erased or withheld; numbers and names of parts stay in the chain.
Actuations are written once a second, all commands of the second in one record.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
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
    Plan,
    Policy,
    Program,
    Scenario,
    Setpoints,
    SystemMessage,
    Trip,
    Verdict,
)
from chauffeur.driving.events import DriveEvent, EventKind
from chauffeur.driving.recording import RecordedTrip
from chauffeur.driving.trips import scenario_hash
from chauffeur.safety.audit.entries import Kind
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.redaction import PERSON
from chauffeur.safety.audit.writer import AuditLog, Closing, utc_now

BATCH_S: Final = 1.0
"""Seconds of a drive whose commands stand in one record."""

FLUSH_TIMEOUT_S: Final = 2.0
"""The longest the planning side waits, before the drive, for the disk to hold what led to it."""

_ROUNDING_S = 1e-6

_GUARDED: Final[dict[EventKind, Kind]] = {
    "wish": "wish", "context": "context", "history": "context", "system": "context", "plan": "plan",
    "verdicts": "verdict", "period": "actuation",
}  # fmt: skip
"""Kind of record that is lost where one of an event cannot be made."""

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


class SessionRecorder:
    """Writes what is told of drives into a log; used from one thread. What every kind of drive tells stands here."""

    def __init__(self, log: AuditLog) -> None:
        self._log = log
        self._people: dict[str, str] = {}
        self._closing: Closing | None = None

    @property
    def log(self) -> AuditLog:
        """Where it writes."""
        return self._log

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def letter(self, event: DriveEvent, about: Mapping[str, Any]) -> None:
        """Write down one of the loop's letters, with what else its records say; other events are passed over."""
        if isinstance(event.value, Instruction):
            self._people[event.wish] = str(event.value.person)
        for kind, body, texts in _records(event):
            if texts is None:
                self._log.append(kind, {**about, **body})
            else:
                self.personal(kind, event.wish, {**about, **body}, texts)

    def personal(self, kind: Kind, wish: str, body: Mapping[str, Any], texts: Mapping[str, str]) -> None:
        """A record with texts of, or about, the person who made a wish."""
        person = self._people.get(wish, str(NOBODY))
        self._log.append(kind, body, {PERSON: person} | {name: text for name, text in texts.items() if text})

    def close(self) -> Closing:
        """Close the log, and say how it ended; a second call says the same."""
        if self._closing is None:
            self._closing = self._log.close()
        return self._closing


class DriveRecorder(SessionRecorder):
    """Writes one drive in simulated time, or several after one another, into a log.

    Nothing raises into the drive, and nothing but the verdicts waits.
    """

    def __init__(self, log: AuditLog) -> None:
        super().__init__(log)
        self._open_wish = self._driven = False
        self._batch: _Batch | None = None
        self._setpoints: Setpoints | None = None
        self._program = ""
        self._interventions: dict[str, list[tuple[Any, ...]]] = {}
        self._intervened: dict[str, int] = {}

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and self._open_wish:
            self.guarded("outcome", lambda: self._broken_off(error))
        self.close()

    def tell(self, event: DriveEvent) -> None:
        """Hear what the drive tells.

        With the verdicts, just before the drive, it waits until all that led to the drive is on the disk, at most
        `FLUSH_TIMEOUT_S`; a disk that cannot is logged, and the drive goes on.
        """
        self.guarded(_GUARDED.get(event.kind, "outcome"), lambda: self._hear(event))

    def hand_over(self) -> None:
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
            self.personal("actuation", "", body, {"said": "\n".join(batch.said)})
        else:
            self._log.append("actuation", body)

    def close(self) -> Closing:
        """Write what is left, close the log, and say how it ended; a second call says the same."""
        if self._closing is None:
            self.guarded("actuation", self.hand_over)
        return super().close()

    def guarded(self, kind: str, write: Callable[[], None]) -> None:
        """Make a record; nothing that goes wrong with it raises.

        A value of an unexpected kind (planners are third-party code) leaves a gap, and the drive alone.
        """
        try:
            write()
        except Exception as error:  # noqa: BLE001 - an audit log must not take a drive down
            _log.exception("a record (%s) could not be made", kind)
            self._log.append(
                "gap", {"lost": {kind: 1}, "why": f"the record could not be made ({type(error).__name__})"}
            )

    def _hear(self, event: DriveEvent) -> None:
        match event.value:
            case Frame(observation=shot) as frame:
                self._driven = True
                self.period(
                    shot.tick, shot.time_s, shot.ego.speed_mps, frame.setpoints, frame.requested, frame.applied,
                    frame.program, frame.interventions, frame.said,
                )  # fmt: skip
                return
            case Trip():
                self._trip(event.value)
                return
            case Instruction():
                self.hand_over()
                self._open_wish, self._driven = True, False
                self._setpoints, self._program = None, ""
                self._intervened.clear()
            case _:
                pass
        self.letter(event, {})
        if event.kind == "verdicts" and not self._log.flush(FLUSH_TIMEOUT_S):
            _log.warning("the audit log is not on the disk yet: %s", self._log.trouble or "it is too slow")

    def _trip(self, trip: Trip) -> None:
        self.hand_over()
        causes = asdict(trip.causes)
        detail = str(causes.pop("detail"))
        body: dict[str, Any] = {
            "outcome": trip.outcome,
            "causes": [name for name, holds in causes.items() if holds],
            "duration_s": trip.duration_s,
            "metrics": [asdict(metric) for metric in trip.metrics],
            "scenario": trip.scenario,
            "seed": trip.seed,
        }
        self._open_wish = False
        self.personal("outcome", "", body, {"detail": detail, "trip": trip.id})

    def _broken_off(self, error: BaseException) -> None:
        self.hand_over()
        self._open_wish = False
        body = {"outcome": "broken_off" if self._driven else "not_driven", "error": type(error).__name__}
        self.personal("outcome", "", body, {"detail": str(error)})

    def period(
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
            self.hand_over()
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
            self._log.append("intervention", {"rule": rule, "interventions": rows})


def open_audit(
    path: Path,
    scenario: Scenario,
    seed: int,
    *,
    key_file: Path | None = None,
    private: bool = False,
    simulated: bool = True,
    clock: Callable[[], datetime] = utc_now,
) -> DriveRecorder:
    """Begin, or go on with, the audit log of drives on a scenario.

    Args:
        path: The log.
        scenario: The start situation.
        seed: Seed of the drive.
        key_file: Key that seals the records.
        private: Whether nothing of the person's words is kept.
        simulated: Whether the world is simulated; the log says so.
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
        "simulated": simulated,
    }
    key = None if key_file is None else read_key(key_file)
    return DriveRecorder(AuditLog(path, about=about, clock=clock, key=key, private=private))


def with_head(recorded: RecordedTrip, closing: Closing) -> RecordedTrip:
    """The trip with the head of its audit log among its provenance: the recording then vouches for the log's length."""
    trip = recorded.trip
    return replace(recorded, trip=replace(trip, record=(*trip.record, ("audit_head", closing.head))))


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
