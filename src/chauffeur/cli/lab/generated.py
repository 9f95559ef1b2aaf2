"""Commands made of functions: an option for each argument, with its type, default, bound and the sentence of `Args:`.

An option is declared once, where it is used: in the signature and docstring of a benchmark, or of what makes data or a
model. `Annotated[int, Ge(1)]` bounds a number.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import typer
from annotated_types import Ge


def command_taking(name: str, parameters: Sequence[inspect.Parameter], run: Callable[..., None], **said: Any) -> Any:
    """Make the click command of a function that takes these parameters."""
    app = typer.Typer(rich_markup_mode="markdown", add_completion=False)
    app.command(name, **said)(taking(parameters, run))
    return typer.main.get_command(app)


def taking(parameters: Sequence[inspect.Parameter], run: Callable[..., None]) -> Callable[..., None]:
    """Give a function of keywords these parameters, as Typer reads them."""
    ordered = sorted(parameters, key=lambda one: one.default is not inspect.Parameter.empty)
    named = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in ordered]
    run.__signature__ = inspect.Signature(named)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def options_of(make: Any) -> list[inspect.Parameter]:
    """List the options that a class or function states: a parameter each, with the sentence of its docstring.

    Those before a `/` are arguments of the command, not options.

    A function that hands `**options` on has those of the class that it returns, too.
    """
    try:
        hints = get_type_hints(make.__init__ if isinstance(make, type) else make, include_extras=True)
        parameters = inspect.signature(make).parameters.values()
    except (TypeError, ValueError, NameError):
        return []
    said = _arguments(make)
    found = {
        one.name: inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=one.default,
            annotation=Annotated[
                _kind(hints.get(one.name, str)), _told(one, said.get(one.name, ""), _least(hints.get(one.name)))
            ],
        )
        for one in parameters
        if one.kind not in (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    }
    if any(one.kind is inspect.Parameter.VAR_KEYWORD for one in parameters) and isinstance(hints.get("return"), type):
        found |= {one.name: one for one in options_of(hints["return"]) if one.name not in found}
    return list(found.values())


def _told(one: inspect.Parameter, said: str, least: float | None) -> Any:
    if one.kind is inspect.Parameter.POSITIONAL_ONLY:
        return typer.Argument(help=said)
    return typer.Option(*_flag(one), help=said, min=least)


def _flag(one: inspect.Parameter) -> tuple[str, ...]:
    """The option's name: of a number without its unit; what is off by default can only be turned on."""
    bare = re.sub(r"_(?:s|m|px|mps)$", "", one.name)
    return (f"--{bare.replace('_', '-')}",) if bare != one.name or one.default is False else ()


def _least(hint: Any) -> float | None:
    """The bound of a number that its type states."""
    known = [hint, *get_args(hint)]  # of an optional number, too
    found = (one.ge for each in known for one in getattr(each, "__metadata__", ()) if isinstance(one, Ge))
    return next(found, None)  # type: ignore[return-value]


def _kind(hint: Any) -> Any:
    """The type of an option: of a union that takes text, text; of an optional one, that type or None."""
    if get_origin(hint) is Annotated:
        return _kind(get_args(hint)[0])
    if get_origin(hint) in (Union, UnionType):
        kinds = [one for one in get_args(hint) if one is not NoneType]
        kind = str if str in kinds else _kind(kinds[0])
        return kind | None if NoneType in get_args(hint) else kind
    if get_origin(hint) in (Sequence, list):
        return list[_kind(get_args(hint)[0])]
    return hint if hint in (int, float, bool, str, Path) or get_origin(hint) is Literal else str


def _arguments(make: Any) -> dict[str, str]:
    """Sentences of the `Args:` of a docstring, by argument."""
    docs = [make.__doc__, make.__init__.__doc__] if isinstance(make, type) else [make.__doc__]
    text = "\n".join(inspect.cleandoc(doc) for doc in docs if doc)
    block = re.search(r"^Args:\n((?:[ ]+.*\n?|\n)+)", text, re.MULTILINE)
    if block is None:
        return {}
    found = re.findall(r"^ {4}(\w+): ((?:.*\n?)(?: {8}.*\n?)*)", block[1], re.MULTILINE)
    return {name: " ".join(words.split()) for name, words in found}
