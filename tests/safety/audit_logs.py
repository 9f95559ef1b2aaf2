"""Small audit logs to look at and to tamper with."""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from io import BytesIO
from pathlib import Path
from typing import Any

from chauffeur.safety.audit import AuditLog, AuditVerification, Closing, Kind, head_path, verify_stream
from chauffeur.safety.audit.entries import NO_RECORD, seal
from chauffeur.safety.audit.keys import key_name

KEY = b"a key of thirty-two bytes, quite"
OTHER_KEY = b"another key of thirty-two bytes!"
ABOUT = {"scenario": "cruise", "seed": 7, "simulated": True}
BROKEN = OSError(errno.EIO, "broken")
WISH = "Überhol ihn, 快点 – \ud800"


def ticking(start: datetime = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)) -> Callable[[], datetime]:
    """A clock that goes on by a tenth of a second whenever it is looked at."""
    count = 0

    def now() -> datetime:
        nonlocal count
        count += 1
        return start + timedelta(seconds=0.1 * count)

    return now


def write(path: Path, *, key: bytes | None = None, private: bool = False) -> Closing:
    """A short drive of Ana's, then one of Ben's, in one log."""
    log = AuditLog(path, about=ABOUT, clock=ticking(), key=key, private=private, make_salt=counting_salt())
    for person in ("ana", "ben"):
        log.append("wish", {"source": "text"}, {"person": person, "wish": f"{WISH} ({person})"})
        log.append("context", {"letter": "C"}, {"person": person, "context": "Three lanes."})
        log.append("verdict", {"check": "format-v1", "passed": True, "line": None}, {"person": person, "reason": "ok"})
        log.append(
            "intervention", {"rule": "gap-v1", "interventions": [[3, 0.3, "too close", [1.5, 0.0], [-2.0, 0.0]]]}
        )
        log.append("actuation", {"ticks": [0, 1], "requested": [[0.1, -0.0], [1e-9, 0.3]], "applied_otherwise": []})
        log.append("outcome", {"outcome": "ended", "metrics": [{"value": float("nan")}]}, {"person": person})
    return log.close()


def counting_salt() -> Callable[[int], bytes]:
    """Salts that are never the same twice, and the same in every run of a test."""
    count = 0

    def salt(length: int) -> bytes:
        nonlocal count
        count += 1
        return count.to_bytes(length, "big")

    return salt


def refusing(error: OSError) -> Callable[..., Any]:
    """Stands in for a call of the operating system that fails."""

    def refuse(*_: Any, **__: Any) -> Any:
        raise error

    return refuse


@contextmanager
def far_east() -> Generator[None]:
    """The machine stands where it is nine hours later."""
    before = os.environ.get("TZ")
    os.environ["TZ"] = "JST-9"
    time.tzset()
    try:
        yield
    finally:
        if before is None:
            del os.environ["TZ"]
        else:
            os.environ["TZ"] = before
        time.tzset()


def chain(*records: tuple[Kind, dict[str, Any]], key: bytes | None = None) -> list[bytes]:
    """Lines of a log in which every hash is right."""
    before, written = NO_RECORD, list[bytes]()
    for seq, (kind, body) in enumerate(records):
        line, before = seal(seq, before, kind, "2026-01-02T03:04:05.000+00:00", body, {}, key)
        written.append(line)
    return written


def look(content: bytes, *, head: str | None = None, key: bytes | None = None) -> AuditVerification:
    """Verify a log's bytes."""
    return verify_stream(BytesIO(content), "the log", head=head, key=key)


def fields(line: bytes) -> dict[str, Any]:
    """A line as plain JSON."""
    value: dict[str, Any] = json.loads(line)
    return value


def old_log(path: Path, key: bytes | None) -> Path:
    """A log of format 1, whose head nothing sealed."""
    last, content = "0" * 64, b""
    for number, (kind, body) in enumerate(
        (("opened", {"format": 1, "key": "" if key is None else key_name(key)}), ("closed", {"lost": 0}))
    ):
        line, last = seal(number, last, kind, "2026-01-02T03:04:05.000+00:00", body, {}, key)
        content += line
    path.write_bytes(content)
    head_path(path).write_text(f"{last}\n")
    return path
