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
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, cast

import zstandard
from google.protobuf.message import Message as Drawing
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, DataEnd, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema
from pydantic import TypeAdapter

from chauffeur.concept import (
    CameraImage,
    DataError,
    Frame,
    Lane,
    Observation,
    ParkingLot,
    Scenario,
    SystemMessage,
    Trip,
)
from chauffeur.driving import foxglove
from chauffeur.driving import mcap_schemas as channels
from chauffeur.driving.cut_off import CutFile, cut_file, whole_records
from chauffeur.driving.files import publish
from chauffeur.geometry import Polyline, RoadGraph

FORMAT = 3
"""Version of the file layout. 2 is read as well: there a road said whether y grew to the right of +x, and with it the
headings and steering of all on it. 1, which is refused, had lanes by their nodes, without a road graph."""
_WITH_SIDES = 2

_PROFILE = "chauffeur"
_METADATA = "chauffeur.recording"
_CHUNK_BYTES = 4 << 20
_MESSAGE_HEAD_BYTES = 31
_SCHEMAS_BYTES = 1 << 16
"""Schemas and channels take less in a chunk."""

# A recording may come from anybody, and a few kilobytes can unpack to gigabytes. What is written keeps the same bounds.
_MAX_BYTES = 128 << 20
_MAX_CHUNK_BYTES = 32 << 20
_MAX_UNPACKED_BYTES = 512 << 20
_MAX_VALUES = 16_000_000
"""JSON values of all messages: ten minutes of a town at 20 Hz among a hundred cars and people, the longest drive that
ends by itself. A value of two bytes becomes an object of a hundred."""

_UNREADABLE = (
    McapError,
    zstandard.ZstdError,
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
_lane = TypeAdapter(Lane)
_points = TypeAdapter(tuple[tuple[float, float], ...])
_lot: TypeAdapter[ParkingLot | None] = TypeAdapter(ParkingLot | None)
_observation = TypeAdapter(Observation)
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
        view: What the front camera showed when the drive was planned, where the planner looked; not in the recording.
        cut_off: Whether it was read from a file that ends before the drive does: `frames` are those that stand in it.
    """

    trip: Trip
    frames: tuple[Frame, ...] = field(repr=False)  # asyncio writes out what a task gave when it restores Ctrl-C
    scenario: Scenario
    system: SystemMessage | None = field(default=None, repr=False)
    final: Observation | None = field(default=None, repr=False)
    view: CameraImage | None = field(default=None, repr=False)
    cut_off: bool = False

    @property
    def note(self) -> str:
        """What the reader has to know of the file, in words; empty for a whole one."""
        if not self.cut_off:
            return ""
        first, last = (self.frames[at].observation.time_s for at in (0, -1))
        return f"The recording was cut off; {last - first:.1f} s of {self.trip.duration_s:.1f} s can be read."


@dataclass(frozen=True, slots=True)
class Difference:
    """The first place where two trips differ.

    Attributes:
        tick: Control period, or None when the difference is not in a frame.
        field: Path of the value, e.g. `observation.ego.speed_mps`.
        first: Value in the first trip, as text.
        second: Value in the second.
        time_s: Simulated time of that control period.
    """

    tick: int | None
    field: str
    first: str
    second: str
    time_s: float | None = None

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
    final: Observation | None = None,
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
        DataError: The folder cannot be written, a value is not storable, or the trip is too long to be read again.
    """
    stream = io.BytesIO()
    try:
        _write(Writer(stream, _CHUNK_BYTES, CompressionType.ZSTD), trip, frames, scenario, system, final)
    except (TypeError, ValueError) as error:
        raise DataError(f"The trip cannot be stored as a recording: {_first_line(error)}.") from error
    if stream.tell() > _MAX_BYTES:
        raise DataError(f"The trip cannot be stored as a recording: it has more than {_MAX_BYTES} bytes.")
    return publish(path, stream.getvalue(), "trip")


def read_trip(path: Path) -> RecordedTrip:
    """Read a recording; of one that was cut off, what stands in it.

    Raises:
        DataError: The file is missing, damaged, cut off before the drive, not a recorded trip, or of a newer format.
    """
    try:
        content = _content(path)
        return _read(path, content, cut_file(content))
    except DataError:
        raise
    except _UNREADABLE as error:
        raise _damaged(path, _first_line(error)) from error


def read_head(path: Path) -> RecordedTrip:
    """Read what a recording says of its trip, without the drive: `frames` is empty.

    Raises:
        DataError: As `read_trip`; damage further behind is not seen.
    """
    wanted = {channel.topic for channel in _HEAD}
    heads: dict[str, Any] = {}
    topics: dict[int, str] = {}
    budget = _Budget()
    try:
        content = _content(path)
        for record in _records(path, content, cut_file(content), budget):
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message) and (topic := topics[record.channel_id]) in wanted:
                budget.spend(record.data)
                heads[topic] = json.loads(record.data)
            if len(heads) == len(wanted):
                break
        if len(heads) < len(wanted):
            raise _cut_early(path)
        trip = _joined(lambda channel: heads[channel.topic])
        return RecordedTrip(trip, (), _scenario.validate_python(heads[channels.SCENARIO.topic]))
    except DataError:
        raise
    except _UNREADABLE as error:
        raise _damaged(path, _first_line(error)) from error


