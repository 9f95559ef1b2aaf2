"""A whole trip as one MCAP file: what was wished, planned, checked, seen, commanded and said.

The file is lossless: `read_trip(write_trip(...))` gives the same values, floats bit for bit, so that a recorded trip
can be driven again and compared. It carries simulated time only, so the same trip gives the same bytes. Lanes are
stored once, per-tick values as JSON in zstd chunks. A frame's parts share its index as MCAP `sequence`.

Values typed `Any` in the nouns (provenance, scenario mappings) are JSON values: there a tuple comes back as a list.
"""

from __future__ import annotations

import io
import json
import math
import struct
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, cast

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from pydantic import TypeAdapter

from chauffeur.concept import (
    DataError,
    Frame,
    LaneView,
    Scenario,
    Snapshot,
    SystemMessage,
    Trip,
)
from chauffeur.drive import mcap_schemas as channels
from chauffeur.drive.files import publish
from chauffeur.drive.foxglove import ego_transform, nanoseconds, scene_update

FORMAT = 1
"""Version of the file layout; a reader refuses newer ones."""

_PROFILE = "chauffeur"
_METADATA = "chauffeur.recording"
_CHUNK_BYTES = 4 << 20
_MAX_BYTES = 1 << 30

_UNREADABLE = (
    McapError,
    ArithmeticError,
    LookupError,
    MemoryError,
    RecursionError,
    TypeError,
    ValueError,
    struct.error,
)
"""What the MCAP, JSON and value readers raise on damaged bytes."""

_system = TypeAdapter(SystemMessage)
_scenario = TypeAdapter(Scenario)
_trip = TypeAdapter(Trip)
_lanes = TypeAdapter(tuple[LaneView, ...])
_snapshot = TypeAdapter(Snapshot)
_frame = TypeAdapter(Frame)

_OWN_CHANNEL = {"instruction", "context", "history", "plan", "verdicts"}


@dataclass(frozen=True, slots=True)
class RecordedTrip:
    """A trip with everything needed to show it, or to drive it again.

    Attributes:
        trip: What was wished, planned and came of it.
        frames: One per control period; empty when nothing was driven.
        scenario: The start situation.
        system: S as the planner got it, where it is kept.
        final: The instant after the last command, where a collision first shows.
    """

    trip: Trip
    frames: tuple[Frame, ...]
    scenario: Scenario
    system: SystemMessage | None = None
    final: Snapshot | None = None


@dataclass(frozen=True, slots=True)
class Difference:
    """The first place where two trips differ.

    Attributes:
        tick: Control period, or None when the difference is not in a frame.
        field: Path of the value, e.g. `snapshot.ego.speed_mps`.
        first: Value in the first trip, as text.
        second: Value in the second.
    """

    tick: int | None
    field: str
    first: str
    second: str

    def __str__(self) -> str:
        where = "" if self.tick is None else f"tick {self.tick}, "
        return f"{where}{self.field}: {self.first} against {self.second}"


def write_trip(
    path: Path,
    trip: Trip,
    frames: tuple[Frame, ...] | list[Frame],
    scenario: Scenario,
    *,
    system: SystemMessage | None = None,
    final: Snapshot | None = None,
) -> Path:
    """Write one recording; the file appears whole or not at all.

    Args:
        path: The `.mcap` file; its folder is made if need be.
        trip: The trip.
        frames: Its control periods, in order.
        scenario: The start situation, JSON values only.
        system: S, if it should be kept.
        final: The instant after the last command.

    Raises:
        DataError: The folder cannot be written, or a value is not storable.
    """
    stream = io.BytesIO()
    try:
        _write(Writer(stream, _CHUNK_BYTES, CompressionType.ZSTD), trip, frames, scenario, system, final)
    except (TypeError, ValueError) as error:
        raise DataError(f"The trip holds a value that a recording cannot store: {error}.") from error
    return publish(path, stream.getvalue(), "trip")


def read_trip(path: Path) -> RecordedTrip:
    """Read a recording.

    Raises:
        DataError: The file is missing, damaged, not a recorded trip, or of a newer format.
    """
    try:
        return _read(path, _content(path))
    except DataError:
        raise
    except _UNREADABLE as error:
        raise _damaged(path, _first_line(error)) from error
    except Exception as error:
        # The decompressors raise their own types, and import nothing common to catch them by.
        if type(error).__module__.split(".")[0] in {"zstandard", "zstd", "lz4", "mcap"}:
            raise _damaged(path, _first_line(error)) from error
        raise


