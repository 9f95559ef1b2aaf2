"""Writing an audit log while driving: handing a record over costs microseconds and never waits, fails or raises.

A thread of its own turns what was handed over into sealed lines and writes them. The queue between is bounded; what
finds no room is counted, and the gap stands in the chain as a record of its own. All kinds of records but actuations
are synced to the disk as soon as they are written; actuations at the latest a second later. `flush` waits until
everything handed over so far is on the disk, and belongs to the planning side, never to control. A disk that fails is
tried again twice a second; meanwhile records wait in the queue.
"""

from __future__ import annotations

import logging
import secrets
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from chauffeur.concept import DataError
from chauffeur.safety.audit.entries import FORMAT, LINE_START, NO_RECORD, Kind, seal, stamp, torn_end
from chauffeur.safety.audit.heads import SEALED_SINCE, head_path, leave_head
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.storage import LogFile
from chauffeur.safety.audit.texts import REFERENCES, hide
from chauffeur.safety.audit.verification import AuditVerification, verify
from chauffeur.version import __version__

CAPACITY: Final = 4096
"""Records that may wait to be written: minutes of a drive."""

SYNC_EVERY_S: Final = 1.0
"""The longest a written actuation waits for the disk."""

RETRY_S: Final = 0.5
"""Pause after a failed write."""

PATIENCE_S: Final = 5.0
"""Default time that the planning side waits for the disk."""

_AT_ONCE: Final = 64
"""Records sealed and written together: the interpreter is not kept from control for longer than a millisecond or so."""

_log = logging.getLogger(__name__)


def utc_now() -> datetime:
    """The machine's clock."""
    return datetime.now(UTC)


@dataclass(frozen=True, slots=True)
class Closing:
    """Final state of an audit log.

    Attributes:
        head: Hash of the last record on the disk. Kept elsewhere, it shows later whether the end was cut off.
        records: Records on the disk, those of earlier drives in the same log included.
        lost: Records of this drive that are not in the log; the log says so itself where it could still be written.
        trouble: The last thing that went wrong with the disk, in words; empty when nothing did.
    """

    head: str
    records: int
    lost: int
    trouble: str

    @property
    def complete(self) -> bool:
        """True if everything handed over is in the log."""
        return not self.lost and not self.trouble


@dataclass(frozen=True, slots=True)
class _Entry:
    kind: Kind
    time: str
    body: Mapping[str, Any]
    texts: Mapping[str, str]


