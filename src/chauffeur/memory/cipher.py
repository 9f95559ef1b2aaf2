"""The one door to SQLCipher, which comes without type stubs: an encrypted SQLite file opened with a raw key."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, cast

from chauffeur.memory.files import require_plain

_sqlcipher: Any = import_module("sqlcipher3.dbapi2")

DatabaseError: type[Exception] = _sqlcipher.DatabaseError
"""Wrong key, foreign, truncated or damaged file, locked too long, disk full."""

BUSY_S = 10.0
"""How long a write waits for another process's."""

_PRAGMAS = (
    "journal_mode = WAL", "synchronous = FULL", "secure_delete = ON", "foreign_keys = ON", "temp_store = MEMORY",
)  # fmt: skip


def connect(path: Path, key: bytes) -> sqlite3.Connection:
    """Open an existing encrypted file.

    Transactions are explicit (`BEGIN IMMEDIATE`). What is committed survives a power cut: write-ahead log, and a sync
    at each commit. What is deleted is overwritten. Where a log was left behind, by a crash or by whoever writes just
    now, the file is read through first: beside a log SQLite does not notice that a file was cut, and would write on.

    Args:
        path: The file; it is not created.
        key: 32 random bytes. A raw key needs no derivation, so opening costs under a millisecond.

    Raises:
        DatabaseError: The file is missing, damaged, or is not a database under this key.
        NotPlainFileError: It is a link, or something else that is no file; or a file beside it that belongs to it is.
    """
    for suffix in ("", "-wal", "-shm", "-journal"):
        require_plain(path.with_name(f"{path.name}{suffix}"))
    log = path.with_name(f"{path.name}-wal")
    if log.exists() and log.stat().st_size > 0:
        _read_through(path, key)
    connection = _opened(path, key, "rw")
    # Its objects have sqlite3's interface, method for method; only the classes differ.
    return cast(sqlite3.Connection, connection)


def _read_through(path: Path, key: bytes) -> None:
    """Read every page. Without the right to write: to close a file otherwise moves its log into it, damaged or not."""
    connection = _opened(path, key, "ro")
    try:
        found = connection.execute("PRAGMA quick_check(1)").fetchall()
    finally:
        connection.close()
    if found != [("ok",)]:
        raise DatabaseError(f"the file does not fit its log: {found[0][0]}")


def _opened(path: Path, key: bytes, mode: str) -> Any:
    connection: Any = _sqlcipher.connect(
        f"{path.absolute().as_uri()}?mode={mode}",
        uri=True,
        timeout=BUSY_S,
        isolation_level=None,
        check_same_thread=False,
    )
    try:
        _prepare(connection, key)
    except BaseException:
        connection.close()
        raise
    return connection


def create(path: Path, key: bytes, schema: str, about: Mapping[str, str]) -> None:
    """Write a new encrypted file and close it; it is complete on disk afterwards.

    Args:
        path: Where; there is no file yet.
        key: As for `connect`.
        schema: Statements that make the tables, `about(name, value)` among them.
        about: First rows of that table.

    Raises:
        DatabaseError: It cannot be written.
    """
    connection: Any = _sqlcipher.connect(str(path), isolation_level=None)
    try:
        _prepare(connection, key)
        connection.executescript(schema)
        connection.executemany("INSERT INTO about VALUES (?, ?)", list(about.items()))
    finally:
        connection.close()


def _prepare(connection: Any, key: bytes) -> None:
    """Give a fresh connection its key and its durability, and prove that the key fits."""
    # A pragma takes no parameters; hexadecimal digits are all that can stand here.
    connection.execute(f"PRAGMA key = \"x'{key.hex()}'\"")
    connection.execute("PRAGMA cipher_log_level = NONE")
    connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    for pragma in _PRAGMAS:
        connection.execute(f"PRAGMA {pragma}")
