"""A study with people, as a folder: plan, sealed key, consent text, and a journal that only grows.

People appear under pseudonyms alone; who is behind them is written down elsewhere, by the lab. Every record is on disk
before the command that writes it ends. Who withdraws is erased: records, trips and profile.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import importlib
import io
import json
import secrets
import shutil
import zlib
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.kernel.store import Row, RowStore, sole_writer
from chauffeur.bench.personalization.protocol import (
    PROTOCOL_VERSION,
    PeopleArm,
    PlannedTrip,
    Protocol,
    make_protocol,
)
from chauffeur.concept import ConfigError, DataError, MissingExtraError
from chauffeur.concept.data import parse_json
from chauffeur.drive.files import publish

CONSENT: Final = """# Information and consent (edit this text before you use it)

You take part in a study of how a driving system understands what passengers want. You make {trips} short trips in
{kind}. In each you tell the car what you want; you may take over, or say stop, at any time and for any reason.

- What is recorded: what you say to the car, how the car drives, whether you take over, your rating and your remarks.
- Under which name: a pseudonym. The list of names and pseudonyms is kept apart, by [who], until [when].
- Which system drives is not told during the study, to you or to the person who asks you.
- You may end the study at any time without a reason, and have everything that was recorded of you erased: ask for it.
- Contact: [name, address]. Ethics approval: [body, number].

I have read this and take part of my own free will.

