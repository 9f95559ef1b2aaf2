"""Examples in the help of every command: a group's serve the commands that have none of their own."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

from typer.core import TyperGroup


class WithExamples(TyperGroup):
    """A group of commands; one without an epilog shows those of the group's examples that begin with its name."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        lines = [line for line in (self.epilog or "").splitlines() if line.startswith("    chauffeur ")]
        for name, command in self.commands.items():
            own = [line for line in lines if f" {self.name} {name} " in f"{line} "]
            if not command.epilog and own:
                command.epilog = "\nExamples:\n\n" + "\n\n".join(own) + "\n"


@cache
def _texts() -> dict[str, str]:
    text = Path(__file__).with_suffix(".md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.+)\n", text, flags=re.MULTILINE)[1:]
    return {name: body.strip("\n") for name, body in zip(parts[::2], parts[1::2], strict=True)}


def help_text(name: str) -> str:
    """What the help of a module's commands ends with, out of `examples.md`."""
    return f"\n{_texts()[name]}\n"


def help_text_or_none(name: str) -> str | None:
    """As `help_text`; None where there are no examples."""
    return help_text(name) if name in _texts() else None
