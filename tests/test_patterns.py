"""Every regular expression of the package reads text in time that grows with its length and no faster.

Whoever's text it is, it is read in a process that has something else to do: a pattern whose time grows with the square
takes seconds over a few thousand digits. Each pattern that repeats anything without a bound is given the worst that is
known of its kind: runs of one sign, of its own words, and of what each of its repetitions takes, with an end that does
not fit. A pattern meant for the beginning of a text only says so with `\\A`.
"""

from __future__ import annotations

import json
import re
import re._constants as op  # the tree of a pattern has no public name
import re._parser as parser
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

SIGNS = (
    *("1", " ", "a", "A", ".", ",", "-", "#", "_", '"', "\n", "(", "0", "=", "/", "\t", "é", "`", "<", ";", ":", "\\"),
    *("1 ", "a ", "1.", "a.", "1,", "#1 ", "no ", "not ", "1e", "%41", "a, ", ". ", "m/s "),
)
BOUNDED = 64
"""A repetition of at most so many counts as bounded."""
SHORT, TIMES = 2000, 8
"""Signs, and how many times as many: a square takes over a millisecond of `SHORT` on a fast machine, too."""
QUICK_S = 0.001
"""Over `SHORT` signs, of a processor's time: what takes no longer is not measured any further."""
FASTEST_GROWTH = 2.5 * TIMES
"""Linear grows by 8, quadratic by 64."""


def _char(items: list[Any]) -> str:
    """A sign that a set takes."""
    pattern = parser.SubPattern(parser.State(), [(op.IN, items)])
    for sign in "a1 .,-\n\"'A_#(/é\u0438\u5ffd\u0639":
        if _takes(pattern.data[0][1], sign):
            return sign
    return next((chr(value if kind is op.LITERAL else value[0]) for kind, value in items if kind is not op.NEGATE), "a")


def _takes(items: list[Any], sign: str) -> bool:
    categories = {
        op.CATEGORY_DIGIT: sign.isdigit(), op.CATEGORY_NOT_DIGIT: not sign.isdigit(),
        op.CATEGORY_SPACE: sign.isspace(), op.CATEGORY_NOT_SPACE: not sign.isspace(),
        op.CATEGORY_WORD: sign.isalnum() or sign == "_", op.CATEGORY_NOT_WORD: not (sign.isalnum() or sign == "_"),
    }  # fmt: skip
    hit = any(
        (kind is op.LITERAL and value == ord(sign))
        or (kind is op.RANGE and value[0] <= ord(sign) <= value[1])
        or (kind is op.CATEGORY and categories[value])
        for kind, value in items
    )
    return hit != (bool(items) and items[0][0] is op.NEGATE)


def _walk(tree: Any) -> tuple[str, list[tuple[str, str]]]:
    """A short text that a pattern takes, and each of its unbounded repetitions: what comes before it, what it takes."""
    text, repeats = "", list[tuple[str, str]]()

    def inside(part: Any) -> str:
        said, more = _walk(part)
        repeats.extend((text + before, unit) for before, unit in more)
        return said

    for kind, value in tree:
        if kind is op.LITERAL:
            text += chr(value)
        elif kind is op.NOT_LITERAL:
            text += "a" if value != ord("a") else "b"
        elif kind is op.ANY:
            text += "a"
        elif kind is op.IN:
            text += _char(value)
        elif kind is op.BRANCH:
            first, *_ = [inside(branch) for branch in value[1]]
            text += first
        elif kind is op.SUBPATTERN:
            text += inside(value[3])
        elif kind is op.ATOMIC_GROUP:
            text += inside(value)
        elif kind is op.ASSERT:
            inside(value[1])
        elif kind in (op.MAX_REPEAT, op.MIN_REPEAT, op.POSSESSIVE_REPEAT):
            least, most, body = value
            said = inside(body)
            if most is op.MAXREPEAT or most > BOUNDED:
                repeats.append((text, said or "a"))
            text += said * max(least, 1)
    return text, repeats


