"""The process that hears: `python -m chauffeur.driving.talk.asr_process ENGINE`; `AsrClient` starts it and talks to it.

Engines hold the interpreter for a quarter of a second and more, a remote one may hang, and a library written in C may
crash: none of that may hold up, or take down, who looks after the drive. Sound comes in on standard input and stays in
this process's memory until it is heard; what was heard goes out as lines of JSON.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Final, Literal

from chauffeur.concept import ChauffeurError
from chauffeur.driving.live.realtime import become_favoured
from chauffeur.speech import Listener, Recogniser, open_recogniser
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples
from chauffeur.speech.base import Expect, FollowingRecogniser, Heard, Transcript
from chauffeur.speech.grammar import GrammarRecogniser

HEAD: Final = struct.Struct("<cqI")
"""Of a message to this process: what it is, when (monotonic clock, ns), and how many bytes follow."""

PlanMessage = Literal[b"s", b"c", b"e", b"r", b"y", b"n", b"m"]
"""Sound; button `command` or `evaluate` held, or let go (`r`); an answer is expected (`y`) or not (`n`); forget all."""

_MOST_TIMES: Final = 1024
"""Chunks whose times are remembered: more than the longest utterance has."""


@dataclass(frozen=True, slots=True)
class AsrEngine:
    """A speech engine by name; see speech.engines.

    Attributes:
        name, model, base_url, timeout_s: As `open_recogniser` takes them.
        favoured: Whether its process asks for a larger share of the core: who speaks is waiting.
    """

    name: str = "grammar"
    model: str = ""
    base_url: str | None = None
    timeout_s: float = 10.0
    favoured: bool = False


class _Times:
    """When each sample of the stream was there to be heard: a chunk comes when its last one is."""

    def __init__(self) -> None:
        self._ends: list[tuple[int, float]] = []
        self._samples = 0

    def note(self, samples: int, at_s: float) -> None:
        self._samples += samples
        self._ends.append((self._samples, at_s))
        del self._ends[:-_MOST_TIMES]

    def of(self, sample: int) -> float | None:
        """Time of the clock; None if it is not known any more."""
        for end, at_s in self._ends:
            if sample <= end:
                return at_s - (end - sample) / SAMPLE_RATE_HZ
        return None


class _Watched:
    """An engine that tells when it is at work."""

    def __init__(self, engine: Recogniser, tell: Callable[[bool], None]) -> None:
        self._engine, self._tell = engine, tell

    @property
    def name(self) -> str:
        return self._engine.name

    @property
    def remote(self) -> bool:
        return self._engine.remote

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        self._tell(True)
        try:
            return self._engine.recognise(samples, expect)
        finally:
            self._tell(False)


class AsrProcess:
    """Takes orders, and gives lines."""

    def __init__(
        self, engine: Recogniser, ahead: FollowingRecogniser | None, write: Callable[[dict[str, object]], None]
    ) -> None:
        """Hear.

        Args:
            engine: Turns sound into words.
            ahead: The same, if it hears ahead.
            write: Takes a line.
        """
        self._write = write
        self._engine = engine
        self._listener = Listener(_Watched(engine, self._at_work), ahead=ahead)
        self._times = _Times()
        self._state = ""

    def order(self, what: bytes, at_s: float, body: bytes) -> None:
        """Carry an order out; unknown ones are passed over."""
        found: list[Heard] = []
        match what:
            case b"s":
                self._times.note(len(body) // 2, at_s)
                found = self._listener.feed(body)
            case b"c" | b"e":
                self._listener.press("command" if what == b"c" else "evaluate")
            case b"r":
                found = self._listener.finish()
            case b"y" | b"n":
                self._listener.answer_expected = what == b"y"
            case b"m":
                self._listener.stop()
            case _:
                pass
        for heard in found:
            now_s = time.monotonic()
            ended_s = self._times.of(heard.end_sample) if heard.end_sample else None
            self._write({"kind": "heard", "heard": asdict(heard), "at_s": now_s, "ended_s": ended_s})
        self._tell("speaking" if self._listener.speaking else "idle")

    def _at_work(self, begins: bool) -> None:
        if begins:
            self._tell("recognising")

    def _tell(self, state: str) -> None:
        if state != self._state:
            self._state = state
            self._write({"kind": "state", "state": state})


def _write(line: dict[str, object]) -> None:
    sys.stdout.buffer.write(json.dumps(line).encode() + b"\n")
    sys.stdout.buffer.flush()


def _read(count: int) -> bytes:
    """So many bytes; fewer where the other end is gone."""
    return sys.stdin.buffer.read(count)


def main(engine: AsrEngine) -> None:
    """Hear until nobody listens any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who drives
    if engine.favoured:
        become_favoured()
    try:
        recogniser = open_recogniser(
            engine.name, model=engine.model, base_url=engine.base_url, timeout_s=engine.timeout_s
        )
        ahead = recogniser if isinstance(recogniser, GrammarRecogniser) else None
        if ahead is not None:
            ahead.begin("open")  # it loads something more, and nobody speaks yet
        hearing = AsrProcess(recogniser, ahead, _write)
    except ChauffeurError as error:
        _write({"kind": "failed", "error": type(error).__name__, "message": error.message, "hint": error.hint})
        return
    _write({"kind": "ready", "name": recogniser.name, "remote": recogniser.remote})
    while len(head := _read(HEAD.size)) == HEAD.size:
        what, at_ns, length = HEAD.unpack(head)
        hearing.order(what, at_ns * 1e-9, _read(length))


if __name__ == "__main__":
    try:
        main(AsrEngine(**json.loads(sys.argv[1])))
    except BrokenPipeError:  # who listened is gone; nothing is left to be said, not even at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
