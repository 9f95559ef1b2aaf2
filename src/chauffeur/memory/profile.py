"""One person's file: an encrypted database that stays open, with the columns that recall looks at."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import Feedback, HistoryItem, PersonId, Trip
from chauffeur.language.weather import weather_of
from chauffeur.memory import cipher
from chauffeur.memory.columns import Columns, Entry, Signs, packed
from chauffeur.memory.records import body_of, feedback_body, item_of
from chauffeur.memory.similarity import DIMENSIONS, ENCODER, Mark, mark

VERSION = "chauffeur-profile-1"

_PACKED: Final = f"{ENCODER}/packed"
"""How vectors are written; files of earlier versions have them unpacked, under `ENCODER`."""

_WEATHER_BIT: Final = 32
"""The upper half of the stored tags is the weather; 0, as in files of earlier versions, for unknown."""

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

_INDEX = "CREATE INDEX IF NOT EXISTS trips_by_time ON trips (at, world)"
"""What retention and the columns need is found without a look at the bodies; made in older files as they are used."""

Change = Callable[[Columns], None]


def create_profile(path: Path, key: bytes, person: PersonId) -> None:
    """Write an empty profile.

    Raises:
        DatabaseError: It cannot be written.
    """
    about = {"version": VERSION, "person": json.dumps(person), "token": secrets.token_hex(8), "writes": "0"}
    cipher.create(path, key, _SCHEMA, about)


class Index:
    """The columns of a profile, and which edition of the file they were read from."""

    def __init__(self) -> None:
        self.edition = ""
        self.columns = Columns()

    def wipe(self) -> None:
        """Overwrite the columns."""
        self.edition = ""
        self.columns.wipe()


class Profile:
    """Reads and writes of one open profile. Every write is one transaction, on disk when the method returns.

    After an error the profile is of no more use: to close it undoes what was half done.
    """

    def __init__(self, path: Path, key: bytes, index: Index) -> None:
        """Open a profile.

        Args:
            path: The file.
            key: Of the person.
            index: Columns of the same profile, if it was open before; an empty one otherwise.

        Raises:
            DatabaseError: The file is missing, foreign, damaged, or of another version.
        """
        self._connection = cipher.connect(path, key)
        self._index = index
        try:
            self._about = self._read_about()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file; the columns are left to whoever gave them."""
        self._connection.close()

    @property
    def person(self) -> PersonId:
        """Whose profile it is."""
        return PersonId(json.loads(self._about["person"]))

    @property
    def edition(self) -> str:
        """Changes with every write to this profile, whichever process made it."""
        ((writes,),) = self._all("SELECT value FROM about WHERE name = 'writes'")
        return f"{self._about['token']}.{writes}"

    @contextmanager
    def reading(self, wish: Mark | None = None) -> Generator[Columns]:  # noqa: ARG002 - all bear on any wish
        """The columns of all trips as they are on disk; until the end, what else is read is of the same edition."""
        self._connection.execute("BEGIN")
        yield self._columns()
        self._connection.execute("COMMIT")

    def add(self, trip: Trip, feedback: Feedback | None, when: str, keep_from: str) -> None:
        """Keep a trip; what is older than `keep_from` goes."""
        wish, weather = mark(trip.instruction.text), weather_of(trip.context.situation)
        world, vector = _storable(trip.context.situation.world), packed(wish.vector)
        with self._writing() as changes:
            self._connection.execute(_INDEX)
            self._forget("DELETE FROM trips WHERE at < ? RETURNING id", keep_from, changes)
            row = self._connection.execute(
                "INSERT INTO trips (trip, at, world, body) VALUES (?, ?, ?, ?)",
                (_storable(trip.id), when, world, body_of(trip)),
            ).lastrowid
            assert row is not None  # of an insertion there always is one
            self._connection.execute(
                "INSERT INTO marks VALUES (?, ?, ?, ?, ?)",
                (row, _PACKED, vector, wish.tags | weather << _WEATHER_BIT, json.dumps(wish.quantities)),
            )
            moment = datetime.fromisoformat(when)
            entry = Entry(row, vector, wish.tags, wish.quantities, world, weather, moment, None)
            changes.append(lambda columns: columns.extend([entry]))
            if feedback is not None:
                self._add_feedback(row, feedback, when, changes)

    def add_feedback(self, feedback: Feedback, when: str, trip_id: str | None) -> bool:
        """Add feedback to the last trip, or to the last one with this id; False where there is none."""
        with self._writing() as changes:
            found = self._all(
                "SELECT id FROM trips WHERE ?1 IS NULL OR trip = ?1 ORDER BY id DESC LIMIT 1",
                None if trip_id is None else _storable(trip_id),
            )
            if found:
                self._add_feedback(found[0][0], feedback, when, changes)
        return bool(found)

    def forget_before(self, when: str) -> int:
        """Remove the trips before a time; how many they were."""
        with self._writing() as changes:
            return self._forget("DELETE FROM trips WHERE at < ? RETURNING id", when, changes)

    def forget_last(self) -> HistoryItem | None:
        """Remove the most recent trip."""
        with self._writing() as changes:
            ((last,),) = self._all("SELECT max(id) FROM trips")
            (item,) = (None,) if last is None else self.items([(last, 0.0)])
            self._forget("DELETE FROM trips WHERE id = ? RETURNING id", last, changes)
        return item

    def items(self, found: Sequence[tuple[int, float]]) -> tuple[HistoryItem, ...]:
        """Trips, by row and similarity, with their feedback: oldest feedback first."""
        # As one value, for how many there are does not change the statement.
        rows = json.dumps([row for row, _ in found])
        trips: dict[int, tuple[str, str, str, str]] = {}
        said: dict[int, tuple[str, ...]] = {}
        for row, trip, at, world, body, told in self._all(
            "SELECT trips.id, trips.trip, trips.at, world, trips.body, feedback.body FROM json_each(?) "
            "JOIN trips ON trips.id = value LEFT JOIN feedback ON feedback.trip = trips.id ORDER BY feedback.id",
            rows,
        ):
            trips[row] = trip, at, world, body
            said[row] = (*said.get(row, ()), *(() if told is None else (told,)))
        return tuple(item_of(*trips[row], said[row], similarity) for row, similarity in found)

    def export(self) -> list[dict[str, Any]]:
        """Everything kept, oldest first, as plain values."""
        said: dict[int, list[dict[str, Any]]] = {}
        for trip, at, body in self._all("SELECT trip, at, body FROM feedback ORDER BY id"):
            said.setdefault(trip, []).append({"when": at, **json.loads(body)})
        return [
            {"trip": trip, "when": at, "world": world, **json.loads(body), "feedback": said.get(row, [])}
            for row, trip, at, world, body in self._all("SELECT id, trip, at, world, body FROM trips ORDER BY id")
        ]

    def _read_about(self) -> dict[str, str]:
        about = {str(name): str(value) for name, value in self._all("SELECT name, value FROM about")}
        if about.get("version") != VERSION:
            raise cipher.DatabaseError(f"unknown version {about.get('version')!r}")
        return about

    def _columns(self) -> Columns:
        """Read anew only after another process wrote; what this one writes is brought up to date as it is written."""
        edition = self.edition
        if self._index.edition != edition:
            self._index.wipe()
            self._index.columns.extend(self._entries())
            self._index.edition = edition
        return self._index.columns

    def _entries(self) -> list[Entry]:
        """Every trip, oldest first."""
        driven = {row: (at, world) for row, at, world in self._all("SELECT id, at, world FROM trips")}
        said: dict[int, Signs] = {}
        for trip, *told in self._all(
            "SELECT trip, json_extract(body, '$.speed'), json_extract(body, '$.gap'), json_extract(body, '$.comfort') "
            "FROM feedback ORDER BY id"
        ):
            said[trip] = _joined(said.get(trip), told)
        return [
            self._entry(row, *driven[row], said.get(row), *marked)
            for row, *marked in self._all("SELECT id, encoder, vector, tags, quantities FROM marks ORDER BY id")
        ]

    def _entry(
        self, row: int, at: str, world: str, said: Signs | None, encoder: str, vector: bytes, tags: int, numbers: str
    ) -> Entry:
        quantities = () if numbers == "[]" else tuple((str(name), float(value)) for name, value in json.loads(numbers))
        tags, weather = tags & (1 << _WEATHER_BIT) - 1, tags >> _WEATHER_BIT
        if encoder == ENCODER:
            vector = packed(np.frombuffer(vector, np.float32, DIMENSIONS))
        elif encoder != _PACKED:
            ((body,),) = self._all("SELECT body FROM trips WHERE id = ?", row)
            wish = mark(json.loads(body)["instruction"])
            vector, tags, quantities = packed(wish.vector), wish.tags, wish.quantities
        return Entry(row, vector, tags, quantities, world, weather, datetime.fromisoformat(at), said)

    def _forget(self, statement: str, value: Any, changes: list[Change]) -> int:
        rows = [row for (row,) in self._all(statement, value)]
        changes.append(lambda columns: columns.remove(rows))
        return len(rows)

    def _add_feedback(self, row: int, feedback: Feedback, when: str, changes: list[Change]) -> None:
        self._connection.execute(
            "INSERT INTO feedback (trip, at, body) VALUES (?, ?, ?)", (row, when, feedback_body(feedback))
        )
        signs = (feedback.speed, feedback.gap, feedback.comfort)
        changes.append(lambda columns: columns.judge(row, signs))

    @contextmanager
    def _writing(self) -> Generator[list[Change]]:
        """One transaction; what it means for the columns is done once it is on disk."""
        changes: list[Change] = []
        self._connection.execute("BEGIN IMMEDIATE")
        current = self._index.edition == self.edition
        yield changes
        self._connection.execute("UPDATE about SET value = CAST(value AS INTEGER) + 1 WHERE name = 'writes'")
        edition = self.edition
        self._connection.execute("COMMIT")
        if current:
            for change in changes:
                change(self._index.columns)
            self._index.edition = edition
        # The log moves into the file, so that the file alone is the profile. Where that is not possible now it waits:
        # what is in the log is on disk as well.
        with suppress(cipher.DatabaseError):
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()

    def _all(self, query: str, *values: Any) -> list[Any]:
        return self._connection.execute(query, values).fetchall()


def _joined(before: Signs | None, told: Sequence[float]) -> Signs:
    """What feedback says after earlier feedback on the same trip: the last word on each topic."""
    old = before or (0, 0, 0)
    speed, gap, comfort = (_sign(value) for value in told)
    return speed or old[0], gap or old[1], comfort or old[2]


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


def _storable(text: str) -> str:
    """Ids and world kinds are columns of their own, and SQLite keeps no lone surrogates."""
    return text.encode("utf-8", "replace").decode()
