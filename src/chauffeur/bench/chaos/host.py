"""The process a drive is started from: the supervisor, an audit log beside it, wishes as lines on its standard input.

`python -m chauffeur.bench.chaos.host SETTINGS_FOLDER AUDIT_LOG`. It says what it hears as JSON lines. A wish is in the
audit log, on the disk where that can be had within a moment, before the planner hears of it.
"""

from __future__ import annotations

import json
import logging
import os
import select
import sys
import time
from collections.abc import Iterator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, get_args

from chauffeur.concept import ConfigError, PersonId
from chauffeur.drive.events import DriveEvent
from chauffeur.drive.live.recorder import LiveRecorder
from chauffeur.drive.live.settings import Settings
from chauffeur.drive.live.supervisor import Role, Runtime
from chauffeur.drive.session import parse_wish
from chauffeur.drive.session_recorder import open_audit

KEPT_WITHIN_S: Final = 0.5
"""The longest a wish waits for the disk before it goes to the planner all the same."""
_POLL_S: Final = 0.01
_DT_S: Final = 0.1


class Host:
    """One drive."""

    def __init__(self, settings: Settings, books: LiveRecorder) -> None:
        self._settings, self._books = settings, books
        self._runtime: Runtime | None = None
        self._left = b""
        self._open = True
        self._waiting: list[tuple[dict[str, Any], Future[bool], float]] = []
        self._processes: dict[str, int] = {}

    def run(self) -> None:
        """Drive until control ends or the input does."""
        with Runtime(self._settings, self._hear) as runtime:
            self._runtime = runtime
            self._books.follow(runtime, self._settings)
            _say({"ready": str(runtime.folder)})
            while self._open and runtime.driving:
                self._name(runtime)
                for asked in self._asked():
                    self._write_down(runtime, asked)
                self._hand_on(runtime)
                runtime.poll()
                time.sleep(_POLL_S)
            runtime.poll()
            _say({"over": True})
        _say({"closed": True})

    def _write_down(self, runtime: Runtime, asked: dict[str, Any]) -> None:
        """A wish is in the books before the planner hears of it; a disk that cannot does not keep it for ever."""
        number = int(runtime.next_wish[1:]) + len(self._waiting)
        self._books.wish(f"w{number}", parse_wish(asked["ask"], PersonId(asked["person"])))
        self._waiting.append((asked, self._books.kept(), time.monotonic() + KEPT_WITHIN_S))

    def _hand_on(self, runtime: Runtime) -> None:
        while self._waiting:
            asked, kept, until_s = self._waiting[0]
            with suppress(FutureTimeoutError):
                kept.result(0.0)
            if not kept.done() and time.monotonic() < until_s:
                return
            del self._waiting[0]
            _say({"asked": runtime.ask(asked["ask"], asked["person"]), "of": asked["of"]})

    def _hear(self, event: DriveEvent) -> None:
        self._books.tell(event)
        if event.kind == "replaced":
            _say({"replaced": event.value, "why": event.text})
        elif event.value is None:
            _say({"event": {"kind": event.kind, "wish": event.wish, "text": event.text}, "final": event.final})

    def _name(self, runtime: Runtime) -> None:
        """Say which process has which role, when that changes."""
        now = {role: runtime.pid(role) for role in get_args(Role)}
        if now != self._processes:
            self._processes = now
            _say({"processes": now})

    def _asked(self) -> Iterator[dict[str, Any]]:
        while select.select([0], [], [], 0.0)[0]:
            data = os.read(0, 1 << 16)
            if not data:
                self._open = False
                return
            *lines, self._left = (self._left + data).split(b"\n")
            yield from (json.loads(line) for line in lines)


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps({"at_ns": time.monotonic_ns()} | what) + "\n")
    sys.stdout.flush()


def main(folder: Path, audit: Path) -> None:
    """Drive. Raises ConfigError: there is no trip."""
    logging.basicConfig(level=logging.ERROR)
    settings = Settings.read(folder)
    if not settings.starts:
        raise ConfigError("There is no trip to drive.")
    first = settings.starts[0]
    with open_audit(audit, first.scenario, first.seed) as auditor, LiveRecorder(auditor, _DT_S) as books:
        Host(settings, books).run()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
