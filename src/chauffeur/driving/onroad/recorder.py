"""The record of a session on a real vehicle: what was wished, planned, judged, asked of the vehicle and taken by it.

The records are those of any drive (`driving/session_recorder.py`), each with the number of its wish. `actuation` is
here what the vehicle is asked for: one record with `done` false before anything is published, and one with `done` true
for what became of it. The first record says whether there is a vehicle at the other end, or a dry run.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import Any

from chauffeur.concept import Parameters
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.onroad.answers import OnRoadAnswer, Opinion, SetpointRequest, SetpointResult
from chauffeur.driving.session_recorder import FLUSH_TIMEOUT_S, SessionRecorder
from chauffeur.safety.audit.keys import read_key
from chauffeur.safety.audit.writer import AuditLog, utc_now
from chauffeur.worlds.ros.base import RosVehicleState


def driven_what(interface: str, *, dry_run: bool) -> str:
    """What was at the other end, in words: nobody who reads a record takes one for the other."""
    if dry_run:
        return "a dry run: nothing was published to a vehicle"
    return f"a real vehicle over {interface}; nothing of it is simulated here"


def open_recorder(
    path: Path,
    vehicle_file: Path,
    interface: str,
    *,
    dry_run: bool,
    key_file: Path | None = None,
    private: bool = False,
    clock: Callable[[], datetime] = utc_now,
) -> VehicleRecorder:
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
    return VehicleRecorder(AuditLog(path, about=about, clock=clock, key=key, private=private))


class VehicleRecorder(SessionRecorder):
    """Writes one session into a log. Nothing raises into the session; `kept` alone waits."""

    @property
    def trouble(self) -> str:
        """What is wrong with the disk, in words; empty when nothing is."""
        return self.log.trouble

    def kept(self, within_s: float = FLUSH_TIMEOUT_S) -> bool:
        """Whether all of this is on the disk, after waiting for it for at most so long."""
        return self.log.flush(within_s)

    def tell(self, event: DriveEvent) -> None:
        """Hear what the session tells."""
        about: dict[str, Any] = {"wish": int(event.wish)} if event.wish else {}
        match event.value:
            case SetpointRequest() as asking:
                self.log.append("actuation", about | _asking(asking))
            case SetpointResult() as applied:
                self.log.append("actuation", about | _applied(applied))
            case OnRoadAnswer() as answer:
                body = {"outcome": answer.status, "took_s": round(answer.took_s, 6)}
                self.personal("outcome", event.wish, about | body, {"detail": answer.words, "trip": answer.trip})
            case Opinion(feedback=said) as opinion:
                self._people[event.wish] = opinion.person
                meant = {"speed": said.speed, "gap": said.gap, "comfort": said.comfort, "liked": said.approval}
                body = {"letter": "F", **meant, "kept": opinion.kept}
                self.personal("context", event.wish, about | body, {"feedback": said.text})
            case RosVehicleState() as state:
                link = {"link": state.link, "words": state.words[:500]} if event.kind == "link" else about
                self.log.append("context", {"event": event.kind, "receivers": state.receivers, **link})
            case _ if event.kind == "over":
                in_force = event.value.target_speed_mps if isinstance(event.value, Parameters) else None
                self.log.append("outcome", {"event": "over", "in_force_mps": in_force})
            case _:
                self.letter(event, about)


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