def compare_trips(first: RecordedTrip, second: RecordedTrip) -> Difference | None:
    """The first difference between two drives, or None if they are the same bit for bit.

    Compared are the frames, the final instant, outcome, metrics and what was said. Latencies, versions and other
    provenance may differ between equal drives.
    """
    for index, (one, other) in enumerate(zip(first.frames, second.frames, strict=False)):
        if (found := _difference(one, other)) is not None:
            return Difference(index, *found)
    if len(first.frames) != len(second.frames):
        shared = min(len(first.frames), len(second.frames))
        return Difference(shared, "number of frames", str(len(first.frames)), str(len(second.frames)))
    pairs: tuple[tuple[str, Any, Any], ...] = (
        ("final", first.final, second.final),
        ("outcome", first.trip.outcome, second.trip.outcome),
        ("metrics", first.trip.metrics, second.trip.metrics),
        ("duration_s", first.trip.duration_s, second.trip.duration_s),
        ("said", first.trip.said, second.trip.said),
    )
    for name, one, other in pairs:
        if (found := _difference(one, other, name)) is not None:
            return Difference(None, *found)
    return None


def _write(
    writer: Writer,
    trip: Trip,
    frames: tuple[Frame, ...] | list[Frame],
    scenario: Scenario,
    system: SystemMessage | None,
    final: Snapshot | None,
) -> None:
    writer.start(profile=_PROFILE)
    ids: dict[str, int] = {}
    for channel in channels.CHANNELS:
        schema = writer.register_schema(channel.schema_name, "jsonschema", json.dumps(channel.schema).encode())
        ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)

    def put(channel: channels.Channel, payload: Any, log_time: int = 0, sequence: int = 0) -> None:
        data = json.dumps(payload, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        writer.add_message(ids[channel.topic], log_time, data, log_time, sequence)

    whole = _trip.dump_python(trip)
    put(channels.INSTRUCTION, _storable(whole["instruction"]))
    put(channels.CONTEXT, _storable(whole["context"]))
    if system is not None:
        put(channels.SYSTEM, _system.dump_python(system, mode="json"))
    put(channels.HISTORY, _storable(whole["history"]))
    put(channels.PLAN, _storable(whole["plan"]))
    put(channels.VERDICTS, {"verdicts": whole["verdicts"]})
    put(channels.SCENARIO, _scenario.dump_python(scenario))
    put(channels.TRIP, _storable({key: value for key, value in whole.items() if key not in _OWN_CHANNEL}))

    snapshots = [frame.snapshot for frame in frames] + ([final] if final is not None else [])
    lanes: tuple[LaneView, ...] | None = None
    for index, snapshot in enumerate(snapshots):
        time = nanoseconds(snapshot.time_s)
        new_road = snapshot.lanes is not lanes and snapshot.lanes != lanes
        if new_road:
            lanes = snapshot.lanes
            put(channels.LANES, {"lanes": _storable(_lanes.dump_python(lanes, mode="json"))}, time, index)
        payload = _snapshot.dump_python(snapshot, mode="json", exclude={"lanes"})
        put(channels.SNAPSHOT, _storable(payload), time, index)
        put(channels.SCENE, _storable(scene_update(snapshot, with_road=new_road)), time, index)
        put(channels.TRANSFORM, _storable(ego_transform(snapshot)), time, index)
    for index, frame in enumerate(frames):
        time = nanoseconds(frame.snapshot.time_s)
        parts = _storable(_frame.dump_python(frame, mode="json", exclude={"snapshot"}))
        parts["wishes"]["served_stops"].sort()
        put(channels.WISHES, parts["wishes"], time, index)
        put(channels.COMMAND, {name: parts[name] for name in ("requested", "applied", "interventions")}, time, index)
        program = {"state": parts["program"], "line": parts["line"], "calls": parts["calls"]}
        put(channels.PROGRAM, program, time, index)
        for text in frame.said:
            put(channels.SAID, {"text": text}, time, index)
    # Counts let a reader tell a whole recording from one whose tail was lost and re-indexed by a repair tool.
    writer.add_metadata(_METADATA, {"format": str(FORMAT), "frames": str(len(frames)), "final": str(final is not None)})
    writer.finish()


def _storable(value: Any) -> Any:
    """JSON has no NaN or infinity: they travel as text, which the typed reader turns back into floats."""
    if isinstance(value, float):
        if math.isfinite(value):
            return value
        return "NaN" if math.isnan(value) else ("Infinity" if value > 0 else "-Infinity")
    if isinstance(value, dict):
        return {key: _storable(item) for key, item in cast("dict[str, Any]", value).items()}
    if isinstance(value, list | tuple):
        return [_storable(item) for item in cast("list[Any]", value)]
    return value


def _read(path: Path, stream: io.BytesIO) -> RecordedTrip:
    reader = make_reader(stream, validate_crcs=True)
    if reader.get_header().profile != _PROFILE:
        raise DataError(
            f"{path} is an MCAP file, but not a recorded trip of Chauffeur.",
            hint="Record one with `chauffeur drive --save DIR`.",
        )
    facts: dict[str, str] = {}
    for record in reader.iter_metadata():
        if record.name == _METADATA:
            facts = record.metadata
    if not facts:
        raise _damaged(path, "its closing record is missing")
    if int(facts["format"]) > FORMAT:
        raise DataError(
            f"{path} has recording format {facts['format']}; this Chauffeur reads up to {FORMAT}.",
            hint="Upgrade: pip install -U chauffeur",
        )
    wanted = [c.topic for c in channels.CHANNELS if c not in (channels.SCENE, channels.TRANSFORM)]
    messages: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in wanted}
    for _, channel, message in reader.iter_messages(topics=wanted, log_time_order=False):
        messages[channel.topic].append((message.sequence, json.loads(message.data)))

    def single(channel: channels.Channel) -> Any:
        found = messages[channel.topic]
        if len(found) != 1:
            raise _damaged(path, f"{channel.topic} has {len(found)} messages, expected 1")
        return found[0][1]

    trip = _trip.validate_python(
        {
            **single(channels.TRIP),
            "instruction": single(channels.INSTRUCTION),
            "context": single(channels.CONTEXT),
            "history": single(channels.HISTORY),
            "plan": single(channels.PLAN),
            "verdicts": single(channels.VERDICTS)["verdicts"],
        }
    )
    snapshots = _read_snapshots(messages)
    count, has_final = int(facts["frames"]), facts["final"] == "True"
    parts = (channels.WISHES, channels.COMMAND, channels.PROGRAM)
    if len(snapshots) != count + has_final or any(len(messages[c.topic]) != count for c in parts):
        raise _damaged(path, f"it should hold {count} control periods and does not")
    system = [_system.validate_python(payload) for _, payload in messages[channels.SYSTEM.topic]]
    return RecordedTrip(
        trip=trip,
        frames=_read_frames(messages, snapshots[:count]),
        scenario=_scenario.validate_python(single(channels.SCENARIO)),
        system=system[0] if system else None,
        final=snapshots[count] if has_final else None,
    )


