"""What comes out of the sandbox as another text than one would think was foreseen all the same; found by fuzzing."""

from __future__ import annotations

import pytest
from straight_road import StraightRoad

from chauffeur.programs import ProgramExecutor, check_source
from chauffeur.programs.verify import verify
from chauffeur.programs.verify.values import constant


def _foreseen(executor: ProgramExecutor, source: str) -> bool:
    """Whether what a program really says is among what verification says it may say."""
    assert check_source(source).passed
    (call,) = (call for call in verify(source).calls if call.name == "say")
    executor.start(source, StraightRoad())
    (made,) = (made for made in executor.tick().made if made.name == "say")
    said = call.argument("text")
    return said is not None and said.holds(made.given[0])


@pytest.mark.parametrize("text", ["\\ud800", "a\\udfffb", "\\N{BULLET}", "é", ""])
def test_what_is_said_was_foreseen(executor: ProgramExecutor, text: str) -> None:
    source = f'def main():\n    say("{text}")\n    yield autopilot()\n'
    assert _foreseen(executor, source)


@pytest.mark.parametrize(
    "value", ["range(2)", "lambda: 1", "{}.keys()", "iter([1])", "set_target_speed", "math", "str(1)", "1.5", "None"]
)
def test_what_leaves_the_sandbox_as_its_description_was_foreseen(executor: ProgramExecutor, value: str) -> None:
    source = f"import math\ndef main():\n    say({value})\n    yield autopilot()\n"
    assert _foreseen(executor, source)


def test_a_comparison_of_such_texts_rules_nothing_out(executor: ProgramExecutor) -> None:
    source = (
        'def main():\n    if "\\ud800" == "\\udfff":\n        say("same")\n    else:\n        say("other")\n'
        "    yield autopilot()\n"
    )
    report = verify(source)
    executor.start(source, StraightRoad())
    (made,) = (made for made in executor.tick().made if made.name == "say")
    line = 3 if made.given[0] == "same" else 5
    assert line not in report.unreachable


def test_other_texts_are_known() -> None:
    assert constant("é").texts == frozenset({"é"})
    assert constant("\ud800").texts is None
