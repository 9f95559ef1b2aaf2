"""Reads the expert's program texts and fills in their numbers.

An `.lmp` file holds texts, each under a line `### name`: a program, or in `common.lmp` a helper. `$NAME` stands for a
number or a word, a line `@helper` for a helper's text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import resources
from string import Template

PROGRAMS = ("distance", "speed", "lane", "overtake", "pull_over", "cross")
_HELPER = re.compile(r"^@(\w+)\n", re.MULTILINE)


def filled(name: str, values: Mapping[str, str]) -> str:
    """A program's text. Raises KeyError for an unknown program or a value that is missing."""
    return Template(_texts()[name]).substitute(values)


def open_names(name: str) -> frozenset[str]:
    """Names of the values a program's text asks for."""
    return frozenset(Template(_texts()[name]).get_identifiers())


@cache
def _texts() -> Mapping[str, str]:
    helpers = _sections("common")
    texts: dict[str, str] = {}
    for file in PROGRAMS:
        for name, body in _sections(file).items():
            texts[name] = _HELPER.sub(lambda match: f"{helpers[match[1]].strip()}\n\n\n", body).strip() + "\n"
    return texts


def _sections(file: str) -> dict[str, str]:
    text = resources.files("chauffeur.bench.lampilot.expert").joinpath(f"{file}.lmp").read_text(encoding="utf-8")
    parts = re.split(r"^### (\w+)\n", text, flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))
