"""Sound as numbers: mono, 16 kHz, 16 bit, whatever it came as."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
import wave
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from chauffeur.concept import DataError, MissingExtraError

SAMPLE_RATE_HZ: Final = 16_000
"""What voice activity detection and every engine here works at."""

Samples = npt.NDArray[np.int16]
"""Mono sound at `SAMPLE_RATE_HZ`."""

LONGEST_S: Final = 300.0
"""Longest recording that is read."""

_MOST_BYTES: Final = 64 * 1024 * 1024
_FULL_SCALE: Final = 32768.0
_MOST_VALUES: Final = 50_000_000
"""Numbers that a file may unpack to: 200 MB."""

_RATES_HZ: Final = (4_000, 384_000)
_UNKNOWN_LENGTH_BYTES: Final = 0x7FFF_0000
"""Programs that write WAV into a pipe put a length around this, or above, into the header, or none (0)."""
_PCM, _FLOAT, _EXTENSIBLE = 1, 3, 0xFFFE
"""Formats of WAV: whole numbers, floating-point ones, one that is named further behind."""
_MOST_CHANNELS: Final = 64

_FFMPEG_S: Final = 30.0
_MOST_SAMPLE: Final = 16.0
"""24 dB above full scale: of recordings with floating-point samples that were mixed too loud."""
_SILENT_PEAK: Final = 16
_QUIET_PEAK: Final = 650
"""-34 dB of full scale: speech this low is lost in the noise of most microphones."""

_CLIPPED_SHARE: Final = 0.002


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording that was read.

    Attributes:
        samples: Mono at 16 kHz.
        notes: What the reader should know of it, in words.
    """

    samples: Samples
    notes: tuple[str, ...] = ()

    @property
    def duration_s(self) -> float:
        """Length."""
        return len(self.samples) / SAMPLE_RATE_HZ


def read_recording(path: Path, *, longest_s: float = LONGEST_S) -> Recording:
    """Read a sound file: WAV with the standard library, others with soundfile, the rest with ffmpeg.

    Args:
        path: The file.
        longest_s: A longer recording is refused.

    Raises:
        DataError: No such file, not sound, empty, too long, or broken beyond use.
        MissingExtraError: It has to be resampled, and the library for it is missing.
    """
    try:
        if not path.is_file():
            raise DataError(f"There is no sound file at {path}.", hint="Give a recording, e.g. wish.wav.")
        if path.stat().st_size > _MOST_BYTES:
            raise DataError(f"{path} is larger than {_MOST_BYTES >> 20} MiB.", hint="Give one utterance, not a drive.")
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror or error}.") from error
    return decode(data, str(path), longest_s=longest_s)


def decode(data: bytes, name: str = "The recording", *, longest_s: float = LONGEST_S) -> Recording:
    """Read the content of a sound file, e.g. as a browser uploads it. See `read_recording`.

    Args:
        data: Content of the file.
        name: What to call it in messages.
        longest_s: A longer recording is refused.

    Raises:
        DataError: Not sound, empty, too long, or broken beyond use.
        MissingExtraError: It has to be resampled, and the library for it is missing.
    """
    if not data:
        raise DataError(f"{name} is empty.")
    found = _wave(data, name) or _soundfile(data, longest_s) or _ffmpeg(data, longest_s)
    if found is None:
        raise DataError(
            f"{name} is not sound that can be read here.",
            hint="Give a WAV file; for FLAC, Ogg and MP3 install 'chauffeur[speech]', for others ffmpeg.",
        )
    channels, rate_hz, notes = found
    if not _RATES_HZ[0] <= rate_hz <= _RATES_HZ[1]:
        raise DataError(f"{name} has a sample rate of {rate_hz} Hz, which is none of speech.")
    if channels.shape[0] == 0:
        raise DataError(f"{name} has a header and no sound.")
    if channels.shape[0] > longest_s * rate_hz:
        raise DataError(f"{name} is longer than {longest_s:g} s.", hint="Give one utterance, not a drive.")
    odd = int(np.count_nonzero(~np.isfinite(channels)))
    if odd:
        notes = (*notes, f"{odd} of its {channels.size} samples are no numbers: they are taken for silence.")
    # Before anything is mixed or resampled: one that is no number would spread.
    channels = np.clip(np.nan_to_num(channels, nan=0.0, posinf=0.0, neginf=0.0), -_MOST_SAMPLE, _MOST_SAMPLE)
    if rate_hz < SAMPLE_RATE_HZ:
        notes = (*notes, f"Sampled at {rate_hz} Hz only: consonants are missing, words will be misheard more often.")
    samples = resample(mixed(channels), rate_hz)
    return Recording(samples, (*notes, *level_notes(samples)))