def compare_trips(first: RecordedTrip, second: RecordedTrip) -> Difference | None:
    """The first difference between two drives, or None if they are the same bit for bit.

    Compared are the frames, the final instant, outcome, metrics and what was said. Latencies, versions and other
    provenance may differ between equal drives. Of a recording that was cut off, the frames that it holds are compared.
    """
    for index, (one, other) in enumerate(zip(first.frames, second.frames, strict=False)):
        if (found := _difference(one, other)) is not None:
            return Difference(index, *found, time_s=one.observation.time_s)
    if first.cut_off or second.cut_off:
        return None
    if len(first.frames) != len(second.frames):
        shared = min(len(first.frames), len(second.frames))
        longer = max(first.frames, second.frames, key=len)
        counts = str(len(first.frames)), str(len(second.frames))
        return Difference(shared, "number of frames", *counts, time_s=longer[shared].observation.time_s)
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
    final: Observation | None,
) -> None:
    writer.start(profile=_PROFILE)
    # Counts let a reader tell a whole recording from one whose tail was lost and re-indexed by a repair tool.
    writer.add_metadata(_METADATA, {"format": str(FORMAT), "frames": str(len(frames)), "final": str(final is not None)})
    ids: dict[str, int] = {}
    for channel in channels.CHANNELS:
        schema = writer.register_schema(channel.schema_name, "jsonschema", json.dumps(channel.schema).encode())
        ids[channel.topic] = writer.register_channel(channel.topic, "json", schema)
    for topic, message in foxglove.MESSAGES.items():
        ids[topic] = writer.register_channel(topic, "protobuf", register_schema(writer, message))

    budget = _Budget()

    def draw(topic: str, message: Drawing, log_time: int, sequence: int) -> None:
        data = message.SerializeToString(deterministic=True)
        budget.pack(data)
        writer.add_message(ids[topic], log_time, data, log_time, sequence)

    def put(channel: channels.Channel, payload: Any, log_time: int = 0, sequence: int = 0) -> None:
        data = json.dumps(payload, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        budget.pack(data)
        budget.spend(data)
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

    observations = [frame.observation for frame in frames] + ([final] if final is not None else [])
    road: RoadGraph | None = None
    lot: ParkingLot | None = None
    for index, observation in enumerate(observations):
        time = foxglove.nanoseconds(observation.time_s)
        new_road = road is None or observation.road != road or observation.lot != lot
        road, lot = observation.road, observation.lot
        if new_road:
            put(
                channels.LANES,
                {
                    "lanes": [_stored(lane) for lane in road.lanes],
                    "lot": _storable(_lot.dump_python(lot, mode="json")),
                },
                time,
                index,
            )
        payload = _observation.dump_python(observation, mode="json", exclude={"road", "lot"})
        put(channels.OBSERVATION, _storable(payload), time, index)
        if new_road:
            draw("/road", foxglove.road_points(observation), time, index)
        draw("/scene", foxglove.scene_update(observation, with_road=new_road), time, index)
        draw("/vehicles", foxglove.vehicle_points(observation), time, index)
        draw("/tf", foxglove.ego_transform(observation), time, index)
        if index == len(frames):
            continue
        # What was done at an instant stands behind it: of a file that is cut off, the drive up to there can be read.
        frame = frames[index]
        parts = _storable(_frame.dump_python(frame, mode="json", exclude={"observation"}))
        parts["setpoints"]["served_stops"].sort()
        put(channels.WISHES, parts["setpoints"], time, index)
        put(channels.COMMAND, {name: parts[name] for name in ("requested", "applied", "interventions")}, time, index)
        program = {"state": parts["program"], "line": parts["line"], "calls": parts["calls"]}
        put(channels.PROGRAM, program, time, index)
        for text in frame.said:
            put(channels.SAID, {"text": text}, time, index)
            draw("/log", foxglove.said(text, observation.time_s), time, index)
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


def _read(path: Path, content: bytes, cut: CutFile | None) -> RecordedTrip:
    messages: dict[str, list[tuple[int, Any]]] = {channel.topic: [] for channel in channels.CHANNELS}
    topics: dict[int, str] = {}
    facts: dict[str, str] = {}
    budget = _Budget()
    for record in _records(path, content, cut, budget):
        match record:
            case Channel():
                topics[record.id] = record.topic
            case Message() if (into := messages.get(topics[record.channel_id])) is not None:
                budget.spend(record.data)
                into.append((record.sequence, json.loads(record.data)))
            case Metadata(name=name) if name == _METADATA:
                facts = record.metadata
            case _:
                pass
    if not facts and cut is None:
        raise _damaged(path, "its closing record is missing")
    if not facts:
        sides = any("mirrored" in payload for _, payload in messages[channels.LANES.topic])
        facts = {"format": str(_WITH_SIDES if sides else FORMAT)}
    if (found := int(facts["format"])) not in (FORMAT, _WITH_SIDES):
        raise DataError(
            f"{path} has recording format {found}; this Chauffeur reads formats {_WITH_SIDES} and {FORMAT}.",
            hint="Upgrade: pip install -U chauffeur"
            if found > FORMAT
            else "Its road is stored in an older way: read it with the version that wrote it, or drive it again.",
        )

    def single(channel: channels.Channel) -> Any:
        found = messages[channel.topic]
        if not found and cut is not None:
            raise _cut_early(path)
        if len(found) != 1:
            raise _damaged(path, f"{channel.topic} has {len(found)} messages, expected 1")
        return found[0][1]

    trip = _joined(single)
    if found == _WITH_SIDES:
        _turn_sides(messages)
    observations = _read_observations(messages)
    parts = (channels.WISHES, channels.COMMAND, channels.PROGRAM)
    if cut is not None:
        held = min(len(observations), *(len(messages[part.topic]) for part in parts))
        if not held:
            raise _cut_early(path)
        facts = {"frames": str(held), "final": "False"}
        observations = observations[:held]
        for part in parts:
            del messages[part.topic][held:]
    count, has_final = int(facts["frames"]), facts["final"] == "True"
    if len(observations) != count + has_final or any(len(messages[c.topic]) != count for c in parts):
        raise _damaged(path, f"it should hold {count} control periods and does not")
    system = [_system.validate_python(payload) for _, payload in messages[channels.SYSTEM.topic]]
    return RecordedTrip(
        trip=trip,
        frames=_read_frames(messages, observations[:count]),
        scenario=_scenario.validate_python(single(channels.SCENARIO)),
        system=system[0] if system else None,
        final=observations[count] if has_final else None,
        cut_off=cut is not None,
    )


_HEAD = (
    *(channels.TRIP, channels.INSTRUCTION, channels.CONTEXT, channels.HISTORY),
    *(channels.PLAN, channels.VERDICTS, channels.SCENARIO),
)
"""Channels that hold one message, in front of the drive."""


def _joined(payload: Callable[[channels.Channel], Any]) -> Trip:
    """The trip of what its channels hold."""
    return _trip.validate_python(
        {
            **payload(channels.TRIP),
            "instruction": payload(channels.INSTRUCTION),
            "context": payload(channels.CONTEXT),
            "history": payload(channels.HISTORY),
            "plan": payload(channels.PLAN),
            "verdicts": payload(channels.VERDICTS)["verdicts"],
        }
    )


def _records(path: Path, content: bytes, cut: CutFile | None, budget: _Budget) -> Iterator[McapRecord]:
    """Every record of the data from front to back, chunks unpacked.

    The index behind the data is not followed: it could lead to a chunk twice, and a file that was cut off has none.
    """
    stream = io.BytesIO(content if cut is None else cut.whole)
    records = StreamReader(stream, emit_chunks=True, validate_crcs=cut is None).records
    header = next(records)
    if cut is not None and isinstance(header, DataEnd):
        raise _cut_early(path)
    if not isinstance(header, Header) or header.profile != _PROFILE:
        raise DataError(
            f"{path} is an MCAP file, but not a recorded trip of Chauffeur.",
            hint="Record one with `chauffeur drive --save DIR`.",
        )
    for record in records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(budget.unpack(record), validate_crc=True)
        elif isinstance(record, DataEnd):
            break
        else:
            yield record
    if cut is not None and cut.chunk is not None:
        part = budget.unpack(cut.chunk, cut_off=True)
        yield from breakup_chunk(replace(part, data=whole_records(part.data)), validate_crc=False)


class _Budget:
    """How much a recording may still take of the machine; what takes more is refused before it is unpacked."""

    def __init__(self) -> None:
        self._bytes, self._values = _MAX_UNPACKED_BYTES, _MAX_VALUES

    def unpack(self, chunk: Chunk, *, cut_off: bool = False) -> Chunk:
        """The chunk without compression. Raises ValueError: it is too large, or its declared size is not true.

        Args:
            chunk: As it stands in the file.
            cut_off: Whether its end is missing: what unpacks of it is given.
        """
        size = chunk.uncompressed_size
        if size > _MAX_CHUNK_BYTES:
            raise ValueError(f"a chunk would unpack to {size} bytes; {_MAX_CHUNK_BYTES} are the most one may have")
        self._bytes -= size
        if self._bytes < 0:
            raise ValueError(f"it would unpack to more than {_MAX_UNPACKED_BYTES} bytes")
        if chunk.compression == "":
            data = chunk.data
        elif chunk.compression == "zstd":
            # A frame has a size of its own, which may be another one: no more than a byte too many is unpacked of it.
            unpacker = zstandard.ZstdDecompressor(max_window_size=_MAX_CHUNK_BYTES)
            data = unpacker.stream_reader(chunk.data, read_across_frames=True).read(size + 1)
        else:
            raise ValueError(f"a chunk is compressed with {chunk.compression[:20]!r}; a recording's are with 'zstd'")
        if len(data) > size or (len(data) < size and not cut_off):
            raise ValueError(f"a chunk does not unpack to the {size} bytes that it declares")
        return replace(chunk, compression="", data=data)

    def spend(self, message: bytes) -> None:
        """Count a message's values before they are read. Raises ValueError: they are too many."""
        self._values -= 1 + message.count(b",") + message.count(b"[") + message.count(b"{")
        if self._values < 0:
            raise ValueError(f"it holds more than {_MAX_VALUES} values")

    def pack(self, message: bytes) -> None:
        """Count a message that is to be written. Raises ValueError: no reader would take it any more."""
        if len(message) > _MAX_CHUNK_BYTES - _CHUNK_BYTES:
            raise ValueError(f"it holds a message of {len(message)} bytes")
        self._bytes -= len(message) + _MESSAGE_HEAD_BYTES
        if self._bytes < _SCHEMAS_BYTES:
            raise ValueError(f"it has more than {_MAX_UNPACKED_BYTES} bytes")


def _content(path: Path) -> bytes:
    """The whole file: a damaged length field then meets the end of the data, not a gigantic allocation."""
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise _damaged(path, f"it is larger than {_MAX_BYTES} bytes")
        content = path.read_bytes()
    except FileNotFoundError as error:
        raise DataError(f"There is no recording at {path}.", hint="Check the path.") from error
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}.") from error
    if not content:
        raise _damaged(path, "it is empty")
    return content


