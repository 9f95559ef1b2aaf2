"""The newest messages of one process for others, in shared memory: writing never waits, and neither does reading.

A ring is a mapped file with a fixed number of slots. Each slot carries its number, the time it was written, its length
and a checksum over all of them, so that a reader can tell a message that is whole from one that is being written, was
torn when its writer died, or was scribbled over. One process writes; any number read.
"""

from __future__ import annotations

import mmap
import os
import struct
import time
import zlib
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from chauffeur.concept import DataError

_MAGIC: Final = b"CHFRING1"
_HEADER = struct.Struct("<8sII")
_HEAD = struct.Struct("=Q")
_HEAD_AT: Final = 64
_SLOTS_AT: Final = 128
_SLOT = struct.Struct("<QqII")
"""Number, time written (ns), length, checksum."""
_TRIES: Final = 3
_MOST: Final = 1 << 62
"""A larger number was never counted up to: somebody scribbled there."""
_AHEAD_NS: Final = 1_000_000_000
"""A message from further in the future was not written by anybody who can be believed."""


@dataclass(frozen=True, slots=True)
class RingMessage:
    """A whole message.

    Attributes:
        number: Counts from 1, one more for each message.
        written_ns: `time.monotonic_ns()` of the writer; one clock for all processes of a machine.
        payload: Content.
    """

    number: int
    written_ns: int
    payload: bytes


class Ring:
    """A ring of messages in a file. Sizes are this reader's own: what the file claims is never believed."""

    def __init__(self, path: Path, slots: int, size: int, *, create: bool = False) -> None:
        """Map a ring.

        Args:
            path: File, best in memory (`/dev/shm`).
            slots: Messages kept.
            size: Most bytes of a message.
            create: Make the file, readable by this user only; otherwise it must be there.

        Raises:
            DataError: The file is no ring of these sizes.
            OSError: It cannot be made or opened.
        """
        self._slots, self._size = slots, size
        self._stride = (_SLOT.size + size + 7) // 8 * 8
        length = _SLOTS_AT + slots * self._stride
        flags = os.O_RDWR | (os.O_CREAT | os.O_EXCL if create else 0)
        handle = os.open(path, flags, 0o600)
        try:
            if create:
                os.ftruncate(handle, length)
            elif os.fstat(handle).st_size != length:
                raise DataError(f"{path} is no ring of {slots} messages of {size} bytes.")
            self._map = mmap.mmap(handle, length)
        finally:
            os.close(handle)
        if create:
            _HEADER.pack_into(self._map, 0, _MAGIC, slots, size)
        elif self._map[: len(_MAGIC)] != _MAGIC:
            self._map.close()
            raise DataError(f"{path} is no ring.")
        self.torn = 0
        """Messages this reader found broken."""
        head = self.head
        self._written = head if head < _MOST else 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Unmap. The file stays."""
        self._map.close()

    @property
    def size(self) -> int:
        """Most bytes of a message."""
        return self._size

    def touch_pages(self) -> None:
        """Have every page in memory, so that no later access waits for one."""
        for at in range(0, len(self._map), mmap.PAGESIZE):
            self._map[at]  # pyright: ignore[reportUnusedExpression] - the read is the point

    def renew(self) -> None:
        """Write what marks the file as a ring once more: whoever opens it next may rely on it."""
        _HEADER.pack_into(self._map, 0, _MAGIC, self._slots, self._size)

    @property
    def head(self) -> int:
        """Number of the newest message, 0 for none."""
        return int(_HEAD.unpack_from(self._map, _HEAD_AT)[0])

    def write(self, payload: bytes, now_ns: int | None = None) -> int:
        """Add a message; returns its number.

        Raises:
            ValueError: It is longer than a slot.
        """
        if len(payload) > self._size:
            raise ValueError(f"A message of {len(payload)} bytes does not fit into {self._size}.")
        self._written = number = self._written + 1
        at = self._at(number)
        written_ns = time.monotonic_ns() if now_ns is None else now_ns
        head = struct.pack("<QqI", number, written_ns, len(payload))
        _SLOT.pack_into(self._map, at, 0, 0, 0, 0)  # nobody takes half of the new one for the old one
        self._map[at + _SLOT.size : at + _SLOT.size + len(payload)] = payload
        _SLOT.pack_into(self._map, at, number, written_ns, len(payload), zlib.crc32(payload, zlib.crc32(head)))
        _HEAD.pack_into(self._map, _HEAD_AT, number)
        return number

    def latest(self) -> RingMessage | None:
        """The newest whole message; None if there is none yet, or what is there is broken."""
        for _ in range(_TRIES):
            number = self.head
            if number == 0:
                return None
            message = self._read(number)
            if message is not None:
                return message
        self.torn += 1
        return None

    def newer(self, than_ns: int, until_ns: int) -> tuple[RingMessage, ...]:
        """Whole messages written in a time, oldest first. It goes back from the newest one until one is older."""
        head = self.head
        found: list[RingMessage] = []
        for number in range(head, max(0, head - self._slots), -1):
            message = self._read(number)
            if message is None or message.written_ns >= until_ns:
                continue
            if message.written_ns <= than_ns or (found and message.written_ns > found[-1].written_ns):
                break
            found.append(message)
        return tuple(reversed(found))

    def _at(self, number: int) -> int:
        return _SLOTS_AT + number % self._slots * self._stride

    def _read(self, number: int) -> RingMessage | None:
        at = self._at(number)
        found, written_ns, length, checksum = _SLOT.unpack_from(self._map, at)
        if found != number or length > self._size:
            return None
        payload = self._map[at + _SLOT.size : at + _SLOT.size + length]
        head = struct.pack("<QqI", number, written_ns, length)
        if zlib.crc32(payload, zlib.crc32(head)) != checksum:
            return None
        return RingMessage(number, written_ns, payload)


class Reader:
    """Reads what is new in a ring.

    It goes by the times at which messages were written, not by their numbers alone: numbers that were scribbled over,
    or that a new writer counts anew, neither make it deaf nor have it hear old messages again.
    """

    def __init__(self, ring: Ring, *, old: bool = False) -> None:
        """Read from now on.

        Args:
            ring: What to read.
            old: Whether to begin with what is there already.
        """
        self._ring = ring
        self._number = 0 if old else ring.head
        self._written_ns = 0 if old else time.monotonic_ns()

    def news(self) -> tuple[tuple[RingMessage, ...], int]:
        """Whole messages since the last call, oldest first, and how many are known to be lost."""
        found = self._ring.newer(self._written_ns, time.monotonic_ns() + _AHEAD_NS)
        if not found:
            return (), 0
        newest = found[-1]
        lost = max(0, newest.number - self._number - len(found))
        self._number, self._written_ns = newest.number, newest.written_ns
        return found, lost
