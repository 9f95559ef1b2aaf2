"""Append-only rows on disk: what every stage of a benchmark writes and every resume reads.

A row is one line of JSON that ends in a checksum of itself. What a crash, a full disk or a bad sector left behind is
therefore seen: a damaged line is set aside, and what it was about is done again.
"""

from __future__ import annotations

import json
import os
import queue
import re
import threading
import time
import zlib
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from chauffeur.concept import ChauffeurError, ConfigError, DataError
from chauffeur.driving.files import publish

Row = dict[str, Any]

_SEAL = re.compile(rb',"crc32":"([0-9a-f]{8})"\}$')


class StorageError(ChauffeurError):
    """The disk did not take a row."""


def seal(row: Row) -> bytes:
    """A row as its line: compact JSON whose last field is the checksum of what stands before it.

    Raises:
        TypeError, ValueError: The row holds something that is no JSON.
    """
    # Lone surrogates, which a foreign planner may hand on, go through to the file and come back.
    body = json.dumps(row, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "surrogatepass")
    return body[:-1] + b',"crc32":"%08x"}\n' % zlib.crc32(body)


def unseal(line: bytes) -> Row:
    """The row of a line. A line without a checksum, e.g. written by hand, is taken at its word.

    Raises:
        ValueError: The line is damaged.
    """
    found = _SEAL.search(line)
    body = line if found is None else line[: found.start()] + b"}"
    if found is not None and zlib.crc32(body) != int(found[1], 16):
        raise ValueError("its checksum differs")
    row = json.loads(body)
    if not isinstance(row, dict):
        raise TypeError("it is no object")
    return row