def _stored(lane: Lane) -> dict[str, Any]:
    """A lane with its middle as points: how far along each is follows from them."""
    plain = _lane.dump_python(lane, mode="json", exclude={"centre"})
    return _storable({**plain, "centre_m": lane.centre.points_m})


_SIDEWAYS = frozenset({"y_m", "heading_rad", "yaw_rate_radps", "steering_rad"})
"""Numbers that change their sign with the side that y grows to."""


def _turn_sides(messages: dict[str, list[tuple[int, Any]]]) -> None:
    """Give what format 2 stored with y to the right of +x the right-handed frame; roads say where they are so."""
    roads = messages[channels.LANES.topic]
    if not any(payload["mirrored"] for _, payload in roads):
        return
    for _, payload in roads:
        for lane in payload["lanes"]:
            lane["centre_m"] = [(x, _other_sign(y)) for x, y in lane["centre_m"]]
        if payload["lot"] is not None:
            _turn(payload["lot"]["spots"])
            payload["lot"]["landmarks"] = [(name, x, _other_sign(y)) for name, x, y in payload["lot"]["landmarks"]]
    for topic in (channels.OBSERVATION.topic, channels.COMMAND.topic):
        for _, payload in messages[topic]:
            _turn(payload)


def _turn(stored: Any) -> None:
    """Change the sign of all numbers of `_SIDEWAYS`, however deep, in place."""
    if isinstance(stored, list):
        for one in cast("list[Any]", stored):
            _turn(one)
    elif isinstance(stored, dict):
        fields_of = cast("dict[str, Any]", stored)
        for name, value in fields_of.items():
            if name in _SIDEWAYS:
                fields_of[name] = _other_sign(value)
            else:
                _turn(value)