class AuditLog:
    """An append-only, hash-chained log, open for writing. Methods may be called from any thread."""

    def __init__(
        self,
        path: Path,
        *,
        about: Mapping[str, Any],
        clock: Callable[[], datetime] = utc_now,
        key: bytes | None = None,
        private: bool = False,
        capacity: int = CAPACITY,
        sync_every_s: float = SYNC_EVERY_S,
        make_salt: Callable[[int], bytes] = secrets.token_bytes,
    ) -> None:
        """Begin a log, or go on with one: what is there is verified first, and a torn end is cut off and said.

        Args:
            path: The log. A pipe or a device is written to as a stream.
            about: What the first record of this drive says besides versions, e.g. scenario and seed; JSON values only.
            clock: Present time, with a time zone.
            key: Seals every record, so that nobody without it can write the log anew unseen.
            private: Whether personal texts are withheld: digests under the key, and nothing at all without one.
            capacity: Records that may wait.
            sync_every_s: The longest a written actuation waits for the disk.
            make_salt: Gives that many random bytes, fit for cryptography.

        Raises:
            DataError: The file cannot be opened, is being written by somebody else, is not an audit log, or was
                changed since it was written. After this, nothing raises any more.
        """
        self._path, self._clock, self._key, self._private = path, clock, key, private
        self._capacity, self._sync_every_s, self._make_salt = capacity, sync_every_s, make_salt
        self._file = LogFile(path)
        try:
            self._seq, self._head, before = self._go_on()
            self._announce()
        except BaseException:
            self._file.close()
            raise
        self._lock = threading.Lock()
        self._work_there = threading.Condition(self._lock)
        self._work_done = threading.Condition(self._lock)
        # Shared, under the lock:
        self._queue: deque[_Entry] = deque()
        self._in_hand = 0
        self._lost: Counter[str] = Counter()
        self._lost_in_all = 0
        self._handed_over = 0
        self._on_disk = 0
        self._failures = 0
        self._sync_wanted = False
        self._closing = False
        self._trouble = ""
        # The writer's own:
        self._unwritten: deque[_Entry] = deque()
        self._gap: _Entry | None = None
        self._gap_lost: Counter[str] = Counter()
        self._unsynced = 0
        self._sync_due_s: float | None = None
        self._sync_failing = self._sync_failure_told = False
        self.append(
            "opened",
            {
                "format": FORMAT,
                "chauffeur": __version__,
                "key": "" if key is None else key_name(key),
                "private": private,
                **before,
                **about,
            },
        )
        self._thread = threading.Thread(target=self._work, name="audit log", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def path(self) -> Path:
        """Path of the log."""
        return self._path

    @property
    def head(self) -> str:
        """Hash of the last record written."""
        return self._head

    @property
    def on_disk(self) -> int:
        """Records of this drive that a power cut would not take."""
        return self._on_disk

    @property
    def lost(self) -> int:
        """Records that found no room so far."""
        return self._lost_in_all

    @property
    def trouble(self) -> str:
        """The last thing that went wrong with the disk, in words; empty when nothing did."""
        return self._trouble

    def append(self, kind: Kind, body: Mapping[str, Any], texts: Mapping[str, str] | None = None) -> bool:
        """Hand a record over. Never waits for the disk and never raises.

        Args:
            kind: What it tells of.
            body: JSON values, not changed afterwards; nothing a person said, and nothing that could quote them.
            texts: What a person said, or could quote them, by name; `person` names them, for redaction.

        Returns:
            Whether it will be written. False: there was no room, and the gap will be recorded instead; or the log is
            closed.
        """
        entry = _Entry(kind, stamp(self._clock()), body, {} if texts is None else texts)
        with self._lock:
            if self._closing:
                self._lost_in_all += 1
                return False
            if len(self._queue) + self._in_hand >= self._capacity:
                self._lost[kind] += 1
                self._lost_in_all += 1
                return False
            self._queue.append(entry)
            self._handed_over += 1
            self._work_there.notify()
        return True

    def flush(self, timeout_s: float = PATIENCE_S) -> bool:
        """Wait until everything handed over before is on the disk; for the planning side, never for control.

        Returns:
            Whether it is. False when the disk failed or was too slow, or when a record found no room meanwhile.
        """
        deadline = time.monotonic() + timeout_s
        with self._lock:
            wanted, lost, failures = self._handed_over, self._lost_in_all, self._failures
            self._sync_wanted = True
            self._work_there.notify()
            while self._on_disk < wanted and self._failures == failures:
                left = deadline - time.monotonic()
                if left <= 0 or not self._thread.is_alive():
                    return False
                self._work_done.wait(left)
            return self._on_disk >= wanted and self._lost_in_all == lost and not self._lost

    def close(self, timeout_s: float = PATIENCE_S) -> Closing:
        """Write what is left and the closing record, and give the file back; a second call changes nothing.

        Returns:
            How it ended; it says so when the disk took too long or failed.
        """
        with self._lock:
            if not self._closing:
                self._queue.append(_Entry("closed", stamp(self._clock()), {"lost": self._lost_in_all}, {}))
                self._handed_over += 1
                self._closing = True
            self._work_there.notify()
        self._thread.join(timeout_s)
        with self._lock:
            stuck = self._thread.is_alive()
            trouble = "The disk did not answer in time." if stuck else self._trouble
            missing = self._handed_over - self._on_disk
            return Closing(self._head, self._seq, self._lost_in_all + missing, trouble)

    def _go_on(self) -> tuple[int, str, dict[str, Any]]:
        """(next sequence number, hash of the last record, what to say of how it ended) of the file as it is."""
        if not self._file.size:
            return 0, NO_RECORD, {}
        found = verify(self._path, key=self._key)
        _must_go_on(self._path, found)
        before: dict[str, Any] = {"unclosed": True} if found.end == "open" else {}
        if not found.torn_bytes:
            return found.records, found.head, before
        whole = self._file.size - found.torn_bytes
        with self._path.open("rb") as file:
            file.seek(whole)
            torn = file.read()
        if not found.records and torn[: len(LINE_START)] != LINE_START[: len(torn)]:
            raise DataError(f"{self._path} is not an audit log.", hint="Name another file.")
        self._file.cut(whole)
        return found.records, found.head, before | torn_end(torn)

    def _announce(self) -> None:
        """Say under the key that records will follow: after a crash, the head tells where what is sure of them ends."""
        if self._key is None or not self._file.is_regular:
            return
        try:
            leave_head(self._path, self._head, self._seq, key=self._key, closed=False)
        except OSError as error:
            raise DataError(
                f"The head file {head_path(self._path)} cannot be written: {error.strerror or error}.",
                hint="Name another file.",
            ) from error

    def _work(self) -> None:
        """The writer thread."""
        try:
            while self._round():
                pass
        except Exception as error:  # noqa: BLE001 - a fault in here must be said, and must not stop a drive
            _log.exception("the audit log %s is not written any more", self._path)
            with self._lock:
                self._note_failure(f"The audit log failed: {type(error).__name__}.")
        finally:
            self._file.close()

    def _round(self) -> bool:
        """Wait for work, do it; False when the log is closed."""
        with self._lock:
            while not (self._queue or self._lost or self._closing or self._sync_wanted or self._overdue()):
                self._work_there.wait(self._patience_s())
            self._take_over()
            closing, sync_wanted, self._sync_wanted = self._closing, self._sync_wanted, False
        try:
            urgent = self._write()
            if self._unsynced and (urgent or sync_wanted or self._overdue()):
                self._sync()
        except OSError as error:
            self._give_up_for_now(error)
            return not closing
        with self._lock:
            self._work_done.notify_all()
        if closing:
            self._leave_head()
        return not closing

    def _overdue(self) -> bool:
        return self._sync_due_s is not None and time.monotonic() >= self._sync_due_s

    def _patience_s(self) -> float | None:
        return None if self._sync_due_s is None else max(0.0, self._sync_due_s - time.monotonic())

    def _take_over(self) -> None:
        """Take everything from the queue, and behind it the gap, if records found no room. Under the lock."""
        closing = [self._queue.pop()] if self._queue and self._queue[-1].kind == "closed" else []
        self._unwritten.extend(self._queue)
        self._queue.clear()
        if self._lost:
            lost = Counter(self._lost)
            self._lost.clear()
            if self._unwritten and self._unwritten[-1] is self._gap:
                lost.update(self._gap_lost)
                self._unwritten.pop()
                self._handed_over -= 1
            self._gap_lost = lost
            self._gap = self._tell_of_gap(lost, "there was no room left: the disk was too slow, or failed")
        if self._sync_failing and not self._sync_failure_told:
            self._sync_failure_told = True
            self._tell_of_gap({}, "a sync failed: after a power cut, records just before this one may be missing")
        self._unwritten.extend(closing)
        self._in_hand = len(self._unwritten)

    def _tell_of_gap(self, lost: Mapping[str, int], why: str) -> _Entry:
        gap = _Entry("gap", stamp(self._clock()), {"lost": dict(lost), "why": why}, {})
        self._unwritten.append(gap)
        self._handed_over += 1
        return gap

    def _write(self) -> bool:
        """Write what is in hand; whether any of it must be synced at once. Raises OSError."""
        urgent = False
        while self._unwritten:
            some = [self._unwritten[i] for i in range(min(_AT_ONCE, len(self._unwritten)))]
            data, head = self._seal(some)
            self._file.append(data)
            for _ in some:
                self._unwritten.popleft()
            urgent = urgent or any(entry.kind != "actuation" for entry in some)
            self._unsynced += len(some)
            if self._sync_due_s is None:
                self._sync_due_s = time.monotonic() + self._sync_every_s
            with self._lock:
                self._seq += len(some)
                self._head = head
                self._in_hand = len(self._unwritten)
        return urgent

    def _sync(self) -> None:
        """Make it survive a power cut. Raises OSError."""
        try:
            self._file.sync()
        except OSError:
            self._sync_failing = True
            raise
        self._sync_failing = self._sync_failure_told = False
        with self._lock:
            self._on_disk += self._unsynced
        self._unsynced, self._sync_due_s = 0, None

    def _seal(self, entries: Sequence[_Entry]) -> tuple[bytes, str]:
        seq, head, parts = self._seq, self._head, list[bytes]()
        for entry in entries:
            try:
                references, values = hide(entry.texts, private=self._private, key=self._key, make_salt=self._make_salt)
                body = {**entry.body, REFERENCES: references} if references else entry.body
                part, head = seal(seq, head, entry.kind, entry.time, body, values, self._key)
            except Exception as error:  # noqa: BLE001 - values come from planners of third parties
                # The error's text could quote a value, and a value could quote the person.
                fault = {"fault": f"the record could not be written as JSON ({type(error).__name__})"}
                part, head = seal(seq, head, entry.kind, entry.time, fault, {}, self._key)
            parts.append(part)
            seq += 1
        return b"".join(parts), head

    def _give_up_for_now(self, error: OSError) -> None:
        """Say what failed, and rest a little before the next try."""
        trouble = f"The audit log could not be written: {error.strerror or error}."
        if trouble != self._trouble:  # once, not with every try
            _log.warning("%s: %s", self._path, trouble)
        with self._lock:
            self._note_failure(trouble)
            self._work_there.wait_for(lambda: self._closing or self._sync_wanted, RETRY_S)
            self._sync_wanted = True  # what failed is made good at the next try, however long actuations may wait

    def _note_failure(self, trouble: str) -> None:
        self._trouble = trouble
        self._failures += 1
        self._work_done.notify_all()

    def _leave_head(self) -> None:
        """Put the head beside the log. It is a help, not the log: when it fails, that is said and no more."""
        if not self._file.is_regular:
            return
        try:
            leave_head(self._path, self._head, self._seq, key=self._key)
        except OSError as error:
            with self._lock:
                self._trouble = f"The head file could not be written: {error.strerror or error}."


def _must_go_on(path: Path, found: AuditVerification) -> None:
    """Raises DataError where a log must not be continued."""
    if not found.usable and found.records:
        raise DataError(
            f"The audit log {path} is not as it was written ({found.findings[0]}), so it is not continued.",
            hint=f"Look at it with: chauffeur audit verify {path}; and name another file for this drive.",
        )
    if found.key == "unchecked":
        raise DataError(
            f"The audit log {path} is written under a key, so it is not continued without it.",
            hint="Give the key file, or name another file.",
        )
    if found.key == "checked" and found.format < SEALED_SINCE:
        raise DataError(
            f"The audit log {path} is of format {found.format}, whose end its key does not vouch for, so it is not "
            "continued.",
            hint="Name another file for this drive; the old log can be verified as before.",
        )
