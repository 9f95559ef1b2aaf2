"""Sound in any form comes out as mono at 16 kHz, or is refused in words."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
import wave
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.concept import DataError
from chauffeur.speech.audio import (
    SAMPLE_RATE_HZ,
    decode,
    level_notes,
    read_recording,
    to_float,
    to_int16,
    wave_bytes,
)


def tone(rate_hz: int = SAMPLE_RATE_HZ, seconds: float = 0.5, hz: float = 440.0, level: float = 0.5) -> np.ndarray:
    return (level * np.sin(2 * np.pi * hz * np.arange(int(rate_hz * seconds)) / rate_hz)).astype(np.float32)


def wav(channels: np.ndarray, rate_hz: int, width: int) -> bytes:
    """Channels (n, c) between -1 and 1 as an integer WAV."""
    if width == 1:
        raw = np.rint(channels * 127 + 128).astype(np.uint8).tobytes()
    else:
        whole = np.rint(channels.astype(np.float64) * (2 ** (8 * width - 1) - 1)).astype("<i8")
        raw = whole.reshape(-1, 1).view(np.uint8).reshape(-1, 8)[:, :width].tobytes()
    out = io.BytesIO()
    with wave.open(out, "wb") as file:
        file.setnchannels(channels.shape[1])
        file.setsampwidth(width)
        file.setframerate(rate_hz)
        file.writeframes(raw)
    return out.getvalue()


@pytest.mark.parametrize("width", [1, 2, 3, 4])
def test_every_integer_width_is_the_same_sound(width: int) -> None:
    found = decode(wav(tone()[:, None], SAMPLE_RATE_HZ, width))
    assert found.notes == () and found.duration_s == 0.5
    assert np.abs(to_float(found.samples) - tone()).max() < (0.01 if width == 1 else 0.0002)


@pytest.mark.parametrize("rate_hz", [8_000, 11_025, 44_100, 48_000])
def test_other_rates_are_resampled(rate_hz: int) -> None:
    pytest.importorskip("soxr")
    found = decode(wav(tone(rate_hz)[:, None], rate_hz, 2))
    assert abs(found.duration_s - 0.5) < 0.001
    middle = slice(1000, 7000)
    assert np.abs(to_float(found.samples)[middle] - tone()[middle]).max() < 0.01
    assert bool(found.notes) == (rate_hz < SAMPLE_RATE_HZ)


def test_stereo_is_mixed_and_a_dead_channel_does_not_halve_it() -> None:
    both = decode(wav(np.stack([tone(), tone()], 1), SAMPLE_RATE_HZ, 2))
    one = decode(wav(np.stack([tone(), np.zeros(8000, np.float32)], 1), SAMPLE_RATE_HZ, 2))
    assert np.array_equal(both.samples, one.samples)
    opposite = decode(wav(np.stack([tone(), -0.5 * tone()], 1), SAMPLE_RATE_HZ, 2))
    assert np.abs(to_float(opposite.samples) - 0.25 * tone()).max() < 0.001


def test_a_float_wav_is_read_too() -> None:
    soundfile = pytest.importorskip("soundfile")
    out = io.BytesIO()
    soundfile.write(out, tone(), SAMPLE_RATE_HZ, format="WAV", subtype="FLOAT")
    assert np.abs(to_float(decode(out.getvalue()).samples) - tone()).max() < 0.0002


def test_what_a_browser_records_is_read(tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.skip("ffmpeg is not installed")
    (tmp_path / "a.wav").write_bytes(wav(tone()[:, None], SAMPLE_RATE_HZ, 2))
    command = ["ffmpeg", "-v", "error", "-i", str(tmp_path / "a.wav"), "-c:a", "libopus", str(tmp_path / "a.webm")]
    subprocess.run(command, check=True)
    found = read_recording(tmp_path / "a.webm")
    assert abs(found.duration_s - 0.5) < 0.05
    assert np.abs(to_float(found.samples)).max() > 0.3


def test_half_a_file_is_heard_and_said() -> None:
    whole = wav(tone(seconds=2.0)[:, None], SAMPLE_RATE_HZ, 2)
    found = decode(whole[: len(whole) // 2], "wish.wav")
    assert found.notes == ("wish.wav breaks off: it holds 1.0 s of 2.0 s.",)
    odd = decode(whole[: len(whole) // 2 + 1])
    assert abs(len(odd.samples) - len(found.samples)) <= 1


def test_a_piped_header_promises_terabytes_and_nothing_is_said() -> None:
    whole = bytearray(wav(tone()[:, None], SAMPLE_RATE_HZ, 2))
    struct.pack_into("<I", whole, 4, 0x7FFF_F024)
    struct.pack_into("<I", whole, 40, 0x7FFF_F000)
    found = decode(bytes(whole))
    assert found.notes == () and len(found.samples) == 8000


def riff(*parts: tuple[bytes, bytes, int | None], kind: bytes = b"RIFF", size: int = 0) -> bytes:
    """A RIFF file of (name, content, length that its header states; None for the true one)."""
    body = b"".join(
        name + struct.pack("<I", len(content) if length is None else length) + content + b"\0" * (len(content) % 2)
        for name, content, length in parts
    )
    return kind + struct.pack("<I", size) + b"WAVE" + body


def head(kind: int = 1, channels: int = 1, rate_hz: int = SAMPLE_RATE_HZ, bits: int = 16, more: bytes = b"") -> bytes:
    frame = channels * bits // 8
    return struct.pack("<HHIIHH", kind, channels, rate_hz, rate_hz * frame, frame, bits) + more


PCM = (np.clip(tone(), -1.0, 1.0) * 32767).astype("<i2").tobytes()
FLOATS = tone().astype("<f4").tobytes()
EXTENSIBLE = struct.pack("<HHI", 22, 16, 0) + struct.pack("<H", 1) + bytes(14)
LIST = (b"LIST", b"INFOsoft", None)


@pytest.mark.parametrize("length", [None, 0, 0xFFFF_FFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFE, 0x7FFF_F000])
@pytest.mark.parametrize("size", [0, 0xFFFF_FFFF, 36])
@pytest.mark.parametrize("before", [(), (LIST,), ((b"fact", bytes(4), None), (b"JUNK", bytes(27), None))])
def test_whatever_length_a_pipe_wrote_it_is_read_to_its_end(
    length: int | None, size: int, before: tuple[tuple[bytes, bytes, int | None], ...]
) -> None:
    found = decode(riff((b"fmt ", head(), None), *before, (b"data", PCM, length), size=size))
    assert len(found.samples) == 8000 and not found.notes


@pytest.mark.parametrize(
    ("data", "most"),
    [
        (riff((b"fmt ", head(0xFFFE, more=EXTENSIBLE), None), (b"data", PCM, 0)), 8000),
        (riff((b"fmt ", head(3, bits=32), None), (b"data", FLOATS, 0)), 8000),
        (riff((b"fmt ", head(3, bits=64), None), (b"data", tone().astype("<f8").tobytes(), None)), 8000),
        (riff((b"ds64", bytes(28), None), (b"fmt ", head(), None), (b"data", PCM, 0xFFFF_FFFF), kind=b"RF64"), 8000),
        (riff((b"fmt ", head(), None), (b"data", PCM, None), LIST), 8000),
        (riff((b"fmt ", head(channels=2), None), (b"data", PCM + b"\1", 0)), 4000),
        (riff((b"fmt ", head(bits=24), None), (b"data", b"\0\0\x40" * 8000, 0)), 8000),
    ],
)
def test_odd_headers_are_read(data: bytes, most: int) -> None:
    assert len(decode(data).samples) == most


@pytest.mark.parametrize(
    "data",
    [
        riff((b"fmt ", head(), None), (b"data", b"", 0), LIST),
        riff((b"fmt ", head(), None), (b"data", b"", 0)),
        riff((b"fmt ", head(channels=0), None), (b"data", PCM, None)),
        riff((b"fmt ", head(rate_hz=0), None), (b"data", PCM, None)),
        riff((b"fmt ", head(bits=0), None), (b"data", PCM, None)),
        riff((b"fmt ", b"short", None), (b"data", PCM, None)),
        riff((b"data", PCM, None)),
        riff((b"fmt ", head(), 0xFFFF_FFFF)),
    ],
)
def test_headers_without_sound_are_refused_in_words(data: bytes) -> None:
    with pytest.raises(DataError):
        decode(data)


@pytest.mark.parametrize("odd", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("rate_hz", [SAMPLE_RATE_HZ, 44_100])
@pytest.mark.parametrize("channels", [1, 2])
def test_samples_that_are_no_numbers_are_silence_and_spread_nowhere(odd: float, rate_hz: int, channels: int) -> None:
    if rate_hz != SAMPLE_RATE_HZ:
        pytest.importorskip("soxr", reason="needs the extra `speech`")
    sound = np.repeat(tone(rate_hz=rate_hz)[:, None], channels, axis=1).astype("<f4")
    whole = decode(riff((b"fmt ", head(3, channels, rate_hz, 32), None), (b"data", sound.tobytes(), None)))
    sound[500::1000, 0] = odd
    found = decode(riff((b"fmt ", head(3, channels, rate_hz, 32), None), (b"data", sound.tobytes(), None)))
    off = np.abs(to_float(found.samples) - to_float(whole.samples))
    assert np.median(off) < 0.001 and np.abs(to_float(found.samples)).max() < 1.0
    assert any("no numbers" in note for note in found.notes)


@pytest.mark.parametrize("case", ["wav-length-zero", "wav-nan-samples"])
def test_sound_from_the_field_is_heard(case: str, case_folder: Callable[[str], Path]) -> None:
    pytest.importorskip("soxr", reason="needs the extra `speech`")
    found = read_recording(case_folder(case) / "wish.wav")
    assert found.duration_s > 1.5 and np.abs(to_float(found.samples)).max() > 0.1


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"hello", "not sound"),
        (b"RIFF\x00\x00\x00\x00WAVE", "not sound"),
        (b"\xff" * 4000, "not sound"),
        (wav(np.zeros((0, 1), np.float32), SAMPLE_RATE_HZ, 2), "no sound"),
        (wav(tone()[:, None], 1000, 2), "sample rate of 1000 Hz"),
    ],
)
def test_what_is_no_sound_is_refused_in_words(data: bytes, words: str) -> None:
    with pytest.raises(DataError, match=words):
        decode(data)


def test_no_file_a_folder_and_too_long_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "nothing.wav", tmp_path):
        with pytest.raises(DataError, match="no sound file"):
            read_recording(path)
    with pytest.raises(DataError, match="longer than 1 s"):
        decode(wav(tone(seconds=1.5)[:, None], SAMPLE_RATE_HZ, 2), longest_s=1.0)


@given(st.binary(max_size=300))
def test_no_bytes_behind_a_wav_header_crash_the_reader(tail: bytes) -> None:
    head = wav(tone(seconds=0.01)[:, None], SAMPLE_RATE_HZ, 2)[:12]
    with pytest.MonkeyPatch.context() as here:
        here.setenv("PATH", "")  # without ffmpeg, which is a process for each
        try:
            found = decode(head + b"fmt " + tail)
        except DataError:
            return
    assert found.samples.dtype == np.int16


def test_levels_are_said() -> None:
    assert "muted" in level_notes(np.zeros(1000, np.int16))[0]
    assert "very quiet" in level_notes(to_int16(tone(level=0.01)))[0]
    assert "clipped" in level_notes(to_int16(tone(level=3.0)))[0]
    assert level_notes(to_int16(tone())) == ()


@given(st.lists(st.floats(width=32), max_size=50))
def test_any_number_becomes_a_sample(values: list[float]) -> None:
    found = to_int16(np.array(values, np.float32))
    assert found.dtype == np.int16 and len(found) == len(values)


@given(st.binary(max_size=400))
def test_a_wav_in_memory_is_what_went_in(raw: bytes) -> None:
    samples = np.frombuffer(raw[: len(raw) // 2 * 2], "<i2").astype(np.int16)
    if len(samples):
        assert np.array_equal(decode(wave_bytes(samples)).samples, samples)
