"""A recording that somebody made to hurt: it is refused in words before it takes the machine's memory or time."""

from __future__ import annotations

import io
import random
import struct
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from test_recording import a_drive, a_scenario, a_trip, save

from chauffeur.concept import DataError
from chauffeur.driving import recording
from chauffeur.driving.recording import read_trip, write_trip

MIB = 1 << 20


def packed(size: int, *, declared: bool = True) -> bytes:
    """That many zeros as one zstd frame, made without holding them; with its size in its head, or without."""
    compressor = zstandard.ZstdCompressor(write_content_size=declared).compressobj(size if declared else -1)
    piece = bytes(MIB)
    return b"".join(compressor.compress(piece) for _ in range(size // MIB)) + compressor.flush()


def a_chunk(data: bytes, size: int, compression: str = "zstd") -> Chunk:
    return Chunk(
        compression=compression, data=data, message_end_time=0, message_start_time=0,
        uncompressed_crc=0, uncompressed_size=size,
    )  # fmt: skip


def with_chunks(path: Path, *chunks: Chunk) -> Path:
    """A recording into which somebody put chunks of their own, right behind its header."""
    whole = save(path, a_drive(1, 1)).read_bytes()
    (length,) = struct.unpack_from("<Q", whole, 9)  # of the header, behind the magic and its opcode
    builder = RecordBuilder()
    for chunk in chunks:
        chunk.write(builder)
    at = 8 + 9 + length
    path.write_bytes(whole[:at] + builder.end() + whole[at:])
    return path


def refused(path: Path) -> str:
    """What is said of it; to find that out took little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(DataError) as caught:
            read_trip(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 4 * recording._MAX_CHUNK_BYTES, f"{peak / MIB:.0f} MiB"
    return caught.value.message


LARGE = packed(64 * MIB)
QUIET = packed(64 * MIB, declared=False)


@pytest.mark.parametrize(
    ("chunks", "words"),
    [
        ([a_chunk(LARGE, 64 * MIB)], "a chunk would unpack to 67108864 bytes; 33554432 are the most one may have"),
        ([a_chunk(LARGE, 1 << 62)], "a chunk would unpack to 4611686018427387904 bytes"),
        ([a_chunk(LARGE, 16 * MIB)], "a chunk does not unpack to the 16777216 bytes that it declares"),
        ([a_chunk(QUIET, 16 * MIB)], "a chunk does not unpack to the 16777216 bytes that it declares"),
        ([a_chunk(LARGE + LARGE, 0)], "a chunk does not unpack to the 0 bytes that it declares"),
        ([a_chunk(packed(MIB), 2 * MIB)], "a chunk does not unpack to the 2097152 bytes that it declares"),
        ([a_chunk(lz4.frame.compress(bytes(64 * MIB)), MIB, "lz4")], "a chunk is compressed with 'lz4'"),
        ([a_chunk(b"", 0, "\x1b[2Jbrotli" * 50)], "a chunk is compressed with '"),
        ([a_chunk(b"", 16, "")], "a chunk does not unpack to the 16 bytes that it declares"),
        ([a_chunk(b"no frame at all", 16)], "not a usable recording"),
    ],
)  # fmt: skip
def test_a_chunk_that_unpacks_to_too_much_is_refused(tmp_path: Path, chunks: list[Chunk], words: str) -> None:
    path = with_chunks(tmp_path / "trip.mcap", *chunks)
    assert path.stat().st_size < MIB
    assert words in refused(path)


def test_many_chunks_are_refused_together(tmp_path: Path) -> None:
    """A message of zeros is skipped as no record of ours: 150 kB of such chunks were unpacked to gigabytes."""
    skipped = b"\x80" + struct.pack("<Q", 16 * MIB - 9) + bytes(16 * MIB - 9)
    chunk = a_chunk(zstandard.ZstdCompressor().compress(skipped), 16 * MIB)
    path = with_chunks(tmp_path / "trip.mcap", *[chunk] * 15)
    assert len(read_trip(path).frames) == 1
    path = with_chunks(tmp_path / "trip.mcap", *[chunk] * 280)
    assert path.stat().st_size < 300_000
    assert "it would unpack to more than 536870912 bytes" in refused(path)


def test_values_too_many_to_hold_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two bytes of JSON become an object of a hundred."""
    path = save(tmp_path / "trip.mcap", a_drive())
    monkeypatch.setattr(recording, "_MAX_VALUES", 500)
    assert "it holds more than 500 values" in refused(path)


def test_what_could_not_be_read_again_is_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for limit, value, words in (
        ("_MAX_VALUES", 500, "more than 500 values"),
        ("_MAX_UNPACKED_BYTES", 80_000, "more than 80000 bytes"),
        ("_MAX_BYTES", 8_000, "more than 8000 bytes"),
        ("_MAX_CHUNK_BYTES", recording._CHUNK_BYTES + 300, "a message of"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(recording, limit, value)
            with pytest.raises(DataError, match=words):
                save(tmp_path / "trip.mcap", a_drive())
    assert not list(tmp_path.iterdir())


def test_the_largest_message_that_may_be_written_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording, "_MAX_CHUNK_BYTES", 64_000)
    monkeypatch.setattr(recording, "_CHUNK_BYTES", 16_000)
    for size in (15_000, 31_000, 47_000):
        scenario = replace(a_scenario(), config={"large": "x" * size})
        path = write_trip(tmp_path / "trip.mcap", a_trip(), a_drive().frames, scenario)
        assert read_trip(path).scenario == scenario
    with pytest.raises(DataError, match="a message of"):
        write_trip(path, a_trip(), (), replace(a_scenario(), config={"large": "x" * 48_000}))


def _flip(noise: random.Random, content: bytearray) -> None:
    for _ in range(noise.randint(1, 8)):
        content[noise.randrange(len(content))] = noise.randrange(256)


def _length(noise: random.Random, content: bytearray) -> None:
    """A length or an offset becomes an extreme one."""
    at = noise.randrange(len(content) - 8)
    size = noise.choice([4, 8])
    content[at : at + size] = (noise.choice([0, 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1]) % 2 ** (8 * size)).to_bytes(
        size, "little"
    )


def _move(noise: random.Random, content: bytearray) -> None:
    first, second = sorted(noise.sample(range(len(content)), 2))
    piece = bytes(content[first:second])
    noise.choice([lambda: content.__delitem__(slice(first, second)), lambda: content.extend(piece * 3)])()


@pytest.mark.parametrize("damage", [_flip, _length, _move])
def test_whatever_is_done_to_a_recording_is_said_in_words(
    tmp_path: Path, damage: Callable[[random.Random, bytearray], None]
) -> None:
    noise = random.Random(f"{damage.__name__} 2026")
    whole = save(tmp_path / "whole.mcap", a_drive(2, 1)).read_bytes()
    # Unpacked, so that damage reaches records and JSON and is not all caught by the frame's checksum.
    open_ = _without_compression(whole)
    path = tmp_path / "damaged.mcap"
    path.write_bytes(open_)
    assert len(read_trip(path).frames) == 2
    for round_ in range(400):
        content = bytearray(open_ if round_ % 2 else whole)
        damage(noise, content)
        path.write_bytes(content)
        try:
            read_trip(path)
        except DataError as error:
            assert error.message.startswith(str(path)), error.message
            assert len(error.message) < 1000


def _without_compression(whole: bytes) -> bytes:
    """The same recording with its chunks unpacked and without their checksums."""
    builder = RecordBuilder()
    for record in StreamReader(io.BytesIO(whole), emit_chunks=True).records:
        if isinstance(record, Chunk):
            data = zstandard.decompress(record.data, record.uncompressed_size)
            replace(record, compression="", data=data, uncompressed_crc=0).write(builder)
        elif record is not None:
            record.write(builder)
    magic = whole[:8]
    return magic + builder.end() + magic
