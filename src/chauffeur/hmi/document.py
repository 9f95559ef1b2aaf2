"""What every self-contained page is put together with: assets of the package, slots, hashes for its content policy."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Mapping
from importlib import resources

_EXPORT = re.compile(r"^export ", re.MULTILINE)
_SLOT = re.compile(r"\{\{(\w+)\}\}")


def fill(template: str, values: Mapping[str, str]) -> str:
    """Fill every slot (`{{name}}`) in one pass: what is put in is never looked at again."""
    return _SLOT.sub(lambda match: values[match.group(1)], template)


def asset(name: str, package: str = "chauffeur.hmi") -> str:
    """Text of a file in the folder `assets` of a package; of a module, without the `export` that a script of one piece
    cannot have."""
    text = resources.files(package).joinpath("assets", name).read_text(encoding="utf-8")
    return _EXPORT.sub("", text) if name.endswith(".js") else text


def content_hash(text: str) -> str:
    """A style's or script's text as a source of a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def printable(text: str) -> str:
    """Text that UTF-8 can carry: lone surrogates are legal in a string and not in a file."""
    return text.encode("utf-8", "replace").decode()