def _other_sign(stored: Any) -> float:
    """The negative of a stored number, which may be the text of one that JSON does not have; as worlds change signs,
    zeros stay positive."""
    return 0.0 - float(stored)


def _road_of(stored: list[dict[str, Any]]) -> RoadGraph:
    """The graph of stored lanes. Raises ValueError for a middle that is none, KeyError for a successor that is none."""
    lanes: list[Lane] = []
    for plain in stored:
        centre = Polyline.of(_points.validate_python(plain["centre_m"]))
        empty = {"points_m": (), "stations_m": ()}
        lanes.append(replace(_lane.validate_python({**plain, "centre": empty}), centre=centre))
    road = RoadGraph(tuple(lanes))
    for lane in lanes:
        road.successors(lane.id)
    return road


def _read_observations(messages: dict[str, list[tuple[int, Any]]]) -> list[Observation]:
    roads = {index: _road_of(payload["lanes"]) for index, payload in messages[channels.LANES.topic]}
    lots = {index: _lot.validate_python(payload["lot"]) for index, payload in messages[channels.LANES.topic]}
    road, lot = RoadGraph(()), None
    observations: list[Observation] = []
    for index, payload in messages[channels.OBSERVATION.topic]:
        road, lot = roads.get(index, road), lots.get(index, lot)
        shown = _observation.validate_python({**payload, "road": {"lanes": ()}})
        observations.append(replace(shown, road=road, lot=lot))
    return observations


