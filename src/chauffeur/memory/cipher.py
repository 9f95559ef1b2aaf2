"""The one door to SQLCipher, which comes without type stubs: an encrypted SQLite file opened with a raw key."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, cast

_sqlcipher: Any = import_module("sqlcipher3.dbapi2")

DatabaseError: type[Exception] = _sqlcipher.DatabaseError
"""Wrong key, foreign, truncated or damaged file, locked too long, disk full."""

BUSY_S = 10.0
"""How long a write waits for another process's."""


def connect(path: Path, key: bytes) -> sqlite3.Connection:
    """Open an existing encrypted file.

    Transactions are explicit (`BEGIN IMMEDIATE`). What is committed survives a power cut: write-ahead log, and a sync
    at each commit. What is deleted is overwritten.

    Args:
        path: The file; it is not created.
        key: 32 random bytes. A raw key needs no derivation, so opening costs under a millisecond.

    Raises:
        DatabaseError: The file is missing, or is not a database under this key.
    """
    connection: Any = _sqlcipher.connect(
        f"{path.absolute().as_uri()}?mode=rw", uri=True, timeout=BUSY_S, isolation_level=None, check_same_thread=False
    )
    try:
        _prepare(connection, key)
    except BaseException:
        connection.close()
        raise
    # Its objects have sqlite3's interface, method for method; only the classes differ.
    return cast(sqlite3.Connection, connection)


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
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "secure_delete = ON", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")
    connection.execute("PRAGMA temp_store = MEMORY")
