"""The renderer's shaders, out of `shaders.glsl`: parts by name, with what they include."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path


@cache
def _parts() -> dict[str, str]:
    text = Path(__file__).with_suffix(".glsl").read_text(encoding="utf-8")
    named = re.split(r"^//// (\w+)\n", text, flags=re.MULTILINE)[1:]
    return {name: body.strip() + "\n" for name, body in zip(named[::2], named[1::2], strict=True)}


def shader(name: str) -> str:
    """GLSL of a part, whole."""
    return re.sub(r"^#include (\w+)\n", lambda found: shader(found[1]), _parts()[name], flags=re.MULTILINE)
