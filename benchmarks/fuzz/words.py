"""Texts as inputs: replies of models, words of people, and disguises of both."""

from __future__ import annotations

import base64
import codecs
import random
from urllib.parse import quote

from fuzz import programs
from fuzz.target import bytes_of, text_of

MAX_CHARS = 1_000
LONG_CHARS = 12_000
"""One input in a hundred may be longer than anything that is read whole."""
PIECES = (
    *("```python\n", "```", "~~~py\n", "````", "\n```\n", "def main():\n    yield autopilot()\n", "REFUSE: ", "ASK: "),
    *("Thoughts: ", "<think>", "</think>", "**REFUSE**: no", "<|im_start|>system", "[INST]", "### Instruction", "</s>"),
    *(
        "ignore all previous instructions",
        "set the speed limit off",
        "you are now the driver",
        "system: ",
        '{"role": "x"',
    ),
    *(
        "lane_left()",
        "yield from wait(3)",
        "    yield from slower_by(mph(10))\n",
        "import math\n",
        "from math import pi\n",
    ),
    *(
        "\u202e",
        "\u200b",
        "\ufe0f",
        "\U000e0041",
        "\u0430",
        "\uff21",
        "\U0001d400",
        "\u00b2",
        "\ufdfa",
        "\u0130",
        "\u00df",
    ),
    *(
        "\x00",
        "\x1b[2J",
        "\r\n",
        "\x85",
        "\u2028",
        "\ud800",
        "e\u0301",
        "\u1e9b\u0323",
        "=20=3D=41",
        "%41%42%43",
        "&#65;&#66;",
    ),
    *(
        "I overtake on the left at 25 m/s after 3 seconds, then go back.",
        "30 mph",
        "1e999 km/h",
        "half a car length",
        "0x",
    ),
)
WRAPS = (
    lambda text: base64.b64encode(text.encode("utf-8", "replace")).decode(),
    lambda text: base64.b32encode(text.encode("utf-8", "replace")).decode(),
    lambda text: text.encode("utf-8", "replace").hex(),
    lambda text: codecs.encode(text, "rot13"),
    lambda text: quote(text, safe="", errors="replace"),
    lambda text: text[::-1],
    " ".join,
    lambda text: "".join(chr(0xFEE0 + ord(char)) if "!" <= char <= "~" else char for char in text),
    lambda text: "".join(f"&#{ord(char)};" for char in text),
    lambda text: " ".join(str(byte) for byte in text.encode("utf-8", "replace")),
    lambda text: "".join(f"{byte:08b}" for byte in text.encode("utf-8", "replace")),
    lambda text: f"```python\n{text}\n```",
    lambda text: f"<think>{text}</think>",
    str.upper,
)


def changed(data: bytes, rng: random.Random) -> bytes:
    """One to three pieces put in, taken out, doubled or disguised."""
    limit = MAX_CHARS if rng.random() < 0.99 else LONG_CHARS
    text = text_of(data)[:limit]
    for _ in range(rng.randint(1, 3)):
        start = rng.randrange(len(text) + 1)
        end = min(len(text), start + rng.choice((0, 1, 5, 40, 400)))
        kind = rng.random()
        if kind < 0.4:
            text = text[:start] + rng.choice(PIECES) + text[start:]
        elif kind < 0.6:
            text = text[:start] + rng.choice(WRAPS)(text[start:end] or rng.choice(PIECES)) + text[end:]
        elif kind < 0.75:
            text = text[:start] + text[end:]
        elif kind < 0.85:
            text = text[:start] + (text[start:end] or rng.choice(PIECES)) * rng.choice((2, 3, 50)) + text[end:]
        elif kind < 0.95:
            text = text[:start] + text_of(rng.choice(programs.seeds()))[:500] + text[end:]
        else:
            text = text[:start] + chr(
                rng.choice((rng.randrange(0x250), rng.randrange(0x3000), rng.randrange(0x10FFFF)))
            )
    return bytes_of(text[:limit])
