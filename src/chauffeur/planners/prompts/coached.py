"""S of the human-feedback setting: driving APIs, rules, and programs of a policy repository that may be called.

The repository may be shared, so whatever it holds reaches the model as quoted data, and its programs reach the sandbox
as a library that is checked with each program that calls it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chauffeur.concept import Limits, SystemMessage
from chauffeur.planners.prompts.blocks import (
    CONTEXT_CHARS,
    HISTORY_FIELD_CHARS,
    INSTRUCTION_CHARS,
    PROGRAM_CHARS,
    cap,
    data_block,
)
from chauffeur.planners.prompts.system import build_system_message, fill, template
from chauffeur.planners.prompts.turns import Message

if TYPE_CHECKING:
    from chauffeur.programs.catalogue import Vocabulary

COACHED_PROMPT_VERSION = "lmp-coached-v1"
"""Version of these templates; stands in every result whose program they brought about."""

DESCRIPTION_SENTENCES = 5


@dataclass(frozen=True, slots=True)
class Helper:
    """A program as the prompt offers it.

    Attributes:
        name: How it is called.
        description: What it does.
        learned_for: Words of the wish it was learned from.
        source: One top-level function of that name, without parameters.
    """

    name: str
    description: str
    learned_for: str
    source: str


def build_coached_message(
    helpers: Sequence[Helper],
    *,
    limits: Limits | None = None,
    vocabulary: Vocabulary = "road",
    chain_of_thought: bool = False,
) -> SystemMessage:
    """S with programs to call, the most fitting first; what does not fit into a library's size is left out.

    Args:
        helpers: Programs of the repository that bear on the wish.
        limits: Bounds the program is held to; default `Limits()`.
        vocabulary: Which of the driving APIs there are.
        chain_of_thought: Ask for numbered reasoning before the program.
    """
    base = build_system_message(
        "zero-shot", limits=limits, vocabulary=vocabulary, chain_of_thought=chain_of_thought
    ).text
    shown, library = _fitting(helpers)
    if not shown:
        return SystemMessage(f"{base}\n\n{template('no_helpers.md')}", "human-feedback")
    blocks = "\n".join(
        data_block(f"program-{number}", _entry(one), PROGRAM_CHARS + 2 * HISTORY_FIELD_CHARS)
        for number, one in enumerate(shown, start=1)
    )
    return SystemMessage(f"{base}\n\n{fill(template('helpers.md'), {'helpers': blocks})}", "human-feedback", library)


def description_messages(command: str, context: str, source: str) -> list[Message]:
    """Asks a model to describe a program that did well."""
    told = "\n\n".join(
        (
            data_block("instruction", command, INSTRUCTION_CHARS),
            data_block("context", context, CONTEXT_CHARS),
            data_block("program", source, PROGRAM_CHARS),
            f"Describe this program in at most {DESCRIPTION_SENTENCES} sentences.",
        )
    )
    return [{"role": "system", "content": template("describe.md")}, {"role": "user", "content": told}]


def _fitting(helpers: Sequence[Helper]) -> tuple[list[Helper], str]:
    """The helpers that go into one library, in order, and that library."""
    from chauffeur.programs.errors import ProgramSyntaxError
    from chauffeur.programs.library import join
    from chauffeur.programs.rewrite import parse

    shown: list[Helper] = []
    library = ""
    for helper in helpers:
        longer = join(one.source for one in (*shown, helper))
        try:
            parse(longer, "library")
        except ProgramSyntaxError:
            continue
        shown.append(helper)
        library = longer
    return shown, library


def _entry(helper: Helper) -> str:
    return "\n".join(
        (
            f"{helper.name}(): {cap(helper.description, HISTORY_FIELD_CHARS)}",
            f"It was learned from the wish: {cap(helper.learned_for, HISTORY_FIELD_CHARS)}",
            "",
            helper.source,
        )
    )
