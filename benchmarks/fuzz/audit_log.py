"""The reading and verifying of audit logs, and the hunt for a change that goes unseen."""

from __future__ import annotations

import hashlib
import json
import random
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from functools import cache
from io import BytesIO
from pathlib import Path

from chauffeur.concept import DataError
from chauffeur.safety.audit import AuditLog, words_of
from chauffeur.safety.audit.entries import NotARecordError, canonical, parse
from chauffeur.safety.audit.reader import lines
from chauffeur.safety.audit.redaction import redact
from chauffeur.safety.audit.texts import says
from chauffeur.safety.audit.verification import verify_stream
from fuzz.target import Target, expect

KEY = b"the fuzzer does not know of this"
_WHO = "ana"


def _clock() -> Callable[[], datetime]:
    ticks = iter(range(1_000_000))
    return lambda: datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC) + timedelta(seconds=0.1 * next(ticks))


def _salts() -> Callable[[int], bytes]:
    count = iter(range(1, 1_000_000))
    return lambda length: next(count).to_bytes(length, "big")


def _log(path: Path, key: bytes | None, *, private: bool, erase: bool) -> bytes:
    log = AuditLog(path, about={"seed": 7}, clock=_clock(), key=key, private=private, make_salt=_salts())
    for person in (_WHO, "ben"):
        log.append("wish", {"source": "text"}, {"person": person, "wish": f"Überhol ihn – {person} \ud800"})
        log.append("verdict", {"check": "format-v1", "passed": True, "line": None}, {"reason": "ok"})
        log.append("actuation", {"ticks": [0, 1], "applied": [[0.1, -0.0], [1e-9, float("inf")]]})
    log.close()
    if erase:
        redact(path, _WHO, key=key, clock=_clock())
    return path.read_bytes()


@cache
def seeds() -> tuple[bytes, ...]:
    """Logs with and without a key, in privacy mode, and after an erasure. The same bytes each time."""
    with tempfile.TemporaryDirectory() as folder:
        kinds = ((KEY, False, False), (KEY, True, False), (KEY, False, True), (None, False, False), (None, True, True))
        return tuple(
            _log(Path(folder) / f"{number}.log", key, private=private, erase=erase)
            for number, (key, private, erase) in enumerate(kinds)
        )


@cache
def _heads() -> frozenset[str]:
    """Last hashes of the logs written under the key."""
    return frozenset(json.loads(seed.splitlines()[-1])["hash"] for seed in seeds()[:3])


@cache
def _sealed() -> frozenset[tuple[str, str]]:
    """(hash, texts) of every record written under the key, as they may stand: whole, or all texts erased."""
    known: set[tuple[str, str]] = set()
    for seed in seeds()[:3]:
        for line in seed.splitlines():
            record = parse(line)
            known.add((record.hash, json.dumps(record.texts, sort_keys=True)))
            known.add((record.hash, json.dumps({name: {"redacted": True} for name in record.texts}, sort_keys=True)))
    return frozenset(known)


def changed(data: bytes, rng: random.Random) -> bytes:
    """Lines moved, dropped, doubled, cut, taken from another log, or rewritten as JSON with their hash made to fit."""
    rows = data.split(b"\n")
    for _ in range(rng.randint(1, 2)):
        at = rng.randrange(len(rows))
        kind = rng.random()
        if kind < 0.1:
            rows.insert(rng.randrange(len(rows) + 1), rows[at])
        elif kind < 0.2 and len(rows) > 1:
            rows.pop(at)
        elif kind < 0.3:
            other = rng.randrange(len(rows))
            rows[at], rows[other] = rows[other], rows[at]
        elif kind < 0.4:
            rows[at] = rng.choice(rng.choice(seeds()).split(b"\n"))
        elif kind < 0.5:
            rows = rows[: at + 1]
            rows[-1] = rows[-1][: rng.randrange(len(rows[-1]) + 1)]
        else:
            rows[at] = _rewritten(rows[at], rng)
    return b"\n".join(rows)


def _rewritten(line: bytes, rng: random.Random) -> bytes:
    try:
        record = json.loads(line)
        places = list(_places(record))
        holder, name = rng.choice(places)
        holder[name] = rng.choice((None, True, False, 0, 1, -1, 2**63, 1.5, "", "x", [], {}, [[]], {"redacted": True}))
        if rng.random() < 0.3:
            del holder[name]
        if rng.random() < 0.5 and isinstance(record, dict):
            record.pop("hash", None)
            core = {key: value for key, value in record.items() if key != "texts"}
            record["hash"] = hashlib.sha256(canonical(core)).hexdigest()
        return canonical(record) if rng.random() < 0.9 else json.dumps(record).encode("utf-8", "surrogatepass")
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError):
        at = rng.randrange(len(line) + 1)
        return line[:at] + bytes([rng.randrange(256)]) + line[at + 1 :]


def _places(value: object) -> list[tuple[object, object]]:
    found: list[tuple[object, object]] = []
    stack = [value]
    while stack:
        item = stack.pop()
        keys = item if isinstance(item, dict) else range(len(item)) if isinstance(item, list) else ()
        for key in keys:
            found.append((item, key))
            stack.append(item[key])
    return found


def examine(data: bytes) -> str:
    """Read a log's records, and verify it with and without the key."""
    records = []
    for line in lines(BytesIO(data)):
        try:
            record = parse(line.content)
        except NotARecordError:
            continue
        words_of(record)
        says(record, "person", _WHO, KEY)
        says(record, "person", _WHO)
        if line.whole:
            records.append(record)
    try:
        found = verify_stream(BytesIO(data), "the log")
        keyed = verify_stream(BytesIO(data), "the log", key=KEY)
    except DataError:
        return "not a log"
    expect(found.records == len(records), "verifying and reading count differently")
    expect(found.ok <= bool(records), "a log without a record is called sound")
    for verified in (found, keyed):
        expect(len(verified.findings) + verified.more_findings >= len(verified.findings), "findings are miscounted")
        expect(verified.lost >= 0 and verified.redacted >= 0, "a count is negative")
    if keyed.ok and keyed.key == "checked":
        texts = [(record.hash, json.dumps(record.texts, sort_keys=True)) for record in records]
        expect(all(hash_ in {known for known, _ in _sealed()} for hash_, _ in texts), "a sealed record was forged")
        last = _sealed() | {(hash_, shown) for hash_, shown in texts if '"redacted": true' in shown}
        expect(set(texts) <= last, "a personal text was changed unseen")
    if not found.ok:
        return "changed"
    return "whole" if found.head in _heads() else "sound"


TARGET = Target(
    name="audit-log",
    invariant=(
        "No bytes make the reader or the verifier raise anything but DataError; both count the same records; a log "
        "that verifies under a key holds no record and no text that was not written under it."
    ),
    reads=("chauffeur.safety.audit",),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