def _read_frames(messages: dict[str, list[tuple[int, Any]]], observations: list[Observation]) -> tuple[Frame, ...]:
    said: dict[int, list[str]] = {}
    for index, payload in messages[channels.SAID.topic]:
        said.setdefault(index, []).append(payload["text"])
    frames: list[Frame] = []
    for index, observation in enumerate(observations):
        setpoints = messages[channels.WISHES.topic][index][1]
        command = messages[channels.COMMAND.topic][index][1]
        program = messages[channels.PROGRAM.topic][index][1]
        frames.append(
            _frame.validate_python(
                {
                    "observation": observation,
                    "setpoints": setpoints,
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


def _cut_early(path: Path) -> DataError:
    return DataError(
        f"{path} was cut off too early: no instant of the drive stands whole in it.", hint="Copy or record it again."
    )


def _first_line(error: Exception) -> str:
    text = str(error).strip().splitlines()
    return text[0].rstrip(".") if text else type(error).__name__


def _difference(one: Any, other: Any, path: str = "") -> tuple[str, str, str] | None:
    """(path, first, second) of the first unequal value; floats are compared exactly, and NaN equals NaN."""
    if one is other:
        return None
    if isinstance(one, RoadGraph) and one == other:  # the same at every instant: not looked through again and again
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
