"""The books of a session on a real vehicle: what was wished, planned, judged, asked of the vehicle and taken by it.

The records are those of any drive (`drive/auditing.py`), each with the number of its wish. `actuation` is here what the
vehicle is asked for: one record with `done` false before anything is published, and one with `done` true for what
became of it. The first record says whether there is a vehicle at the other end, or a dry run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from chauffeur.concept import NOBODY, Context, Feedback, History, Instruction, Parameters, Plan, SystemMessage, Verdict
from chauffeur.drive.auditing import FLUSH_TIMEOUT_S, context_record, history_record, plan_record
from chauffeur.drive.onroad.events import Answer
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.redaction import PERSON
from chauffeur.safety.audit.writer import AuditLog, Closing, utc_now
from chauffeur.worlds.ros.base import VehicleState


def driven_what(interface: str, *, dry_run: bool) -> str:
    """What was at the other end, in words: nobody who reads a record takes one for the other."""
    if dry_run:
        return "a dry run: nothing was published to a vehicle"
    return f"a real vehicle over {interface}; nothing of it is simulated here"


def open_books(
    path: Path,
    vehicle_file: Path,
    interface: str,
    *,
    dry_run: bool,
    key_file: Path | None = None,
    private: bool = False,
    clock: Callable[[], datetime] = utc_now,
) -> RoadBooks:
    """Begin, or go on with, the audit log of a vehicle.

    Args:
        path: The log.
        vehicle_file: The vehicle's configuration file; its hash stands in the log.
        interface: The way to it.
        dry_run: Whether nothing is published.
        key_file: Key that seals the records.
        private: Whether nothing of the person's words is kept.
        clock: Present time, with a time zone.

    Raises:
        DataError: The log cannot be written or continued.
        ConfigError: The key file cannot be used.
    """
    about = {
        "drive": driven_what(interface, dry_run=dry_run),
        "interface": interface,
        "dry_run": dry_run,
        "simulated": False,
        "vehicle_file": vehicle_file.name,
        "vehicle_sha256": hashlib.sha256(vehicle_file.read_bytes()).hexdigest(),
    }
    key = None if key_file is None else read_key(key_file)
    return RoadBooks(AuditLog(path, about=about, clock=clock, key=key, private=private))


class RoadBooks:
    """Writes one session into a log. Nothing raises into the session; `kept` alone waits."""

    def __init__(self, log: AuditLog) -> None:
        self._log = log
        self._people: dict[int, str] = {}
        self._closing: Closing | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def trouble(self) -> str:
        """What is wrong with the disk, in words; empty when nothing is."""
        return self._log.trouble

    def kept(self, within_s: float = FLUSH_TIMEOUT_S) -> bool:
        """Whether all of this is on the disk, after waiting for it for at most so long."""
        return self._log.flush(within_s)

    def wish(self, wish: int, instruction: Instruction) -> None:
        """I."""
        self._people[wish] = str(instruction.person)
        self._personal("wish", wish, {"source": instruction.source}, {"wish": instruction.text})

    def surroundings(self, wish: int, context: Context, history: History, system: SystemMessage) -> None:
        """C, H and S."""
        for body, texts in (context_record(context), history_record(history)):
            self._personal("context", wish, body, texts)
        digest = hashlib.sha256(system.text.encode("utf-8", "surrogatepass")).hexdigest()
        self._log.append("context", {"wish": wish, "letter": "S", "setting": system.setting, "sha256": digest})

    def plan(self, wish: int, plan: Plan) -> None:
        """R and P."""
        self._personal("plan", wish, *plan_record(plan))

    def verdicts(self, wish: int, verdicts: Sequence[Verdict]) -> None:
        """V."""
        for one in verdicts:
            body = {"check": one.check, "passed": one.passed, "vetoes": one.vetoes, "line": one.line}
            self._personal("verdict", wish, body, {"reason": one.reason, "remedy": one.remedy})

    def asking(self, wish: int, parameters: Parameters, before: Parameters | None, state: VehicleState) -> None:
        """What the vehicle is about to be asked for. Written before anything is published."""
        body: dict[str, Any] = {
            "wish": wish,
            "done": False,
            "parameters": asdict(parameters),
            "in_force": None if before is None else asdict(before),
            "link": state.link,
            "speed_mps": state.speed_mps,
        }
        self._log.append("actuation", body)

    def asked(self, wish: int, answer: Answer, state: VehicleState) -> None:
        """What became of it."""
        published = answer.published
        body = {
            "wish": wish,
            "done": True,
            "status": answer.status,
            "confirmed_s": answer.confirmed_s,
            "link": state.link,
            "receivers": state.receivers,
            "number": None if published is None else published.number,
            "messages": [] if published is None else [{"topic": m.topic, **m.fields} for m in published.messages],
        }
        self._log.append("actuation", body)

    def answer(self, answer: Answer) -> None:
        """How a wish ended."""
        body = {"outcome": answer.status, "took_s": round(answer.took_s, 6)}
        self._personal("outcome", answer.wish, body, {"detail": answer.words, "trip": answer.trip})

    def feedback(self, wish: int, person: str, feedback: Feedback, *, kept: bool) -> None:
        """F."""
        self._people[wish] = person
        meant = {"speed": feedback.speed, "gap": feedback.gap, "comfort": feedback.comfort, "liked": feedback.approval}
        self._personal("context", wish, {"letter": "F", **meant, "kept": kept}, {"feedback": feedback.text})

    def happened(self, event: str, body: Mapping[str, Any]) -> None:
        """Something that belongs to no wish: the way to the vehicle, the end of the session."""
        self._log.append("outcome" if event == "over" else "context", {"event": event, **body})

    def close(self) -> Closing:
        """Close the log, and say how it ended; a second call says the same."""
        if self._closing is None:
            self._closing = self._log.close()
        return self._closing

    def _personal(self, kind: Any, wish: int, body: Mapping[str, Any], texts: Mapping[str, str]) -> None:
        person = self._people.get(wish, str(NOBODY))
        said = {name: text for name, text in texts.items() if text}
        self._log.append(kind, {"wish": wish, **body}, {PERSON: person} | said)