class RowStore:
    """Rows keyed by one field; the last row of a key wins. One process at a time may append.

    Reading changes nothing on disk. What is damaged is put right when the first row is appended.

    Attributes:
        path: The file.
        key: The field.
        rows: Present rows by key.
        damaged: Numbers, from 1, of lines that cannot be read, the torn end of a crash not among them.
    """

    def __init__(self, path: Path, key: str, *, durable: bool = True) -> None:
        """Read a store; an absent file is an empty one.

        Args:
            path: The file.
            key: The field.
            durable: Whether a row has to outlast a power cut once it is written.

        Raises:
            StorageError: It cannot be read.
        """
        self.path = path
        self._durable = durable
        self.rows: dict[str, Row] = {}
        self.damaged: list[int] = []
        self.key = key
        self._descriptor: int | None = None
        self._size = 0
        self._good: list[bytes] = []
        self._bad: list[bytes] = []
        self._torn = b""
        self._load()

    def _load(self) -> None:
        try:
            content = self.path.read_bytes()
        except FileNotFoundError:
            return
        except OSError as error:
            raise StorageError(f"Cannot read {self.path}: {error.strerror or error}.") from error
        *lines, self._torn = content.split(b"\n")
        good: list[bytes] = []
        for number, line in enumerate(lines, start=1):
            try:
                row = unseal(line)
                self.rows[str(row[self.key])] = row
                good.append(line)
            except (ValueError, KeyError, TypeError, RecursionError):
                self.damaged.append(number)
                self._bad.append(line)
        # Kept only where the file has to be written anew.
        self._good = good if self._bad or self._torn else []

    def append(self, *rows: Row) -> None:
        """Write rows through to the disk before returning: all of them or none.

        Raises:
            StorageError: The disk did not take them; the file is as it was.
        """
        self.write(b"".join(seal(row) for row in rows))
        self.keep(*rows)

    def keep(self, *rows: Row) -> None:
        """Take rows that are, or are being, written."""
        for row in rows:
            self.rows[str(row[self.key])] = row

    def write(self, lines: bytes) -> None:
        """Append sealed lines. Raises StorageError as `append` does."""
        try:
            descriptor = self._open()
        except OSError as error:
            raise self._full(error) from error
        try:
            view = memoryview(lines)
            while view:
                view = view[os.write(descriptor, view) :]
            if self._durable:
                os.fsync(descriptor)
        except OSError as error:
            with suppress(OSError):  # the part that was written must not be the start of the next line
                os.ftruncate(descriptor, self._size)
            raise self._full(error) from error
        self._size += len(lines)

    def _full(self, error: OSError) -> StorageError:
        return StorageError(
            f"Cannot write to {self.path}: {error.strerror or error}.",
            hint="Make room on the disk and run the same command: it goes on where it stopped.",
        )

    def _open(self) -> int:
        if self._descriptor is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._mend()
            self._descriptor = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
            self._size = os.fstat(self._descriptor).st_size
        return self._descriptor

    def _mend(self) -> None:
        if self._bad:
            aside = self.path.with_name(f"{self.path.name}.damaged")
            with aside.open("ab") as stream:
                stream.write(b"\n".join(self._bad) + b"\n")
        if self._bad or self._torn:
            publish(self.path, b"".join(line + b"\n" for line in self._good), "mended rows")
        self._good, self._bad, self._torn = [], [], b""

    def close(self) -> None:
        """Close the file; the rows stay readable."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def clear(self) -> None:
        """Begin anew: no rows, no file. Raises StorageError when the file cannot be removed."""
        self.close()
        try:
            self.path.unlink(missing_ok=True)
        except OSError as error:
            raise StorageError(f"Cannot remove {self.path}: {error.strerror or error}.") from error
        self.rows, self.damaged, self._good, self._bad, self._torn = {}, [], [], [], b""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Scribe:
    """Writes rows of any store from a thread of its own, so that nobody waits for the disk; everything that has come
    in meanwhile goes down in one write.

    Args:
        failed: Called from that thread, once, when the disk does not take a row. What comes later is not written.
    """

    def __init__(self, failed: Callable[[ChauffeurError], None]) -> None:
        self._failed = failed
        self._queue: queue.SimpleQueue[tuple[RowStore, bytes] | None] = queue.SimpleQueue()
        self._error: ChauffeurError | None = None
        self._thread = threading.Thread(target=self._work, name="chauffeur-scribe", daemon=True)
        self._thread.start()

    def write(self, store: RowStore, row: Row) -> None:
        """Append a row; the store shows it at once.

        Raises:
            TypeError, ValueError: The row holds something that is no JSON.
        """
        line = seal(row)
        store.keep(row)
        self._queue.put((store, line))

    def close(self) -> None:
        """Wait until all is written. Raises StorageError when the disk did not take it all."""
        self._queue.put(None)
        self._thread.join()
        if self._error is not None:
            raise self._error

    def _work(self) -> None:
        last = False
        while not last:
            waiting = [self._queue.get()]
            with suppress(queue.Empty):
                while True:
                    waiting.append(self._queue.get_nowait())
            last = None in waiting
            if self._error is None:
                self._write([entry for entry in waiting if entry is not None])

    def _write(self, entries: Iterable[tuple[RowStore, bytes]]) -> None:
        lines: dict[RowStore, list[bytes]] = {}
        for store, line in entries:
            lines.setdefault(store, []).append(line)
        try:
            for store, group in lines.items():
                store.write(b"".join(group))
        except ChauffeurError as error:
            self._error = error
            self._failed(error)


def freeze(
    path: Path, content: bytes, what: str = "run's configuration", same: Callable[[bytes], bool] | None = None
) -> bool:
    """Store what decides a run, or find that it is what is stored; whether it was stored only now.

    Args:
        path: In the run's folder.
        content: What decides it.
        what: That is, in words.
        same: Whether what is stored decides the same; by default byte by byte.

    Raises:
        ConfigError: The folder holds another run.
        DataError: What is stored cannot be read.
    """
    if not path.exists():
        publish(path, content, what)
        return True
    try:
        stored = path.read_bytes()
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.") from error
    if not (stored == content if same is None else same(stored)):
        raise another_run(path.parent)
    return False


def another_run(folder: Path) -> ConfigError:
    """A folder holds a run that something else decided."""
    return ConfigError(
        f"{folder} holds a run with another configuration.",
        hint="Continue it with the options it was started with, or choose another --out folder.",
    )


@contextmanager
def sole_writer(folder: Path) -> Generator[None]:
    """Keep other processes from working in a run folder meanwhile. A process that dies gives it free.

    Raises:
        ConfigError: Another process works in it.
        StorageError: The folder cannot be used.
    """
    try:
        import fcntl
    except ImportError:  # Windows has no such lock; there the person has to see to it
        yield
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder / ".lock", os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise StorageError(f"Cannot use the run folder {folder}: {error.strerror or error}.") from error
    try:
        for last in (False, True):
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError as error:
                if last:
                    raise ConfigError(
                        f"Another process is working in {folder}.", hint="Wait for it, or choose another --out folder."
                    ) from error
                time.sleep(_GLANCE_S)
            except OSError:  # file systems without locks
                break
        yield
    finally:
        os.close(descriptor)


_GLANCE_S: Final = 0.05
"""`is_written` holds the lock for microseconds; a writer that meets it waits so long and tries again."""


def is_written(folder: Path) -> bool:
    """True while a process works in a run folder (`sole_writer`); False where that cannot be told."""
    try:
        import fcntl

        descriptor = os.open(folder / ".lock", os.O_RDONLY)
    except (ImportError, OSError):
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False
