"""Hearing beside the drive: the process that hears, as its session sees it. Nothing here waits for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from types import TracebackType
from typing import IO, Any, Final, Literal, Self

from pydantic import TypeAdapter, ValidationError

from chauffeur.concept import ChauffeurError, SandboxError, errors
from chauffeur.driving.talk.asr_process import HEAD, AsrEngine
from chauffeur.speech.base import Heard, Hotword

READY_WITHIN_S: Final = 60.0
MOST_WAITING: Final = 20 * 32_000
"""Bytes of sound that may wait to be heard, 20 s; what is said on top of it is dropped, and that is told."""
HUNG_AFTER_S: Final = 5.0
"""An engine that is at work for so much longer than it may take hangs, and its process is replaced."""
MOST_STARTS: Final = 4
"""A process that dies again and again is given up on: typing goes on."""
_READ: Final = 1 << 16

State = Literal["off", "idle", "speaking", "recognising"]


@dataclass(frozen=True, slots=True)
class AsrListener:
    """What is told of hearing.

    Attributes:
        state: Of the microphone.
        why: Why it is off; empty while it is not.
    """

    state: State
    why: str = ""


@dataclass(frozen=True, slots=True)
class HeardAt:
    """What was heard, and when.

    Attributes:
        heard: It.
        at_s: When the words were there, by the monotonic clock.
        ended_s: When the person had finished.
    """

    heard: Heard
    at_s: float
    ended_s: float


@dataclass(frozen=True, slots=True)
class Trouble:
    """Something that went wrong, in words."""

    text: str


_heard: TypeAdapter[Heard] = TypeAdapter(Heard)


class AsrClient:
    """One stream of sound and the process that hears it. Use as a context manager; call `poll` often.

    Attributes:
        name: Of the engine, known once entered.
        remote: Whether sound leaves this machine.
        state: Of the microphone.
    """

    def __init__(self, engine: AsrEngine, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._engine, self._clock = engine, clock
        self.name, self.remote = engine.name, engine.name == "endpoint"
        self.state: State = "off"
        self._process: subprocess.Popen[bytes] | None = None
        self._errors: IO[bytes] | None = None
        self._starts = 0
        self._out = bytearray()
        self._in = bytearray()
        self._since_s = 0.0
        self._ready = False
        self._failed: ChauffeurError | None = None
        self._dropping = False
        self._answer_expected = False
        self._button: Hotword | None = None
        self._news: list[AsrListener | HeardAt | Trouble] = []

    def __enter__(self) -> Self:
        """Start it.

        Raises:
            ChauffeurError: The engine cannot be had: its own error, or that its process could not be started.
        """
        self._start()
        until_s = self._clock() + READY_WITHIN_S
        while not self._ready:
            ended = self._process is None or self._process.poll() is not None
            self._listen()  # after that look: what it said last is there once it has ended
            if self._failed is not None or ended or self._clock() > until_s:
                error = self._failed or SandboxError(
                    "The process that hears could not be started.", hint=self._last_words() or "Try again."
                )
                self.close()
                raise error
            if not self._ready:
                time.sleep(0.01)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process; it holds nothing that would have to be kept."""
        self._end()
        self.state = "off"

    @property
    def hears(self) -> bool:
        """Whether there is a process that hears, or will be one."""
        return self._process is not None

    def sound(self, chunk: bytes) -> None:
        """16 kHz, 16 bit, little-endian, mono; the last sample was spoken just now."""
        if self._process is None or self.state == "off":
            return
        if len(self._out) + len(chunk) > MOST_WAITING:
            if not self._dropping:
                self._news.append(Trouble("Some of the sound was lost: the speech engine does not keep up."))
            self._dropping = True
            return
        self._order(b"s", chunk)

    def button(self, button: Hotword, *, held: bool) -> None:
        """A button is held from now on, or let go."""
        if held:
            self._button = button
            self._order(b"c" if button == "command" else b"e")
        elif self._button is not None:
            self._button = None
            self._order(b"r")

    def expect_answer(self, expected: bool) -> None:
        """Whether yes or no may be said, without a hotword."""
        if expected != self._answer_expected:
            self._answer_expected = expected
            self._order(b"y" if expected else b"n")

    def forget(self) -> None:
        """Drop what was said and not heard yet, e.g. while the car itself speaks."""
        self._button = None
        self._order(b"m")

    def poll(self) -> list[AsrListener | HeardAt | Trouble]:
        """What was heard since the last call, and how hearing stands where that changed."""
        if self._process is not None:
            self._flush()
            self._listen()
            self._look_after()
        news, self._news = self._news, []
        return news

    # The process ------------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        self._starts += 1
        self._out.clear()
        self._in.clear()
        self._ready = False
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
        self._process = subprocess.Popen(  # noqa: S603 - this package's own process
            [sys.executable, "-m", "chauffeur.driving.talk.asr_process", json.dumps(asdict(self._engine))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            bufsize=0,
            start_new_session=True,
        )
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            os.set_blocking(pipe.fileno(), False)
        self._since_s = self._clock()

    def _end(self) -> None:
        process, self._process = self._process, None
        self._out[:] = bytes(len(self._out))
        self._out.clear()
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                if pipe is not None:
                    pipe.close()
        if self._errors is not None:
            self._errors.close()
            self._errors = None

    def _last_words(self) -> str:
        if self._errors is None:
            return ""
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def _look_after(self) -> None:
        """Replace a process that died or hangs."""
        process = self._process
        if process is None:
            return
        if self._failed is not None:
            self._starts = MOST_STARTS  # it could be had before; what is missing now stays missing
            self._replace(str(self._failed))
        elif process.poll() is not None:
            self._replace(f"The process that hears ended with code {process.returncode}. {self._last_words()}".strip())
        elif self._ready and self.state == "recognising":
            if self._clock() - self._since_s > self._engine.timeout_s + HUNG_AFTER_S:
                self._replace("The speech engine hung.")
        elif not self._ready and self._clock() - self._since_s > READY_WITHIN_S:
            self._replace("The process that hears did not start.")

    def _replace(self, why: str) -> None:
        self._end()
        if self._starts >= MOST_STARTS:
            self._now("off", f"{why} It is not tried again: type what you want.")
            self._news.append(Trouble(f"Hearing is off. {why}"))
            return
        self._news.append(Trouble(f"{why} It is started again; what was said just now has to be said again."))
        self._now("off", why)
        self._button = None
        self._start()

    def _now(self, state: State, why: str = "") -> None:
        self._since_s = self._clock()
        if state != self.state:
            self.state = state
            self._news.append(AsrListener(state, why))

    # Messages ---------------------------------------------------------------------------------------------------------

    def _order(self, what: bytes, body: bytes = b"") -> None:
        if self._process is not None:
            self._out += HEAD.pack(what, round(self._clock() * 1e9), len(body)) + body
            self._flush()

    def _flush(self) -> None:
        """Hand over as much as the pipe takes."""
        if self._process is None or self._process.stdin is None:
            return
        while self._out:
            try:
                written = os.write(self._process.stdin.fileno(), bytes(self._out[:_READ]))
            except (BlockingIOError, BrokenPipeError):  # it is at work; or gone, which `_look_after` sees
                return
            del self._out[:written]
        self._dropping = False

    def _listen(self) -> None:
        if self._process is None or self._process.stdout is None:
            return
        while True:
            try:
                piece = os.read(self._process.stdout.fileno(), _READ)
            except BlockingIOError:
                break
            if not piece:
                break
            self._in += piece
        *lines, rest = bytes(self._in).split(b"\n")
        self._in[:] = rest
        for line in lines:
            self._line(line)

    def _line(self, line: bytes) -> None:
        try:
            found: dict[str, Any] = json.loads(line)
            match found["kind"]:
                case "ready":
                    self.name, self.remote, self._ready = str(found["name"]), bool(found["remote"]), True
                    if self._answer_expected:
                        self._order(b"y")
                    self._now("idle")
                case "failed":
                    self._failed = _error(found)
                case "state":
                    self._now(found["state"])
                case "heard":
                    heard = _heard.validate_python(found["heard"])
                    at_s = float(found["at_s"])
                    ended_s = found["ended_s"]
                    ended_s = at_s - heard.timing.after_speech_s if ended_s is None else float(ended_s)
                    self._news.append(HeardAt(heard, at_s, min(ended_s, at_s)))
                case _:
                    pass
        except (ValueError, KeyError, TypeError, ValidationError):  # half a line of a process that died
            return


def _error(found: dict[str, Any]) -> ChauffeurError:
    """The engine's own error, as it was raised there."""
    kind = getattr(errors, str(found["error"]), ChauffeurError)
    error: type[ChauffeurError] = (
        kind if isinstance(kind, type) and issubclass(kind, ChauffeurError) else ChauffeurError
    )
    return error(str(found["message"]), hint=str(found["hint"]))
