"""How the command line fails: one line saying what is wrong, one saying what to do, and an exit code."""

from __future__ import annotations

import os
from collections.abc import Iterator
from types import TracebackType
from typing import Any

import typer
from typer.core import TyperGroup

from chauffeur.concept import (
    ChauffeurError,
    ConfigError,
    DataError,
    InstructionError,
    MissingExtraError,
    ProfileError,
    ScenarioError,
)

FAILED = 1
"""The drive failed or was refused."""
BAD_INPUT = 2
"""The command was given something it cannot use."""

_BAD_INPUT = (ConfigError, DataError, InstructionError, MissingExtraError, ProfileError, ScenarioError)


class FriendlyGroup(TyperGroup):
    """Commands whose own errors end in words, not in a traceback; CHAUFFEUR_DEBUG=1 shows the traceback."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command; one that stands in a group is named with it."""
        if args and args[0] not in self.commands and (found := list(_places(self, args[0], "chauffeur"))):
            ctx.fail(f"No such command {args[0]!r}. Did you mean: {' or '.join(found)}?")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except ChauffeurError as error:
            if debugging():
                raise
            show_error(error)
            raise typer.Exit(exit_code(error)) from error


def _places(group: Any, name: str, path: str) -> Iterator[str]:
    """Every command or group of a name below a group, as it is typed."""
    for known, command in group.commands.items():
        if known == name:
            yield f"{path} {known}"
        if hasattr(command, "commands"):
            yield from _places(command, name, f"{path} {known}")


def debugging() -> bool:
    """Whether tracebacks are wanted."""
    return os.environ.get("CHAUFFEUR_DEBUG", "") not in ("", "0")


def show_crash(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Exception hook of the script: a fault of ours, in a line that can be reported."""
    del trace
    show_error(
        ChauffeurError(
            f"Chauffeur itself failed: {kind.__name__}: {error}",
            hint="Please report it, with what CHAUFFEUR_DEBUG=1 prints for the same command.",
        )
    )


def exit_code(error: ChauffeurError) -> int:
    """2 when the person can put it right at the command line, 1 when the drive could not be had."""
    return BAD_INPUT if isinstance(error, _BAD_INPUT) else FAILED


def show_error(error: ChauffeurError) -> None:
    """Print an error and its hint to standard error."""
    from rich.text import Text

    from chauffeur.cli.console import plain, stderr

    console = stderr()
    console.print(Text.assemble(("Error: ", "bold red"), plain(error.message)))
    if error.hint:
        console.print(Text.assemble(("Hint: ", "bold"), plain(error.hint)))