def _attacks(pattern: re.Pattern[str], size: int) -> Iterator[str]:
    """Texts of some length, the same kinds in the same order for every length."""
    taken, repeats = _walk(parser.parse(pattern.pattern, pattern.flags))

    def run(unit: str) -> str:
        return unit * (size // len(unit) + 1)

    for sign in SIGNS:
        yield run(sign)
    for sign in ("1", " ", "a", "a "):
        yield run(sign) + "\0"
    for word in (taken, taken[:-1], taken + " "):
        if word:
            yield run(word)
    for before, unit in dict.fromkeys(repeats[:40]):
        yield before + run(unit) + "\0"
        yield run(before + unit)
        yield run(before + 8 * unit)
        for sign in ("1", " ", "a "):
            yield before + run(sign) + "\0"


def _cost_s(pattern: re.Pattern[str], text: str) -> float:
    """Of this thread's own processor time, so that a busy machine changes little."""
    before = time.thread_time()
    pattern.search(text)
    return time.thread_time() - before


def _growth(pattern: re.Pattern[str]) -> tuple[float, str]:
    """How much longer a text of `TIMES` the length takes, and which."""
    slow: list[tuple[float, int]] = []
    for kind, text in enumerate(_attacks(pattern, SHORT)):
        if _cost_s(pattern, text[:30]) > 0.01:  # of 30 signs: it grows faster than any square
            return float("inf"), text[:30]
        cost_s = _cost_s(pattern, text)
        if cost_s > QUICK_S:
            slow.append((cost_s, kind))
    slow = sorted(slow, reverse=True)[:3]
    if not slow:
        return 0.0, ""
    short, long = list(_attacks(pattern, SHORT)), list(_attacks(pattern, TIMES * SHORT))
    most = 0.0, ""
    for _, kind in slow:
        least_s = min(_cost_s(pattern, short[kind]) for _ in range(3))
        if (growth := _cost_s(pattern, long[kind]) / least_s) > FASTEST_GROWTH:
            growth = min(growth, _cost_s(pattern, long[kind]) / least_s)  # the first may have been disturbed
        most = max(most, (growth, long[kind][:40]))
        if growth > FASTEST_GROWTH:
            break
    return most


@pytest.fixture(scope="module")
def patterns() -> list[tuple[str, re.Pattern[str]]]:
    listing = [sys.executable, str(Path(__file__).with_name("patterns.py"))]
    done = subprocess.run(listing, capture_output=True, text=True, timeout=600, check=True)
    return [(module, re.compile(pattern, flags)) for module, pattern, flags in json.loads(done.stdout)]


@pytest.mark.parametrize(
    "pattern",
    [r"\d+(?:\.\d+)?\s*m/s", r"\s+$", r"(?:a |the )+b", r"x(?:a|aa)+y", r"\w+:", r"(?:(?:please|go) ?,? ?)*stop"],
)
def test_a_pattern_that_is_not_linear_is_found(pattern: str) -> None:
    assert _growth(re.compile(pattern))[0] > FASTEST_GROWTH


@pytest.mark.parametrize("pattern", [r"(?<!\d)\d+ m", r"\A\s*\w", r"(?:a |the ){1,6}b", r"\bstop\w*"])
def test_a_linear_pattern_passes(pattern: str) -> None:
    assert _growth(re.compile(pattern))[0] <= FASTEST_GROWTH


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_every_pattern_reads_any_text_in_linear_time(patterns: list[tuple[str, re.Pattern[str]]]) -> None:
    assert len(patterns) > 400
    modules = {module for module, _ in patterns}
    assert {"chauffeur.safety.faithfulness.claims", "chauffeur.safety.dangers"} <= modules
    unbounded = [each for each in patterns if _walk(parser.parse(each[1].pattern, each[1].flags))[1]]
    slow: list[str] = []
    for module, pattern in unbounded:
        growth, text = _growth(pattern)
        if growth > FASTEST_GROWTH:
            slow.append(f"{module}: {pattern.pattern[:200]!r} takes {growth:.0f} times as long over {text!r}...")
    assert not slow, "\n".join(slow)
