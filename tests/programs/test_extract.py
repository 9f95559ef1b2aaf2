"""From replies to programs."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.programs import check_source, extract_program

PROGRAM = "def main():\n    yield autopilot()\n"


@pytest.mark.parametrize(
    ("reply", "thoughts"),
    [
        (PROGRAM, ""),
        (f"```python\n{PROGRAM}```", ""),
        (f"I will follow.\n```python\n{PROGRAM}```\nDone.", "I will follow.\nDone."),
        (f"```\n{PROGRAM}\n```", ""),
        (f"~~~py\n{PROGRAM}~~~", ""),
        (f"````python\n{PROGRAM}````", ""),
        (f"```Python\r\n{PROGRAM}```".replace("\n", "\r\n"), ""),
        ("  ```python\n  def main():\n      yield autopilot()\n  ```", ""),
        (f"Plan:\n```text\nfollow\n```\nCode:\n```python\n{PROGRAM}```", "Plan:\n```text\nfollow\n```\nCode:"),
        (f"Cut off:\n```python\n{PROGRAM}", "Cut off:"),
        (f"Plan: follow.\nCode:\n{PROGRAM}\nThis follows the road.", "Plan: follow.\nCode:\n\nThis follows the road."),
        (f'```json\n{{"a": 1}}\n```\n```python title="x"\n{PROGRAM}```', None),
    ],
)
def test_finds_the_program(reply: str, thoughts: str | None) -> None:
    found = extract_program(reply)
    assert found.source is not None
    assert found.source.strip() == PROGRAM.strip()
    assert check_source(found.source).passed
    if thoughts is not None:
        assert found.thoughts == thoughts


def test_helpers_and_imports_stay() -> None:
    source = (
        "import math\n\nLIMIT = 3\n\ndef helper():\n    yield autopilot()\n\ndef main():\n    yield from helper()\n"
    )
    found = extract_program(f"Here:\n```python\n{source}```")
    assert found.source == source


@pytest.mark.parametrize("reply", ["", "No.", "I cannot do that.", "```json\n{}\n```", "default is fine", "```"])
def test_no_program_is_none(reply: str) -> None:
    found = extract_program(reply)
    assert not (found.source or "").strip()


def test_a_broken_program_is_handed_on_for_the_gate_to_explain() -> None:
    for reply in ("```python\ndef main(:\n    yield\n```", "Code:\ndef main(:\n    yield\n"):
        found = extract_program(reply)
        assert found.source is not None
        assert check_source(found.source).errors[0].code == "syntax"


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=400))
def test_never_raises(text: str) -> None:
    extract_program(text)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            ["```python\n", "```\n", "~~~\n", PROGRAM, "Plan.\n", "  ", "```", "def ", "\n", "import math\n"]
        ),
        max_size=20,
    ).map("".join)
)
def test_never_raises_on_fences(text: str) -> None:
    found = extract_program(text)
    assert found.source is None or isinstance(found.source, str)
