"""Sound as numbers: mono, 16 kHz, 16 bit, whatever it came as."""

from __future__ import annotations

import io
import shutil
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
"""Programs that write WAV into a pipe put a length around this, or above, into the header."""

_FFMPEG_S: Final = 30.0
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
                extra="speech",
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


def _wave(data: bytes, name: str) -> _Found | None:
    """Integer WAV; None for everything else."""
    try:
        with wave.open(io.BytesIO(data)) as file:
            width, count, rate_hz = file.getsampwidth(), file.getnchannels(), file.getframerate()
            promised = file.getnframes()
            # A header may promise terabytes; there is never more than the file.
            raw = file.readframes(min(promised, len(data) // max(1, width * count) + 1))
    except (wave.Error, EOFError):
        return None
    if width not in (1, 2, 3, 4) or rate_hz == 0:
        return None
    frames = len(raw) // (width * count)
    raw = raw[: frames * width * count]
    notes: tuple[str, ...] = ()
    if frames < promised and promised * width * count < _UNKNOWN_LENGTH_BYTES:
        notes = (f"{name} breaks off: it holds {frames / rate_hz:.1f} s of {promised / rate_hz:.1f} s.",)
    if width == 1:  # the only unsigned one
        sound = (np.frombuffer(raw, np.uint8).astype(np.float32) - 128.0) / 128.0
    elif width == 3:
        padded = np.zeros((frames * count, 4), np.uint8)
        padded[:, 1:] = np.frombuffer(raw, np.uint8).reshape(-1, 3)
        sound = padded.view("<i4")[:, 0].astype(np.float32) / np.float32(2**31)
    else:
        sound = np.frombuffer(raw, f"<i{width}").astype(np.float32) / np.float32(2 ** (8 * width - 1))
    return sound.reshape(-1, count), rate_hz, notes


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
