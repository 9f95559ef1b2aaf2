"""Examples in the help of every command, out of `examples.md`."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any


def give_examples(command: Any, words: tuple[str, ...] = (), above: str = "") -> None:
    """Let the help of a command, and of all commands below it, end with its examples.

    Args:
        command: A click command or group.
        words: Behind `chauffeur`, they name it.
        above: Examples of its group: where it has none, those of them that are its own are shown.
    """
    own = help_text_or_none(" ".join(words) or "chauffeur")
    if own is None:
        begins = f"    chauffeur {' '.join(words)} "
        lines = [line for line in above.splitlines() if f"{line} ".startswith(begins)]
        own = "\nExamples:\n\n" + "\n\n".join(lines) + "\n" if lines else None
    command.epilog = command.epilog or own
    for name, child in getattr(command, "commands", {}).items():
        give_examples(child, (*words, name), command.epilog or "")


@cache
def _texts() -> dict[str, str]:
    text = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.+)\n", text, flags=re.MULTILINE)[1:]
    return {name: body.strip("\n") for name, body in zip(parts[::2], parts[1::2], strict=True)}


def help_text_or_none(name: str) -> str | None:
    """What the help of a command ends with; None where there are no examples of it."""
    return f"\n{_texts()[name]}\n" if name in _texts() else None
