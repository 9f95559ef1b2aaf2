"""Ctrl-C: long work is kept; of what drives the first asks it to come to an end, the second ends it at once."""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType, TracebackType
from typing import TYPE_CHECKING, Any, Self

import typer

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def stopped_kindly(console: Console, *kept: Path | None) -> Generator[None]:
    """Answer Ctrl-C in long work: say where what is done is kept, and leave with code 130."""
    try:
        yield
    except KeyboardInterrupt:
        where = " and ".join(str(path) for path in kept if path is not None)
        said = f" What is done is kept in {where}; run the same command to go on." if where else ""
        console.print(f"Stopped.{said}", soft_wrap=True)
        raise typer.Exit(130) from None


class Interrupts:
    """Counts Ctrl-C (and a hang-up, and a plain kill) instead of raising; the second raises KeyboardInterrupt.

    Attributes:
        count: How often it was asked to end.
    """

    def __init__(self) -> None:
        self.count = 0
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        heard = [number for number in numbers if signal.getsignal(number) != signal.SIG_IGN]  # nohup stays nohup
        self._before = {number: signal.signal(number, self._hear) for number in heard}
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.count += 1
        if self.count > 1:
            raise KeyboardInterrupt