def mixed(channels: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """One channel (n,) of several (n, channels): the mean of those that carry anything."""
    if channels.ndim == 1:
        return channels
    # An unplugged second channel must not halve the first.
    live = channels[:, np.abs(channels).max(axis=0, initial=0.0) > 0.0]
    return np.asarray(live.mean(axis=1) if live.shape[1] else channels[:, 0], np.float32)


def resample(sound: npt.NDArray[np.float32], rate_hz: int) -> Samples:
    """16-bit samples at 16 kHz of a sound (n,) between -1 and 1.

    Raises:
        MissingExtraError: The rate is another one, and soxr is not installed.
    """
    if rate_hz != SAMPLE_RATE_HZ:
        try:
            import soxr
        except ImportError as error:
            raise MissingExtraError(
                f"Sound at {rate_hz} Hz has to be resampled to {SAMPLE_RATE_HZ} Hz, which needs soxr.",
                hint="Run: pip install 'chauffeur[speech]'",
            ) from error
        sound = np.asarray(soxr.resample(sound, rate_hz, SAMPLE_RATE_HZ), np.float32)
    return to_int16(sound)


def to_int16(sound: npt.NDArray[np.float32]) -> Samples:
    """Sound between -1 and 1 as 16-bit numbers; what is louder, or no number, is clipped."""
    finite = np.clip(np.nan_to_num(sound, nan=0.0), -1.0, 1.0)
    return np.minimum(np.rint(finite * _FULL_SCALE), _FULL_SCALE - 1).astype(np.int16)


def to_float(samples: Samples) -> npt.NDArray[np.float32]:
    """Samples as numbers between -1 and 1."""
    return samples.astype(np.float32) / np.float32(_FULL_SCALE)


def level_notes(samples: Samples) -> tuple[str, ...]:
    """What is wrong with the level of a recording, in words; empty where nothing is."""
    if len(samples) == 0:
        return ()
    loud = np.abs(samples.astype(np.int32))
    peak = int(loud.max())
    if peak < _SILENT_PEAK:
        return ("There is no sound in it at all: the microphone may be muted or unplugged.",)
    if peak < _QUIET_PEAK:
        return (f"It is very quiet (peak {20 * np.log10(peak / _FULL_SCALE):.0f} dB): speak up, or turn the input up.",)
    clipped = float(np.mean(loud >= 32_760))
    if clipped > _CLIPPED_SHARE:
        return (f"It is clipped ({100 * clipped:.1f} % of the samples): turn the input down.",)
    return ()


def wave_bytes(samples: Samples) -> bytes:
    """A WAV file of the samples, in memory."""
    out = io.BytesIO()
    with wave.open(out, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(SAMPLE_RATE_HZ)
        file.writeframes(samples.astype("<i2").tobytes())
    return out.getvalue()


_Found = tuple[npt.NDArray[np.float32], int, tuple[str, ...]]
"""(sound (n, channels) or (n,), rate in Hz, notes)."""


@dataclass(frozen=True, slots=True)
class _WaveFormat:
    """How the samples of a WAV file are written."""

    kind: int
    channels: int
    rate_hz: int
    bits: int

    @property
    def frame_bytes(self) -> int:
        """Size of one sample of all channels."""
        return self.channels * (self.bits // 8)


def _wave(data: bytes, name: str) -> _Found | None:
    """WAV of numbers, whatever length its header states; None for everything else."""
    found = _wave_parts(data)
    if found is None:
        return None
    form, content, promised = found
    frames = len(content) // form.frame_bytes
    notes: tuple[str, ...] = ()
    if len(content) < promised < _UNKNOWN_LENGTH_BYTES:
        held, whole = frames / form.rate_hz, promised / form.frame_bytes / form.rate_hz
        notes = (f"{name} breaks off: it holds {held:.1f} s of {whole:.1f} s.",)
    raw, sound = content[: frames * form.frame_bytes], None
    if form.kind == _FLOAT:
        with np.errstate(over="ignore", invalid="ignore"):
            sound = np.frombuffer(raw, f"<f{form.bits // 8}").astype(np.float32)
    elif form.bits == 8:  # the only unsigned one
        sound = (np.frombuffer(raw, np.uint8).astype(np.float32) - 128.0) / 128.0
    elif form.bits == 24:
        padded = np.zeros((frames * form.channels, 4), np.uint8)
        padded[:, 1:] = np.frombuffer(raw, np.uint8).reshape(-1, 3)
        sound = padded.view("<i4")[:, 0].astype(np.float32) / np.float32(2**31)
    else:
        sound = np.frombuffer(raw, f"<i{form.bits // 8}").astype(np.float32) / np.float32(2 ** (form.bits - 1))
    return sound.reshape(-1, form.channels), form.rate_hz, notes


def _wave_parts(data: bytes) -> tuple[_WaveFormat, bytes, int] | None:
    """(format, sound, bytes of sound that the header promises); None where it is no WAV that can be read here."""
    if data[:4] not in (b"RIFF", b"RF64", b"BW64") or data[8:12] != b"WAVE":
        return None
    form, at = None, 12
    while at + 8 <= len(data):
        name, size = data[at : at + 4], int.from_bytes(data[at + 4 : at + 8], "little")
        at += 8
        if name == b"fmt ":
            form = _wave_format(data[at : at + size])
        elif name == b"data":
            if form is None:
                return None
            unknown = size >= _UNKNOWN_LENGTH_BYTES or (size == 0 and not _is_chunk(data[at:]))
            return form, data[at:] if unknown else data[at : at + size], size
        at += size + size % 2
    return None


def _wave_format(head: bytes) -> _WaveFormat | None:
    if len(head) < 16:
        return None
    kind, channels, rate_hz, _, _, bits = struct.unpack_from("<HHIIHH", head)
    if kind == _EXTENSIBLE and len(head) >= 26:
        kind = int.from_bytes(head[24:26], "little")
    usual = {_PCM: (8, 16, 24, 32), _FLOAT: (32, 64)}.get(kind, ())
    if bits not in usual or not 1 <= channels <= _MOST_CHANNELS or not rate_hz:
        return None
    return _WaveFormat(kind, channels, rate_hz, bits)


def _is_chunk(rest: bytes) -> bool:
    """Whether what stands behind an empty sound is a further part of the file, and not the sound."""
    return rest[:4].isalnum() and int.from_bytes(rest[4:8], "little") + 8 <= len(rest)


def _soundfile(data: bytes, longest_s: float) -> _Found | None:
    try:
        import soundfile
    except (ImportError, OSError):  # OSError: its C library is missing
        return None
    library: Any = soundfile
    try:
        with library.SoundFile(io.BytesIO(data)) as file:
            rate_hz = int(file.samplerate)
            # Silence is packed a thousand times smaller than it unpacks.
            most = min(int((longest_s + 1) * rate_hz), _MOST_VALUES // file.channels)
            return np.asarray(file.read(most, dtype="float32"), np.float32), rate_hz, ()
    except (library.LibsndfileError, RuntimeError, ValueError, TypeError):
        return None


def _ffmpeg(data: bytes, longest_s: float) -> _Found | None:
    """What ffmpeg makes of it, through pipes: no file is written, and no other file or address can be opened."""
    program = shutil.which("ffmpeg")
    if program is None:
        return None
    command = [program, "-nostdin", "-v", "error", "-protocol_whitelist", "pipe", "-i", "pipe:0"]
    command += ["-t", f"{longest_s + 1:g}", "-f", "s16le", "-ac", "1", "-ar", str(SAMPLE_RATE_HZ), "pipe:1"]
    try:
        done = subprocess.run(command, input=data, capture_output=True, timeout=_FFMPEG_S, check=False)  # noqa: S603
    except (subprocess.TimeoutExpired, OSError):
        return None
    if not done.stdout:
        return None
    even = done.stdout[: len(done.stdout) // 2 * 2]
    notes = () if done.returncode == 0 else ("The file is damaged; what could be read of it was used.",)
    return to_float(np.frombuffer(even, "<i2").astype(np.int16)), SAMPLE_RATE_HZ, notes
