"""A drive's entries in an audit log: listens to the loop's letters and writes what each stands for.

Everything that a person said, or that could quote them (wish, situation, history, reasoning, policy, reasons), is
handed over as a personal text, so that it can be erased or withheld; numbers and names of parts stay in the chain.
Actuations are written once a second, all commands of the second in one record.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self, cast

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
    SystemMessage,
    Trip,
    Verdict,
    Wishes,
)
from chauffeur.drive.recording import RecordedTrip
from chauffeur.drive.session import scenario_hash
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.redaction import PERSON
from chauffeur.safety.audit.writer import AuditLog, Closing, utc_now

BATCH_S: Final = 1.0
"""Seconds of a drive whose commands stand in one record."""

FLUSH_TIMEOUT_S: Final = 2.0
"""The longest the planning side waits, before the drive, for the disk to hold what led to it."""

_ROUNDING_S = 1e-6

_log = logging.getLogger(__name__)


def told_to(*listeners: Callable[[str, object], None]) -> Callable[[str, object], None]:
    """One listener that hands everything on to several, in this order."""

    def tell(letter: str, value: object) -> None:
        for listener in listeners:
            listener(letter, value)

    return tell


@dataclass(slots=True)
class _Batch:
    """Control periods not handed over yet, in columns."""

    first_tick: int
    first_s: float
    last_s: float
    requested: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    applied: list[tuple[int, float, float]] = field(default_factory=list[tuple[int, float, float]])
    speed_mps: list[float] = field(default_factory=list[float])
    wishes: list[tuple[int, dict[str, Any]]] = field(default_factory=list[tuple[int, dict[str, Any]]])
    program: list[tuple[int, str]] = field(default_factory=list[tuple[int, str]])
    said: list[str] = field(default_factory=list[str])


class Auditor:
    """Writes one drive, or several after one another, into a log; used from one thread.

    Nothing raises into the drive, and nothing but the letter `V` waits.
    """

    def __init__(self, log: AuditLog) -> None:
        self._log = log
        self._person: str = NOBODY
        self._open_wish = self._driven = False
        self._batch: _Batch | None = None
        self._wishes: Wishes | None = None
        self._program = ""
        self._interventions: dict[str, list[tuple[Any, ...]]] = {}
        self._intervened: dict[str, int] = {}
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
        if error is not None and self._open_wish:
            self.guarded("outcome", lambda: self._broken_off(error))
        self.close()

    def tell(self, letter: str, value: object) -> None:
        """One of the loop's letters (I, C, H, S, RP, V), a `frame`, or the `trip`; others are passed over.

        With `V`, just before the drive, it waits until all that led to the drive is on the disk, at most
        `FLUSH_TIMEOUT_S`; a disk that cannot is logged, and the drive goes on.
        """
        if letter == "frame" and isinstance(value, Frame):
            self.guarded("actuation", lambda: self._frame(value))
            return
        kind = {"I": "wish", "C": "context", "H": "context", "S": "context", "RP": "plan", "V": "verdict"}
        self.guarded(kind.get(letter, "outcome"), lambda: self._letter(letter, value))

    def period(
        self,
        tick: int,
        time_s: float,
        speed_mps: float,
        wishes: Wishes,
        requested: Command,
        applied: Command,
        program: str,
        interventions: Sequence[Intervention],
    ) -> None:
        """One control period of a drive that leaves no frames: in real time, control says what it did.

        Args:
            tick: Control period.
            time_s: Since the trip began.
            speed_mps: Of the ego, before the command.
            wishes: What was handed to the driver.
            requested: What the driver asked for.
            applied: What the vehicle did.
            program: State of the program.
            interventions: Of the shield.
        """
        self.guarded(
            "actuation",
            lambda: self._period(tick, time_s, speed_mps, wishes, requested, applied, program, (), interventions),
        )

    def intervene(self, tick: int, time_s: float, rule: str, reason: str, before: Command, after: Command) -> None:
        """The shield changed a command, told apart from frames, which bring their interventions with them.

        The first of a stretch is written at once, further ones once a second.

        Args:
            tick: Control period.
            time_s: Since the trip began.
            rule: Rule of the shield.
            reason: In the shield's words.
            before: What was asked for.
            after: What the shield let through.
        """
        self.guarded("intervention", lambda: self._intervention(tick, time_s, rule, reason, before, after))

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
            "wishes": batch.wishes,
            "program": batch.program,
        }
        if batch.said:
            self._personal("actuation", body, {"said": "\n".join(batch.said)})
        else:
            self._log.append("actuation", body)

    def close(self) -> Closing:
        """Write what is left, close the log, and say how it ended; a second call says the same."""
        if self._closing is None:
            self.guarded("actuation", self.hand_over)
            self._closing = self._log.close()
        return self._closing

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

    def _letter(self, letter: str, value: object) -> None:
        match value:
            case Instruction():
                self.hand_over()
                self._person, self._open_wish, self._driven = value.person, True, False
                self._wishes, self._program = None, ""
                self._intervened.clear()
                self._personal("wish", {"source": value.source}, {"wish": value.text})
            case Context():
                self._personal("context", *context_record(value))
            case History():
                self._personal("context", *history_record(value))
            case SystemMessage():
                digest = hashlib.sha256(value.text.encode("utf-8", "surrogatepass")).hexdigest()
                self._log.append("context", {"letter": "S", "setting": value.setting, "sha256": digest})
            case Plan():
                self._plan(value)
            case tuple() if letter == "V":
                for verdict in cast("tuple[object, ...]", value):
                    if isinstance(verdict, Verdict):
                        self._verdict(verdict)
                if not self._log.flush(FLUSH_TIMEOUT_S):
                    _log.warning("the audit log is not on the disk yet: %s", self._log.trouble or "it is too slow")
            case Trip():
                self._trip(value)
            case _:
                return

    def _plan(self, plan: Plan) -> None:
        self._personal("plan", *plan_record(plan))

    def _verdict(self, verdict: Verdict) -> None:
        body = {"check": verdict.check, "passed": verdict.passed, "vetoes": verdict.vetoes, "line": verdict.line}
        self._personal("verdict", body, {"reason": verdict.reason, "remedy": verdict.remedy})

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
        self._personal("outcome", body, {"detail": detail, "trip": trip.id})

    def _broken_off(self, error: BaseException) -> None:
        self.hand_over()
        self._open_wish = False
        body = {"outcome": "broken_off" if self._driven else "not_driven", "error": type(error).__name__}
        self._personal("outcome", body, {"detail": str(error)})

    def _frame(self, frame: Frame) -> None:
        shot = frame.snapshot
        self._driven = True
        self._period(
            shot.tick,
            shot.time_s,
            shot.ego.speed_mps,
            frame.wishes,
            frame.requested,
            frame.applied,
            frame.program,
            frame.said,
            frame.interventions,
        )

    def _period(
        self,
        tick: int,
        time_s: float,
        speed_mps: float,
        wishes: Wishes,
        asked: Command,
        done: Command,
        program: str,
        said: Sequence[str],
        interventions: Sequence[Intervention],
    ) -> None:
        batch = self._batch
        if batch is not None and (
            tick != batch.first_tick + len(batch.requested) or time_s - batch.first_s >= BATCH_S - _ROUNDING_S
        ):
            self.hand_over()
            batch = None
        if batch is None:
            batch = self._batch = _Batch(tick, time_s, time_s)
        if done != asked:
            batch.applied.append((len(batch.requested), done.acceleration_mps2, done.steering_rad))
        batch.requested.append((asked.acceleration_mps2, asked.steering_rad))
        batch.speed_mps.append(round(speed_mps, 3))
        if wishes is not self._wishes and wishes != self._wishes:
            self._wishes = wishes
            batch.wishes.append((tick, _wishes(wishes)))
        if program != self._program:
            self._program = program
            batch.program.append((tick, program))
        batch.said.extend(said)
        batch.last_s = time_s
        for change in interventions:
            self._intervention(tick, time_s, change.rule, change.reason, change.before, change.after)

    def _intervention(self, tick: int, time_s: float, rule: str, reason: str, before: Command, after: Command) -> None:
        row = (
            tick,
            time_s,
            reason,
            (before.acceleration_mps2, before.steering_rad),
            (after.acceleration_mps2, after.steering_rad),
        )
        rows = self._interventions.setdefault(rule, [])
        rows.append(row)
        goes_on = self._intervened.get(rule) in (tick - 1, tick)
        self._intervened[rule] = tick
        if not goes_on:
            self._hand_over_interventions(rule)

    def _hand_over_interventions(self, rule: str) -> None:
        if rows := self._interventions.pop(rule, []):
            self._log.append("intervention", {"rule": rule, "interventions": rows})

    def _personal(self, kind: Any, body: Mapping[str, Any], texts: Mapping[str, str]) -> None:
        self._log.append(kind, body, {PERSON: self._person} | {name: text for name, text in texts.items() if text})


def open_audit(
    path: Path,
    scenario: Scenario,
    seed: int,
    *,
    key_file: Path | None = None,
    private: bool = False,
    simulated: bool = True,
    clock: Callable[[], datetime] = utc_now,
) -> Auditor:
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
    return Auditor(AuditLog(path, about=about, clock=clock, key=key, private=private))


def with_head(recorded: RecordedTrip, closing: Closing) -> RecordedTrip:
    """The trip with the head of its audit log among its provenance: the recording then vouches for the log's length."""
    trip = recorded.trip
    return replace(recorded, trip=replace(trip, record=(*trip.record, ("audit_head", closing.head))))


def context_record(context: Context) -> tuple[dict[str, Any], dict[str, str]]:
    """What a log holds of C, as `plan_record`."""
    situation = json.dumps(asdict(context.situation), sort_keys=True)
    return {"letter": "C"}, {"context": context.text, "situation": situation}


def history_record(history: History) -> tuple[dict[str, Any], dict[str, str]]:
    """What a log holds of H, as `plan_record`."""
    # A trip's id is a hash that somebody who guesses the wish can compute: it counts as a text.
    return {"letter": "H", "items": len(history.items)}, {"trips": " ".join(item.trip_id for item in history.items)}


def plan_record(plan: Plan) -> tuple[dict[str, Any], dict[str, str]]:
    """What a log holds of a plan: numbers and names of parts, and the personal texts by name."""
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


def _wishes(wishes: Wishes) -> dict[str, Any]:
    return {
        "target_speed_mps": wishes.target_speed_mps,
        "time_headway_s": wishes.time_headway_s,
        "target_lane": wishes.target_lane,
        "turn": wishes.turn,
        "served_stops": sorted(wishes.served_stops),
    }
