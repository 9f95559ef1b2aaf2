"""One person's file: an encrypted database, open for the length of one piece of work."""

from __future__ import annotations

import json
import secrets
import sqlite3
from collections.abc import Generator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from chauffeur.concept import Feedback, HistoryItem, PersonId, Trip
from chauffeur.memory import cipher
from chauffeur.memory.records import body_of, feedback_body, item_of
from chauffeur.memory.retrieval import Entry
from chauffeur.memory.similarity import DIMENSIONS, ENCODER, Mark, mark

VERSION = "chauffeur-profile-1"

_SCHEMA = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE trips (
    id INTEGER PRIMARY KEY AUTOINCREMENT, trip TEXT NOT NULL, at TEXT NOT NULL, world TEXT NOT NULL, body TEXT NOT NULL
);
CREATE TABLE marks (
    id INTEGER PRIMARY KEY REFERENCES trips ON DELETE CASCADE,
    encoder TEXT NOT NULL, vector BLOB NOT NULL, tags INTEGER NOT NULL, quantities TEXT NOT NULL
);
CREATE TABLE feedback (
    id INTEGER PRIMARY KEY AUTOINCREMENT, trip INTEGER NOT NULL REFERENCES trips ON DELETE CASCADE,
    at TEXT NOT NULL, body TEXT NOT NULL
);
CREATE INDEX feedback_of_trip ON feedback (trip);
"""


def create_profile(path: Path, key: bytes, person: PersonId) -> None:
    """Write an empty profile.

    Raises:
        DatabaseError: It cannot be written.
    """
    about = {"version": VERSION, "person": json.dumps(person), "token": secrets.token_hex(8), "writes": "0"}
    cipher.create(path, key, _SCHEMA, about)


@contextmanager
def open_profile(path: Path, key: bytes) -> Generator[Profile]:
    """Open a profile and close it again.

    Raises:
        DatabaseError: The file is missing, foreign, damaged, or of another version.
    """
    connection = cipher.connect(path, key)
    try:
        yield Profile(connection)
    finally:
        connection.close()


class Profile:
    """Reads and writes of one open profile. Every write is one transaction, on disk when the method returns."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self._about = {str(name): str(value) for name, value in self._all("SELECT name, value FROM about")}
        if self._about.get("version") != VERSION:
            raise cipher.DatabaseError(f"unknown version {self._about.get('version')!r}")

    @property
    def person(self) -> PersonId:
        """Whose profile it is."""
        return PersonId(json.loads(self._about["person"]))

    @property
    def edition(self) -> str:
        """Changes with every write to this profile, whichever process made it."""
        return f"{self._about['token']}.{self._about['writes']}"

    def add(self, trip: Trip, feedback: Feedback | None, when: str, keep_from: str) -> None:
        """Keep a trip; what is older than `keep_from` goes."""
        wish = mark(trip.instruction.text)
        with self._writing():
            self._connection.execute("DELETE FROM trips WHERE at < ?", (keep_from,))
            row = self._connection.execute(
                "INSERT INTO trips (trip, at, world, body) VALUES (?, ?, ?, ?)",
                (_storable(trip.id), when, _storable(trip.context.situation.world), body_of(trip)),
            ).lastrowid
            numbers = json.dumps(wish.quantities)
            self._connection.execute(
                "INSERT INTO marks VALUES (?, ?, ?, ?, ?)", (row, ENCODER, wish.vector.tobytes(), wish.tags, numbers)
            )
            if feedback is not None:
                self._add_feedback(row, feedback, when)

    def add_feedback(self, feedback: Feedback, when: str, trip_id: str | None) -> bool:
        """Add feedback to the last trip, or to the last one with this id; False where there is none."""
        with self._writing():
            found = self._all(
                "SELECT id FROM trips WHERE ?1 IS NULL OR trip = ?1 ORDER BY id DESC LIMIT 1",
                None if trip_id is None else _storable(trip_id),
            )
            if found:
                self._add_feedback(found[0][0], feedback, when)
        return bool(found)

    def forget_before(self, when: str) -> int:
        """Remove the trips before a time; how many they were."""
        with self._writing():
            return self._connection.execute("DELETE FROM trips WHERE at < ?", (when,)).rowcount

    def forget_last(self) -> HistoryItem | None:
        """Remove the most recent trip."""
        with self._writing():
            rows = self._all("SELECT max(id) FROM trips")
            item = None if rows[0][0] is None else self.item(rows[0][0])
            self._connection.execute("DELETE FROM trips WHERE id = ?", (rows[0][0],))
        return item

    def entries(self) -> tuple[Entry, ...]:
        """The index: every trip, oldest first."""
        rows = self._all(
            "SELECT t.id, t.world, t.at, m.encoder, m.vector, m.tags, m.quantities, "
            "EXISTS (SELECT 1 FROM feedback f WHERE f.trip = t.id) "
            "FROM trips t JOIN marks m ON m.id = t.id ORDER BY t.id"
        )
        return tuple(
            Entry(row, self._mark(row, *marked), world, datetime.fromisoformat(at), bool(judged))
            for row, world, at, *marked, judged in rows
        )

    def item(self, row: int, similarity: float = 0.0) -> HistoryItem:
        """One trip with its feedback, oldest feedback first."""
        ((trip, at, world, body),) = self._all("SELECT trip, at, world, body FROM trips WHERE id = ?", row)
        said = self._all("SELECT body FROM feedback WHERE trip = ? ORDER BY id", row)
        return item_of(trip, at, world, body, tuple(one for (one,) in said), similarity)

    def export(self) -> list[dict[str, Any]]:
        """Everything kept, oldest first, as plain values."""
        said: dict[int, list[dict[str, Any]]] = {}
        for trip, at, body in self._all("SELECT trip, at, body FROM feedback ORDER BY id"):
            said.setdefault(trip, []).append({"when": at, **json.loads(body)})
        return [
            {"trip": trip, "when": at, "world": world, **json.loads(body), "feedback": said.get(row, [])}
            for row, trip, at, world, body in self._all("SELECT id, trip, at, world, body FROM trips ORDER BY id")
        ]

    def _mark(self, row: int, encoder: str, vector: bytes, tags: int, quantities: str) -> Mark:
        if encoder != ENCODER:
            return mark(self.item(row).instruction)
        numbers = tuple((str(dimension), float(value)) for dimension, value in json.loads(quantities))
        return Mark(np.frombuffer(vector, dtype=np.float32, count=DIMENSIONS), tags, numbers)

    def _add_feedback(self, row: int | None, feedback: Feedback, when: str) -> None:
        self._connection.execute(
            "INSERT INTO feedback (trip, at, body) VALUES (?, ?, ?)", (row, when, feedback_body(feedback))
        )

    @contextmanager
    def _writing(self) -> Generator[None]:
        """One transaction. An error leaves it open, and closing the file then undoes it."""
        self._connection.execute("BEGIN IMMEDIATE")
        yield
        self._connection.execute("UPDATE about SET value = CAST(value AS INTEGER) + 1 WHERE name = 'writes'")
        self._connection.execute("COMMIT")

    def _all(self, query: str, *values: Any) -> list[Any]:
        return self._connection.execute(query, values).fetchall()


def _storable(text: str) -> str:
    """Ids and world kinds are columns of their own, and SQLite keeps no lone surrogates."""
    return text.encode("utf-8", "replace").decode()
