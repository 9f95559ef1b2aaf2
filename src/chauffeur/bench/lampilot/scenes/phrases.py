"""The wordings of generated scenes: the tables in `data/scenes`, and the politeness put around their imperatives.

The test split alone says what the tables hold out. Templates are our own; no sentence of LaMPilot's data is among them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache

import numpy as np

from chauffeur.concept.data import data_folder
from chauffeur.language.grammar import Grammar, GrammarFrame, Manner, Template, Wording

__all__ = ["FILES", "Template", "Wording", "say", "sections", "templates"]

FILES = ("pieces", "distance", "speed", "road", "steps", "hints", "refusals")

_TIMED = re.compile(r"\b(?:now|when|once|here|there|until|at the)\b")
"""Imperatives that end badly with "now" or "for me"."""
_OF_US = re.compile(r"\b(?:us|your)\b")
"""Imperatives that cannot follow "let's"."""
_MANNER = Manner(
    frames=(
        GrammarFrame("{body}"),
        GrammarFrame("{body}"),
        GrammarFrame("{body}"),
        GrammarFrame("please {body}"),
        GrammarFrame("{body}, please"),
        GrammarFrame("(could|can|would|will) you {body}"),
        GrammarFrame("(could|can|would) you please {body}"),
        GrammarFrame("I('d like| want| need) you to {body}"),
        GrammarFrame("(okay|alright|hey), {body}"),
        GrammarFrame("{body} (now|for me)", plain=_TIMED),
        GrammarFrame("let's {body}", unless=_OF_US),
    ),
    questions=("could you", "can you", "would you", "will you"),
)


@cache
def _grammar() -> Grammar:
    return Grammar(data_folder("scenes"), FILES, _MANNER)


def templates(section: str, *, held: bool | None = None) -> tuple[Template, ...]:
    """Templates of a section; `held` chooses those held out (True) or the others (False). KeyError if unknown."""
    return _grammar().templates(section, held=held)


def sections() -> tuple[str, ...]:
    """Names of all sections."""
    return _grammar().sections()


def say(template: Template, slots: Mapping[str, str], rng: np.random.Generator) -> Wording:
    """One wording of a template. KeyError if it has a slot that is not given."""
    return _grammar().say(template, slots, rng)
