"""Program texts with open numbers and shared top-level helpers.

An `.lmp` file holds texts, each under a line `### name`: a program, or in `common.lmp` a helper. `$NAME` stands for a
number or a word, a line `@helper` for a helper's text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import resources

_HELPER = re.compile(r"^@(\w+)\n", re.MULTILINE)


@cache
def read_texts(package: str, files: tuple[str, ...], helpers: str) -> Mapping[str, str]:
    """The programs of some files of a package, with the helpers of another package's `common.lmp` put in."""
    common = sections(helpers, "common")
    texts: dict[str, str] = {}
    for file in files:
        for name, body in sections(package, file).items():
            texts[name] = _HELPER.sub(lambda match: f"{common[match[1]].strip()}\n\n\n", body).strip() + "\n"
    return texts


@cache
def programs(package: str, file: str) -> Mapping[str, str]:
    """The programs of an `.lmp` file by name, each with one line end behind it."""
    return {name: f"{text.rstrip()}\n" for name, text in sections(package, file).items()}


@cache
def sections(package: str, file: str) -> Mapping[str, str]:
    """The texts of an `.lmp` file by name, in its order."""
    text = resources.files(package).joinpath(f"{file}.lmp").read_text(encoding="utf-8")
    parts = re.split(r"^### (.+)\n", text, flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))
