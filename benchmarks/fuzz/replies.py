"""The reply parsers: what a model wrote, taken apart into thoughts, a program, a refusal or a question."""

from __future__ import annotations

from functools import cache

from chauffeur.concept import ProgramError
from chauffeur.planners import llm_reply
from chauffeur.planners.onboard import dialect, reply
from chauffeur.programs.extract import extract_program
from chauffeur.programs.gate import check_source
from fuzz import programs
from fuzz.target import Target, bytes_of, expect, text_of
from fuzz.words import changed

_PROGRAM = "def drive():\n    yield from wait(2.5)\n    if clear_left():\n        yield from lane_left()\n"
_LONGER = (
    "def drive():\n    while not lead_closer_than(feet(100)):\n        yield autopilot()\n"
    '    yield from slower_by(0.5 * mph(10), "gently")\n'
)


@cache
def seeds() -> tuple[bytes, ...]:
    """Replies in the forms that models give."""
    written = [text_of(data) for data in programs.seeds()[:20]]
    forms = [f"Thoughts: I keep the lane.\n```python\n{text}\n```\nDone." for text in written]
    forms += [
        f"{written[0]}",
        f"<think>Maybe {written[1]}</think>\n~~~py\n{written[2]}~~~",
        "REFUSE: That is unsafe.",
        "",
    ]
    forms += [f"```python\n{text}```\nI wait, then I move." for text in (_PROGRAM, _LONGER)]
    forms += ["ASK: Which lane?", "**REFUSE:** no\n```python\nx\n```", f"First\n{written[3]}\nThen\n```\n{written[4]}"]
    return tuple(map(bytes_of, forms))


def examine(data: bytes) -> str:
    """Read a reply in every way that a planner does."""
    text = text_of(data)
    found = extract_program(text)
    if found.source is not None:
        check_source(found.source)
    for cut in (False, True):
        read = llm_reply.read_reply(text, cut=cut)
        ways = (read.source is not None, bool(read.refusal), bool(read.problem))
        expect(sum(ways) == 1, "a reply is not exactly one of program, refusal and problem")
        expect(read.source is None or read.source.strip(), "a program is blank")
    return f"{_kind(read)}, {_onboard(text)}"


def _kind(read: llm_reply.Reply) -> str:
    return "program" if read.source is not None else "refusal" if read.refusal else "problem"


def _onboard(text: str) -> str:
    try:
        read = reply.read_reply(text)
    except ProgramError:
        return "not of the dialect"
    if read.steps:
        again = dialect.read(dialect.write(read.steps))
        expect(dialect.write(again) == dialect.write(read.steps), "writing and reading a program changes it")
        expect(dialect.tell(read.steps), "a program cannot be told")
        return "dialect"
    return "question" if text.startswith("ASK") else "declined"


TARGET = Target(
    name="replies",
    invariant=(
        "No reply makes a parser raise anything but ProgramError; a reply is exactly one of program, refusal and "
        "problem; a program of the dialect is the same once written and read again."
    ),
    reads=(
        "chauffeur.programs.extract",
        "chauffeur.planners.llm_reply",
        "chauffeur.planners.onboard.reply",
        "chauffeur.planners.onboard.dialect",
    ),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
