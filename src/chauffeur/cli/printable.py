"""Foreign text, made fit for a terminal."""

from __future__ import annotations

import logging
import unicodedata


def printable(text: str) -> str:
    """Text without what a terminal would carry out or hide: control and format characters and halves of characters."""
    if text.isprintable():
        return text
    return "".join(map(_printable, text))


def _printable(character: str) -> str:
    if character in "\n\t":
        return character
    match unicodedata.category(character):
        case "Cc" | "Cf":
            return ""
        case "Cs":  # cannot be written at all
            return "\N{REPLACEMENT CHARACTER}"
        case "Zl" | "Zp":
            return " "
        case _:
            return character


class PrintableFormatter(logging.Formatter):
    """Log lines quote servers, files and models."""

    def format(self, record: logging.LogRecord) -> str:
        """As logging formats it, made printable."""
        return printable(super().format(record))