def _content(path: Path) -> io.BytesIO:
    """The whole file: a damaged length field then meets the end of the data, not a gigantic allocation."""
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise _damaged(path, f"it is larger than {_MAX_BYTES} bytes")
        return io.BytesIO(path.read_bytes())
    except FileNotFoundError as error:
        raise DataError(f"There is no recording at {path}.", hint="Check the path.") from error
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}.") from error


def _read_snapshots(messages: dict[str, list[tuple[int, Any]]]) -> list[Snapshot]:
    roads = {index: _lanes.validate_python(road["lanes"]) for index, road in messages[channels.LANES.topic]}
    lanes: tuple[LaneView, ...] = ()
    snapshots: list[Snapshot] = []
    for index, payload in messages[channels.SNAPSHOT.topic]:
        lanes = roads.get(index, lanes)
        snapshots.append(replace(_snapshot.validate_python({**payload, "lanes": ()}), lanes=lanes))
    return snapshots


def _read_frames(messages: dict[str, list[tuple[int, Any]]], snapshots: list[Snapshot]) -> tuple[Frame, ...]:
    said: dict[int, list[str]] = {}
    for index, payload in messages[channels.SAID.topic]:
        said.setdefault(index, []).append(payload["text"])
    frames: list[Frame] = []
    for index, snapshot in enumerate(snapshots):
        wishes = messages[channels.WISHES.topic][index][1]
        command = messages[channels.COMMAND.topic][index][1]
        program = messages[channels.PROGRAM.topic][index][1]
        frames.append(
            _frame.validate_python(
                {
                    "snapshot": snapshot,
                    "wishes": wishes,
                    **command,
                    "program": program["state"],
                    "line": program["line"],
                    "said": said.get(index, ()),
                    "calls": program["calls"],
                }
            )
        )
    return tuple(frames)


def _damaged(path: Path, why: str) -> DataError:
    return DataError(f"{path} is not a usable recording: {why}.", hint="Record the trip again.")


def _first_line(error: Exception) -> str:
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__


def _difference(one: Any, other: Any, path: str = "") -> tuple[str, str, str] | None:
    """(path, first, second) of the first unequal value; floats are compared exactly, and NaN equals NaN."""
    if one is other:
        return None
    if isinstance(one, float) and isinstance(other, float):
        return None if one.hex() == other.hex() else (path, repr(one), repr(other))
    if type(one) is not type(other):
        # A whole number read from JSON is an int; where the nouns say float it is the same value.
        numbers = {type(one), type(other)} == {int, float}
        return None if numbers and one == other else (path, repr(one), repr(other))
    if is_dataclass(one):
        for field in fields(one):
            inner = f"{path}.{field.name}" if path else field.name
            if (found := _difference(getattr(one, field.name), getattr(other, field.name), inner)) is not None:
                return found
        return None
    if isinstance(one, tuple | list):
        left, right = cast("tuple[Any, ...]", one), cast("tuple[Any, ...]", other)
        if len(left) != len(right):
            return f"{path}.length", str(len(left)), str(len(right))
        for index, (a, b) in enumerate(zip(left, right, strict=True)):
            if (found := _difference(a, b, f"{path}[{index}]")) is not None:
                return found
        return None
    return None if one == other else (path, repr(one), repr(other))
