"""A recording gives back the same values, bit for bit, and refuses what is not one."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from chauffeur.concept import (
    ApiCall,
    Causes,
    Command,
    Context,
    DataError,
    Feedback,
    Frame,
    History,
    HistoryItem,
    Instruction,
    Lane,
    Lead,
    Metric,
    Observation,
    PersonId,
    Plan,
    Program,
    Scenario,
    Setpoints,
    Situation,
    SystemMessage,
    Thoughts,
    Trip,
    Usage,
    VehicleState,
    Verdict,
)
from chauffeur.driving.foxglove import MESSAGES
from chauffeur.driving.mcap_schemas import CHANNELS, LANES
from chauffeur.driving.recording import RecordedTrip, compare_trips, read_trip, write_trip
from chauffeur.geometry import Polyline, RoadGraph
from roads import a_lane, a_road

numbers = st.floats(allow_nan=False, allow_infinity=False)
any_numbers = st.floats()
texts = st.text(st.characters(exclude_categories=("Cs",)), max_size=30)
lane_ids = texts
vehicles = st.builds(
    VehicleState,
    st.integers(0, 999),
    st.sampled_from(["car", "obstacle", "stop_sign"]),
    *[any_numbers] * 6,
    lane=st.none() | lane_ids,
    crashed=st.booleans(),
)
places = st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
lines = st.lists(places, min_size=2, max_size=4).filter(lambda points: math.dist(points[0], points[1]) > 0.1)
roads = st.lists(
    st.builds(
        Lane,
        lane_ids,
        lines.map(Polyline.of),
        numbers,
        numbers,
        st.sampled_from(["driving", "emergency", "aisle", "parking"]),
        texts,
        st.integers(0, 9),
        st.just(()),
        st.booleans(),
        texts,
        st.sampled_from(["left", "straight", "right"]),
        texts,
    ),
    max_size=3,
).map(lambda lanes: RoadGraph(tuple(lanes)))
observations = st.builds(
    Observation,
    st.floats(0, 1e6),
    st.integers(0, 10**6),
    texts,
    vehicles,
    st.lists(vehicles, max_size=3).map(tuple),
    st.lists(vehicles, max_size=2).map(tuple),
    roads,
    st.none() | st.builds(Lead, st.integers(0, 99), numbers, numbers),
    st.none() | numbers,
    st.booleans(),
    st.booleans(),
)
setpoints = st.builds(
    Setpoints,
    st.none() | any_numbers,
    numbers,
    st.none() | lane_ids,
    st.sampled_from([None, "left", "straight", "right"]),
    st.frozensets(st.integers(0, 99), max_size=3),
)
commands = st.builds(Command, any_numbers, any_numbers)
frames = st.builds(
    Frame,
    observations,
    setpoints,
    commands,
    commands,
    st.sampled_from(["none", "running", "finished", "failed"]),
    st.none() | st.integers(1, 99),
    st.lists(texts, max_size=2).map(tuple),
    st.lists(st.builds(ApiCall, texts, texts, texts), max_size=2).map(tuple),
)


def bits(value: Any) -> Any:
    """A value with its floats as exact text, so that NaN equals itself and -0.0 does not equal 0.0."""
    if isinstance(value, float):
        return value.hex()
    if is_dataclass(value):
        return {field.name: bits(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple | list):
        return [bits(item) for item in value]
    return value


def a_trip(**changes: Any) -> Trip:
    front = Lead(3, 42.0, 22.0)
    trip = Trip(
        id="9f2c",
        instruction=Instruction("Überhol ihn – 快点", PersonId("ana"), "speech"),
        context=Context("C", Situation("highway", 25.0, 31.3, 3, 1, True, front, None, ("left",), (("rain", "no"),))),
        history=History((HistoryItem("1", "2026", "I", "C", "w", "x", "R", "P", (("v", 0.1),), (Feedback("f"),)),)),
        plan=Plan(Thoughts("R"), Program("def f():\n    yield\n"), settings=(("v_mps", 0.1),), usage=Usage(1, 2, 0.3)),
        verdicts=(Verdict("format-v1", True, "fine", 3, "none"),),
        outcome="success",
        causes=Causes(fallback_used=True, detail="d"),
        metrics=(Metric("a-v1", 0.1 + 0.2, "m"), Metric("b-v1", math.nan, "m", False)),
        duration_s=0.1,
        scenario="s",
        seed=10**41,
        said=((0.1, "hello"),),
        record=(("version", "0.1"), ("limits", {"name": "x", "cap": None}), ("n", 10**30)),
    )
    return replace(trip, **changes)


def a_scenario() -> Scenario:
    return Scenario("s", "highway", {"env": {"lanes": [1, 2.5], "seed": 10**42}}, 10**41, {"value": 1}, "wish", "title")


def an_observation(tick: int, lanes: tuple[Lane, ...], *, cars: int = 3) -> Observation:
    def car(number: int) -> VehicleState:
        x, speed = 10.0 * number + math.sin(number + tick) * tick, 20 + math.sin(tick * number)
        return VehicleState(number, "car", x, -4.0, 0.01 * math.cos(tick), speed, 5.0, 2.0, "a-b:1")

    others = tuple(car(number) for number in range(1, cars + 1))
    return Observation(tick / 10, tick, "highway", car(0), others, (), a_road(lanes), None, None, False, False)


def a_drive(ticks: int = 5, cars: int = 3) -> RecordedTrip:
    lanes = tuple(a_lane(f"a-b:{i}", ((0.0, -4.0 * i), (2e3, -4.0 * i)), limit=31.3) for i in (0, 1))
    command = Command(0.1, -0.2)
    taken = tuple(
        Frame(an_observation(t, lanes, cars=cars), Setpoints(), command, command, "running", 1) for t in range(ticks)
    )
    return RecordedTrip(
        a_trip(duration_s=ticks / 10), taken, a_scenario(), SystemMessage("S", "few-shot"), an_observation(ticks, lanes)
    )


def save(path: Path, recorded: RecordedTrip) -> Path:
    return write_trip(
        path, recorded.trip, recorded.frames, recorded.scenario, system=recorded.system, final=recorded.final
    )


def test_a_trip_comes_back_whole(tmp_path: Path) -> None:
    drive = a_drive()
    back = read_trip(save(tmp_path / "deep" / "trip.mcap", drive))
    assert bits(back) == bits(drive)
    assert compare_trips(drive, back) is None
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["trip.mcap"]


@given(st.lists(frames, max_size=4), st.none() | observations)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_frames_come_back_bit_for_bit(tmp_path: Path, taken: list[Frame], final: Observation | None) -> None:
    path = write_trip(tmp_path / "trip.mcap", a_trip(), taken, a_scenario(), final=final)
    back = read_trip(path)
    assert bits(back.frames) == bits(tuple(taken))
    assert bits(back.final) == bits(final)
    assert compare_trips(RecordedTrip(a_trip(), tuple(taken), a_scenario(), final=final), back) is None


def test_the_same_trip_gives_the_same_bytes(tmp_path: Path) -> None:
    first, second = save(tmp_path / "a.mcap", a_drive()), save(tmp_path / "b.mcap", a_drive())
    assert first.read_bytes() == second.read_bytes()


def test_twenty_seconds_among_forty_cars_are_below_a_megabyte(tmp_path: Path) -> None:
    assert save(tmp_path / "trip.mcap", a_drive(200, 40)).stat().st_size < 1_000_000


def test_lanes_are_stored_once_and_shared(tmp_path: Path) -> None:
    path = save(tmp_path / "trip.mcap", a_drive())
    with path.open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    assert topics.count("/lanes") == 1
    back = read_trip(path)
    assert back.final is not None
    assert all(frame.observation.road.lanes is back.final.road.lanes for frame in back.frames)


def test_other_viewers_find_schemas_for_everything(tmp_path: Path) -> None:
    drive = a_drive()
    drive = replace(drive, frames=(replace(drive.frames[0], said=("Überholt – 快点",)), *drive.frames[1:]))
    path = save(tmp_path / "trip.mcap", drive)
    with path.open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        messages = [(schema, channel, m.data) for schema, channel, m in reader.iter_messages()]
    assert summary is not None
    encodings = {c.topic: (c.message_encoding, summary.schemas[c.schema_id]) for c in summary.channels.values()}
    assert set(encodings) == {c.topic for c in CHANNELS} | set(MESSAGES)
    for topic, (encoding, schema) in encodings.items():
        assert (encoding, schema.encoding) == (
            ("protobuf", "protobuf") if topic in MESSAGES else ("json", "jsonschema")
        )
    for schema, channel, data in messages:
        assert schema is not None
        if channel.topic not in MESSAGES:
            assert set(json.loads(data)) <= set(json.loads(schema.data)["properties"]), channel.topic


def drawn(path: Path) -> dict[str, list[Any]]:
    """What a viewer that knows protobuf, and nothing of Chauffeur, reads in a recording: topic -> messages."""
    found: dict[str, list[Any]] = {}
    with path.open("rb") as stream:
        # The decoder builds its classes from the schema records alone.
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages(topics=list(MESSAGES)):
            found.setdefault(channel.topic, []).append(message)
    return found


def points_of(cloud: Any) -> list[tuple[float, float, float]]:
    assert [(f.name, f.offset, f.type) for f in cloud.fields] == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)], "FLOAT32 is 7"
    assert cloud.point_stride == 12
    return list(struct.iter_unpack("<fff", cloud.data))


def test_the_drive_is_drawn_in_foxglove_messages(tmp_path: Path) -> None:
    drive = a_drive()
    drive = replace(drive, frames=(replace(drive.frames[0], said=("Überholt – 快点",)), *drive.frames[1:]))
    found = drawn(save(tmp_path / "trip.mcap", drive))
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/scene": 6, "/tf": 6, "/road": 1, "/vehicles": 6, "/log": 1,
    }  # fmt: skip
    assert {messages[0].DESCRIPTOR.full_name for messages in found.values()} == {
        "foxglove.SceneUpdate", "foxglove.FrameTransform", "foxglove.PointCloud", "foxglove.Log",
    }  # fmt: skip
    first, second = found["/scene"][:2]
    assert [entity.id for entity in first.entities] == ["ego", "traffic", "road", "objects"]
    assert [entity.id for entity in second.entities] == ["ego", "traffic"], "the road is sent once"
    ego, traffic, road, _ = first.entities
    assert (ego.cubes[0].pose.position.x, ego.cubes[0].pose.position.y) == (0.0, -4.0), "y grows to the left"
    assert (ego.cubes[0].size.x, ego.cubes[0].size.y) == (5.0, 2.0)
    assert len(traffic.cubes) == 3
    assert [[(p.x, p.y) for p in line.points] for line in road.lines] == [
        [(0.0, -2.0), (2000.0, -2.0)], [(0.0, 2.0), (2000.0, 2.0)],
        [(0.0, -6.0), (2000.0, -6.0)], [(0.0, -2.0), (2000.0, -2.0)],
    ]  # fmt: skip
    points = points_of(found["/road"][0])
    assert {y for _, y, _ in points} == {2.0, -2.0, -6.0}
    assert len(points) == 3 * 1001, "every two metres, and the edge that two lanes share once"
    transform = found["/tf"][0]
    assert (transform.parent_frame_id, transform.child_frame_id) == ("map", "ego")
    assert math.isclose(2 * math.asin(transform.rotation.z), 0.01, abs_tol=3e-4)
    assert found["/tf"][1].timestamp.ToNanoseconds() == 100_000_000
    outline = points_of(found["/vehicles"][0])[:5]
    assert all(abs(x) <= 3.26 and abs(y + 4.0) <= 1.1 for x, y, _ in outline)
    assert max(outline)[0] > 3.0, "the nose shows where the car is heading"
    assert found["/log"][0].message == "Überholt – 快点"


def test_a_failed_simulation_is_drawn_all_the_same(tmp_path: Path) -> None:
    for wrong in (math.nan, math.inf, -1e308, 1e39):
        body = VehicleState(0, "car", wrong, wrong, wrong, 0.0, wrong, wrong, None)
        lane = a_lane("a-b:0", width=wrong, limit=1.0)
        shot = replace(an_observation(0, (lane,)), ego=body, others=(body,))
        path = write_trip(tmp_path / "trip.mcap", a_trip(), [], a_scenario(), final=shot)
        for x, y, _ in points_of(drawn(path)["/vehicles"][0]):
            assert math.isfinite(x)
            assert math.isfinite(y)


def test_rerun_draws_road_road_users_and_frames_without_help(tmp_path: Path) -> None:
    chunk = pytest.importorskip("rerun.chunk", reason="Rerun is not installed: pip install 'chauffeur[viewer]'")
    drive = a_drive()
    drive = replace(drive, frames=(replace(drive.frames[0], said=("Overtaken.",)), *drive.frames[1:]))
    reader = chunk.McapReader(save(tmp_path / "trip.mcap", drive), timeline_type="duration_ns")
    columns: dict[str, dict[str, Any]] = {}
    for piece in reader.stream():
        batch = piece.to_record_batch()
        columns.setdefault(piece.entity_path, {}).update(zip(batch.schema.names, batch.columns, strict=True))
    for topic, components in {
        "/road": {"Points3D:positions", "CoordinateFrame:frame"},
        "/vehicles": {"Points3D:positions", "CoordinateFrame:frame"},
        "/tf": {"Transform3D:translation", "Transform3D:quaternion", "Transform3D:child_frame"},
        "/log": {"TextLog:text"},
    }.items():
        assert components <= set(columns[topic]), topic
        assert "McapMessage:data" not in columns[topic], "raw bytes"
    assert len(columns["/road"]["Points3D:positions"][0]) == 3 * 1001
    assert len(columns["/vehicles"]["Points3D:positions"]) == 6
    assert len(columns["/vehicles"]["Points3D:positions"][0]) == 4 * 5
    # Rerun has no picture for scenes; it decodes them by their schema.
    scene = columns["/scene"]["foxglove.SceneUpdate:message"][0].as_py()
    assert [entity["id"] for entity in scene[0]["entities"]] == ["ego", "traffic", "road", "objects"]


def test_damage_is_told_in_words(tmp_path: Path) -> None:
    path = save(tmp_path / "trip.mcap", a_drive())
    whole = path.read_bytes()
    for damaged in (b"", b"hello", whole[:200] + whole[300:], b"\x00" * 5000, b"{}"):
        path.write_bytes(damaged)
        with pytest.raises(DataError, match="not a usable recording"):
            read_trip(path)


def test_of_a_file_that_was_cut_off_what_stands_in_it_is_read(tmp_path: Path) -> None:
    """At every place: never other values, never fewer for more bytes, and all of it once the data are whole."""
    drive = a_drive(60, 1)
    path = save(tmp_path / "trip.mcap", drive)
    whole, held = path.read_bytes(), -1
    counts: list[int] = []
    for size in (*range(0, len(whole), 211), len(whole) - 9, len(whole) - 1, len(whole)):
        path.write_bytes(whole[:size])
        try:
            back = read_trip(path)
        except DataError as error:
            assert "cut off" in error.message or not size, error.message
            counts.append(0)
            continue
        assert bits(back.frames) == bits(drive.frames[: len(back.frames)])
        assert len(back.frames) >= held
        held = len(back.frames)
        counts.append(held)
        if back.cut_off:
            assert back.final is None and "can be read" in back.note
        else:
            assert bits(back.frames) == bits(drive.frames) and back.final == drive.final and not back.note
    assert counts[0] == 0 and counts[-1] == 60
    assert len({*counts}) > 2, "a part of a chunk gives the part of the drive that stands in it"


def test_of_a_drive_of_many_chunks_the_whole_ones_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.driving.recording._CHUNK_BYTES", 20_000)
    drive = a_drive(400, 1)
    path = save(tmp_path / "trip.mcap", drive)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    back = read_trip(path)
    assert back.cut_off and 5 < len(back.frames) < 400
    assert compare_trips(back, drive) is None, "the frames that it holds are the same"
    assert compare_trips(back, a_drive(400, 2)) is not None


def test_a_cut_file_from_the_field_is_read(case_folder: Callable[[str], Path]) -> None:
    back = read_trip(case_folder("mcap-cut-off") / "trip.mcap")
    assert len(back.frames) == 26 and back.final is not None and back.trip.outcome == "success"


@given(st.data())
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_flipped_byte_is_either_harmless_or_told_in_words(tmp_path: Path, data: st.DataObject) -> None:
    drive = a_drive(2, 1)
    content = bytearray(save(tmp_path / "whole.mcap", drive).read_bytes())
    position = data.draw(st.integers(0, len(content) - 1))
    content[position] ^= data.draw(st.integers(1, 255))
    path = tmp_path / "flipped.mcap"
    path.write_bytes(bytes(content))
    try:
        back = read_trip(path)
    except DataError:
        return
    assert bits(back.frames) == bits(drive.frames)


def test_a_foreign_file_is_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        writer.finish()
    with pytest.raises(DataError, match="not a recorded trip of Chauffeur"):
        read_trip(path)
    with pytest.raises(DataError, match="There is no recording"):
        read_trip(tmp_path / "absent.mcap")
    with pytest.raises(DataError, match="cannot be read"):
        read_trip(tmp_path)


@pytest.mark.parametrize("other", [1, 4])
def test_another_format_is_refused_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, other: int) -> None:
    monkeypatch.setattr("chauffeur.driving.recording.FORMAT", other)
    path = save(tmp_path / "trip.mcap", a_drive())
    monkeypatch.undo()
    with pytest.raises(DataError, match=f"format {other};.*reads formats 2 and 3"):
        read_trip(path)


def as_format_2(path: Path, *, mirrored: bool) -> Path:
    """The same file as format 2 has it, where a road said on which side of +x its y is."""
    old = path.with_name("old.mcap")
    with path.open("rb") as source, old.open("wb") as target:
        writer = Writer(target)
        writer.start(profile="chauffeur")
        schemas: dict[int, int] = {}
        ids: dict[int, int] = {}
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            assert schema is not None
            if channel.id not in ids:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, schemas[schema.id])
            data = message.data
            if channel.topic == LANES.topic:
                data = json.dumps(json.loads(data) | {"mirrored": mirrored}).encode()
            writer.add_message(ids[channel.id], message.log_time, data, message.publish_time, message.sequence)
        source.seek(0)
        for record in make_reader(source).iter_metadata():
            writer.add_metadata(record.name, record.metadata | {"format": "2"})
        writer.finish()
    return old


def test_what_was_recorded_with_y_to_the_right_is_turned_over(tmp_path: Path) -> None:
    drive = a_drive()
    path = save(tmp_path / "trip.mcap", drive)
    assert compare_trips(read_trip(as_format_2(path, mirrored=False)), drive) is None
    turned = read_trip(as_format_2(path, mirrored=True))
    for frame, was in zip(turned.frames, drive.frames, strict=True):
        for one, before in zip(frame.observation.others, was.observation.others, strict=True):
            assert (one.x_m, one.speed_mps) == (before.x_m, before.speed_mps)
            assert (one.y_m, one.heading_rad) == (-before.y_m, -before.heading_rad)
        assert frame.applied == Command(was.applied.acceleration_mps2, -was.applied.steering_rad)
    road = turned.frames[0].observation.road
    assert [lane.centre.points_m for lane in road.lanes] == [((0.0, 0.0), (2e3, 0.0)), ((0.0, 4.0), (2e3, 4.0))]
    assert turned.final is not None
    assert turned.final.ego.y_m == 4.0


def test_nothing_half_written_stays(tmp_path: Path) -> None:
    path = save(tmp_path / "trip.mcap", a_drive())
    before = path.read_bytes()
    scenario = replace(a_scenario(), config={"bad": math.nan})
    with pytest.raises(DataError, match="cannot be stored"):
        write_trip(path, a_trip(), (), scenario)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["trip.mcap"]
    with pytest.raises(DataError, match="cannot be written"):
        write_trip(path / "inside-a-file.mcap", a_trip(), (), a_scenario())


def test_a_difference_names_tick_field_and_values() -> None:
    drive = a_drive()
    frame = drive.frames[3]
    ego = replace(frame.observation.ego, speed_mps=math.nextafter(frame.observation.ego.speed_mps, 99.0))
    other = replace(frame, observation=replace(frame.observation, ego=ego))
    changed = replace(drive, frames=(*drive.frames[:3], other, *drive.frames[4:]))
    found = compare_trips(drive, changed)
    assert found is not None
    assert (found.tick, found.field) == (3, "observation.ego.speed_mps")
    assert found.first != found.second
    assert "tick 3" in str(found)


def test_differences_outside_the_frames_are_found() -> None:
    drive = a_drive()
    shorter = compare_trips(drive, replace(drive, frames=drive.frames[:-1]))
    assert shorter is not None
    assert shorter.field == "number of frames"
    outcome = compare_trips(drive, replace(drive, trip=replace(drive.trip, outcome="timeout")))
    assert outcome is not None
    assert (outcome.tick, outcome.field) == (None, "outcome")
    renamed = replace(drive, trip=replace(drive.trip, record=(("version", "9"),), plan=Plan(Thoughts(""), None)))
    assert compare_trips(drive, renamed) is None, "provenance is not part of the drive"


def test_zero_and_minus_zero_differ() -> None:
    drive = a_drive(1)
    frame = replace(drive.frames[0], applied=Command(0.0, 0.0))
    minus = replace(drive.frames[0], applied=Command(-0.0, 0.0))
    found = compare_trips(replace(drive, frames=(frame,)), replace(drive, frames=(minus,)))
    assert found is not None
    assert found.field == "applied.acceleration_mps2"
