"""Lines of standard input while something else goes on: reading never waits longer than it is told to.

At a terminal the line being typed is edited here and shown by whoever owns the screen: the terminal's own echo would
write it into lines that are rewritten ten times a second.
"""

from __future__ import annotations

import codecs
import contextlib
import os
import re
import select
import sys
import time
from types import TracebackType
from typing import Any, Final, Self

MOST_CHARACTERS: Final = 8000
"""Of a line; what is longer is cut. No wish may be nearly as long."""

_CHUNK: Final = 4096
_ESCAPES: Final = re.compile(r"\x1b(\[[0-?]*[ -/]*[@-~]|O.|.)?", re.DOTALL)
"""What arrow and function keys send."""


class Lines:
    """Reads a file descriptor line by line. Use as a context manager: a terminal is given back as it was.

    Attributes:
        terminal: Whether somebody types.
        typed: What there is of the next line.
        open: Whether more may come.
    """

    def __init__(self, descriptor: int | None, *, edited: bool = False) -> None:
        """Read lines.

        Args:
            descriptor: Where from; None for no lines at all. See `standard_input`.
            edited: Whether lines typed at a terminal are edited here, and somebody else shows them.
        """
        self._descriptor = descriptor
        self.terminal = descriptor is not None and os.isatty(descriptor)
        self._edited = edited and self.terminal
        self.open = self._descriptor is not None
        self.typed = ""
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._before: list[Any] | None = None

    def __enter__(self) -> Self:
        if self._edited and self._descriptor is not None:
            import termios

            self._before = termios.tcgetattr(self._descriptor)
            mode = termios.tcgetattr(self._descriptor)
            mode[3] &= ~(termios.ECHO | termios.ICANON)
            mode[6][termios.VMIN], mode[6][termios.VTIME] = 1, 0
            mode[6][termios.VSUSP] = b"\0"  # Ctrl-Z would stop the one that looks after the others
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, mode)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None and self._descriptor is not None:
            import termios

            with contextlib.suppress(termios.error):  # the terminal is gone
                termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
            self._before = None

    def read(self, wait_s: float) -> list[str]:
        """Lines that have come, after waiting at most that long for the first byte."""
        if not self.open or self._descriptor is None:
            time.sleep(wait_s)
            return []
        if not select.select([self._descriptor], [], [], wait_s)[0]:
            return []
        try:
            data = os.read(self._descriptor, _CHUNK)
        except OSError:  # the terminal is gone
            data = b""
        if not data:
            self.open = False
            rest, self.typed = self.typed + self._decoder.decode(b"", final=True), ""
            return [rest] if rest and not self._edited else []
        text = self._decoder.decode(data)
        return self._edit(_ESCAPES.sub("", text)) if self._edited else self._split(text)

    def _split(self, text: str) -> list[str]:
        *lines, rest = (self.typed + text).split("\n")
        self.typed = rest[:MOST_CHARACTERS]
        return [line[:MOST_CHARACTERS].rstrip("\r") for line in lines]

    def _edit(self, text: str) -> list[str]:
        lines: list[str] = []
        for key in text:
            match key:
                case "\r" | "\n":
                    lines.append(self.typed)
                    self.typed = ""
                case "\x7f" | "\b":
                    self.typed = self.typed[:-1]
                case "\x15":  # Ctrl-U
                    self.typed = ""
                case "\x17":  # Ctrl-W
                    self.typed = self.typed.rstrip().rpartition(" ")[0]
                case "\x04" if not self.typed:  # Ctrl-D
                    self.open = False
                case "\t":
                    self.typed += " "
                case _ if key.isprintable() and len(self.typed) < MOST_CHARACTERS:
                    self.typed += key
                case _:
                    pass
        return lines


def standard_input() -> int | None:
    """Descriptor of standard input, None where there is none."""
    try:
        return sys.stdin.fileno()
    except (AttributeError, OSError, ValueError):  # there is none
        return None