Place, date, signature: ______________________________
"""
_PLAN, _KEY, _CONSENT, _RECORDS = "plan.json", "key.sealed", "consent.md", "records.jsonl"
_RATINGS: Final = range(1, 8)
_MOST_SAID: Final = 2_000
COLUMNS: Final = (
    "key", "participant", "number", "phase", "block", "task", "ground", "level", "scene", "letter", "when", "takeover",
    "at_s", "rating", "said", "comment",
)  # fmt: skip
"""Of an export."""


@dataclass(frozen=True, slots=True)
class StudyStanding:
    """How far a study is.

    Attributes:
        planned, recorded: Trips.
        consented, withdrawn: Participants.
    """

    planned: int
    recorded: int
    consented: tuple[str, ...]
    withdrawn: tuple[str, ...]


class PeopleStudy:
    """A study in a folder."""

    def __init__(self, folder: Path) -> None:
        """Open one.

        Raises:
            DataError: There is none, or its plan is damaged or of another version.
        """
        self.folder = folder
        plan = _read_json(folder / _PLAN)
        if plan.get("version") != PROTOCOL_VERSION:
            raise DataError(
                f"{folder / _PLAN} is of version {plan.get('version')!r}, not {PROTOCOL_VERSION!r}.",
                hint="Use the Chauffeur it was made with.",
            )
        try:
            self._trips = tuple(PlannedTrip(**trip) for trip in plan["trips"])
            self._commitment = str(plan["key_sha256"])
        except (KeyError, TypeError) as error:
            raise DataError(f"{folder / _PLAN} is damaged: {error}.") from error
        self._store = RowStore(folder / _RECORDS, "key")

    @classmethod
    def create(cls, folder: Path, participants: int, seed: int | None, learning: int) -> PeopleStudy:
        """Plan a study in a folder that holds none.

        Args:
            folder: Where.
            participants: How many people.
            seed: Draws the plan; whoever knows it can draw the key again, so None takes one that nobody knows.
            learning: Trips in each scenario from which the memory learns.

        Raises:
            ConfigError: The folder holds a study, or the numbers make none.
            StorageError, DataError: The folder cannot be written.
        """
        drawn = secrets.randbits(60) if seed is None else seed
        protocol = make_protocol(participants, drawn, learning)
        with sole_writer(folder):
            if (folder / _PLAN).exists():
                raise ConfigError(f"{folder} holds a study already.", hint="Choose another folder, or go on with it.")
            key = _sealed(protocol, drawn)
            publish(folder / _KEY, key, "key")
            (folder / _KEY).chmod(0o600)
            plan = {
                "version": PROTOCOL_VERSION,
                "participants": participants,
                "learning": learning,
                "made": _now(),
                "key_sha256": hashlib.sha256(key).hexdigest(),
                "trips": [asdict(trip) for trip in protocol.trips],
            }
            each = len(protocol.trips) // participants
            consent = CONSENT.format(trips=each, kind="[a simulator / a vehicle on a closed track]")
            if not (folder / _CONSENT).exists():
                publish(folder / _CONSENT, consent.encode(), "consent text")
            publish(folder / _PLAN, (json.dumps(plan, indent=1) + "\n").encode(), "plan")
        return cls(folder)

    # What there is to do ----------------------------------------------------------------------------------------------

    @property
    def participants(self) -> tuple[str, ...]:
        """Pseudonyms."""
        return tuple(dict.fromkeys(trip.participant for trip in self._trips))

    def trips_of(self, participant: str) -> tuple[PlannedTrip, ...]:
        """Planned trips of one person. Raises ConfigError for a pseudonym that is none of this study."""
        if participant not in self.participants:
            raise ConfigError(
                f"There is no participant {participant!r} in this study.",
                hint=f"They are called {self.participants[0]} to {self.participants[-1]}.",
            )
        return tuple(trip for trip in self._trips if trip.participant == participant)

    def trip(self, participant: str, number: int) -> PlannedTrip:
        """One planned trip. Raises ConfigError where there is none."""
        trips = self.trips_of(participant)
        if not 1 <= number <= len(trips):
            raise ConfigError(f"{participant} makes {len(trips)} trips; there is no trip {number}.")
        return trips[number - 1]

    def next_trip(self, participant: str = "") -> PlannedTrip | None:
        """The first trip that is not recorded; of one person, or of the first who has one. None when all are."""
        names = (participant,) if participant else self.participants
        gone = self.standing().withdrawn
        for name in names:
            trips = self.trips_of(name)
            if name in gone:
                continue
            for trip in trips:
                if trip.key not in self._store.rows:
                    return trip
        return None

    def standing(self) -> StudyStanding:
        """How far it is."""
        rows = self._store.rows
        marks = [row for row in rows.values() if "mark" in row]
        return StudyStanding(
            len(self._trips),
            sum(trip.key in rows for trip in self._trips),
            tuple(sorted(row["participant"] for row in marks if row["mark"] == "consented")),
            tuple(sorted(row["participant"] for row in marks if row["mark"] == "withdrawn")),
        )

    # What is written --------------------------------------------------------------------------------------------------

    def consent(self, participant: str) -> None:
        """Note that somebody has signed. Raises ConfigError for a stranger, or who has withdrawn."""
        self.trips_of(participant)
        self._here(participant)
        self._append({"key": f"{participant}.consent", "participant": participant, "mark": "consented", "when": _now()})

    def record(
        self,
        participant: str,
        number: int,
        *,
        takeover: bool,
        rating: int | None = None,
        at_s: float | None = None,
        said: str = "",
        comment: str = "",
    ) -> Row:
        """Keep what came of a trip; a second record of the same trip corrects the first, which stays in the journal.

        Args:
            participant, number: Which trip.
            takeover: Whether the person took over.
            rating: 1 (bad) to 7 (good).
            at_s: When they took over, since the trip began.
            said: What they asked the car for.
            comment: What they said afterwards.

        Raises:
            ConfigError: No such trip, no consent yet, somebody who withdrew, or a value that cannot be.
        """
        trip = self.trip(participant, number)
        self._here(participant)
        if participant not in self.standing().consented:
            raise ConfigError(
                f"{participant} has not consented yet.",
                hint=f"After they have signed: chauffeur study consent {self.folder} --participant {participant}",
            )
        if rating is not None and rating not in _RATINGS:
            raise ConfigError(f"A rating is a number from {_RATINGS[0]} to {_RATINGS[-1]}, not {rating}.")
        if at_s is not None and not 0.0 <= at_s < 86_400.0:
            raise ConfigError(f"{at_s:g} s is no time into a trip.")
        if at_s is not None and not takeover:
            raise ConfigError("A time of taking over needs a takeover.", hint="Add --takeover, or leave out --at.")
        if max(len(said), len(comment)) > _MOST_SAID:
            raise ConfigError(f"Words and comments have at most {_MOST_SAID} characters.")
        row: Row = {**asdict(trip), "key": trip.key, "when": _now(), "takeover": takeover}
        row |= {"at_s": at_s, "rating": rating, "said": said, "comment": comment}
        self._append(row)
        return row

    def withdraw(self, participant: str) -> int:
        """Erase a person: records, trips and profile; how many records there were. Only the pseudonym stays, so that
        the plan goes on without them.

        Raises:
            ConfigError: No such participant.
        """
        self.trips_of(participant)
        with sole_writer(self.folder):
            self._store.close()
            path = self.folder / _RECORDS
            kept: list[bytes] = []
            erased = 0
            for line in path.read_bytes().splitlines(keepends=True) if path.exists() else ():
                if f'"{participant}"'.encode() in line or f'"{participant}.'.encode() in line:
                    erased += b'"takeover"' in line
                else:
                    kept.append(line)
            if path.exists():
                publish(path, b"".join(kept), "journal")
            path.with_name(f"{path.name}.damaged").unlink(missing_ok=True)  # nobody can tell whose lines are in it
            (self.folder / "results.jsonl").unlink(missing_ok=True)  # of an earlier unblinding
            shutil.rmtree(self.trips_folder / participant, ignore_errors=True)
            self.memory().erase(self.person(participant))
            self._store = RowStore(path, "key")
        mark = {"key": f"{participant}.withdrawn", "participant": participant, "mark": "withdrawn", "when": _now()}
        self._append(mark)
        return erased

    def _here(self, participant: str) -> None:
        if participant in self.standing().withdrawn:
            raise ConfigError(f"{participant} has withdrawn.", hint="Nothing more is kept of them.")

    def _append(self, row: Row) -> None:
        with sole_writer(self.folder):
            self._store.append(row)
            self._store.close()

    # What drives ------------------------------------------------------------------------------------------------------

    @property
    def trips_folder(self) -> Path:
        """Recorded drives, a folder a person."""
        return self.folder / "trips"

    def memory(self) -> Any:
        """Where the learning system keeps profiles: in this folder, apart from those of the installation."""
        from chauffeur.memory.privacy import Privacy
        from chauffeur.memory.vault import VaultMemory

        return VaultMemory(self.folder / "profiles", privacy=Privacy(None))

    def person(self, participant: str) -> Any:
        """Whose profile it is."""
        from chauffeur.concept import PersonId

        return PersonId(participant)

    def system(self, trip: PlannedTrip) -> PeopleArm:
        """Which system a trip is made with. For what drives, and for `unblind`; nobody else needs to know.

        Raises:
            DataError: The key is missing, damaged, or not the one the study was planned with.
        """
        return self._key()[trip.participant, trip.letter]

    # What comes out ---------------------------------------------------------------------------------------------------

    def rows(self) -> list[Row]:
        """Recorded trips in code letters, in the order of the plan."""
        return [
            {name: self._store.rows[trip.key].get(name) for name in COLUMNS}
            for trip in self._trips
            if trip.key in self._store.rows
        ]

    def unblinded(self, *, early: bool = False) -> list[Row]:
        """Recorded trips with the systems behind the letters, as the simulated study has them.

        Raises:
            ConfigError: Trips are missing, and `early` was not asked for.
            DataError: The key does not fit.
        """
        left = self.next_trip()
        if left is not None and not early:
            raise ConfigError(
                f"Trip {left.number} of {left.participant} is not recorded: unblinding now would spoil the study.",
                hint="Go on, or add --early, which is written down.",
            )
        key = self._key()
        self._append({"key": f"unblinded.{_now()}", "participant": "", "mark": "unblinded", "early": early})
        found: list[Row] = []
        for row in self.rows():
            arm = key[row["participant"], row["letter"]]
            found.append(
                {**row, "passenger": row["participant"], "arm": arm, "trip": row["block"], "topic": row["comment"]}
            )
        return found

    def _key(self) -> dict[tuple[str, str], PeopleArm]:
        path = self.folder / _KEY
        try:
            content = path.read_bytes()
        except OSError as error:
            raise DataError(f"The sealed key {path} cannot be read: {error.strerror or error}.") from error
        if hashlib.sha256(content).hexdigest() != self._commitment:
            raise DataError(
                f"{path} is not the key this study was planned with.", hint="Restore it from a copy; do not edit it."
            )
        return {
            (name, letter): arm
            for name, letter, arm in json.loads(zlib.decompress(base64.b85decode(content)))["letters"]
        }


def csv_text(rows: Iterable[Row]) -> str:
    """Rows as CSV with a head; cells that a spreadsheet would take for a formula get an apostrophe."""
    stream = io.StringIO(newline="")
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: _harmless(value) for name, value in row.items() if name in COLUMNS} for row in rows)
    return stream.getvalue()


def write_parquet(path: Path, rows: list[Row]) -> None:
    """Rows as Parquet.

    Raises:
        MissingExtraError: pyarrow is missing.
        DataError: The file cannot be written.
    """
    try:
        arrow: Any = importlib.import_module("pyarrow")
        tables: Any = importlib.import_module("pyarrow.parquet")
    except ImportError as error:
        raise MissingExtraError("Parquet needs pyarrow.", hint="Run: pip install 'chauffeur[tables]'") from error
    schema = arrow.schema([(name, getattr(arrow, _COLUMN_TYPES.get(name, "string"))()) for name in COLUMNS])
    stream = io.BytesIO()
    tables.write_table(arrow.Table.from_pylist(rows, schema=schema), stream)
    publish(path, stream.getvalue(), "table")


_COLUMN_TYPES: Final = {"number": "int32", "block": "int32", "takeover": "bool_", "at_s": "float64", "rating": "int32"}


def _harmless(value: object) -> object:
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r"):
        return f"'{value}"
    return value


def _sealed(protocol: Protocol, seed: int) -> bytes:
    """The key and the seed, in a form nobody reads by accident; salted, so that the hash in the plan tells nothing."""
    letters = [[name, letter, arm] for (name, letter), arm in protocol.letters.items()]
    text = json.dumps({"letters": letters, "seed": seed, "salt": secrets.token_hex(16)})
    return base64.b85encode(zlib.compress(text.encode()))


def _read_json(path: Path) -> dict[str, Any]:
    try:
        found = parse_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(
            f"There is no study in {path.parent}: {error.strerror or error}.",
            hint=f"Plan one: chauffeur study new {path.parent} --participants 30",
        ) from error
    except ValueError as error:
        raise DataError(f"{path} is damaged: {error}.") from error
    if not isinstance(found, dict):
        raise DataError(f"{path} holds no plan.")
    return found


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
