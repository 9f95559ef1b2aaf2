"""Reading whatever a model may write."""

from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from server import PROGRAM, REPLY

from chauffeur.planners.llm_reply import read_reply

FENCED = f"```python\n{PROGRAM}```"


@pytest.mark.parametrize(
    ("text", "thoughts"),
    [
        (REPLY, "Hold 25 m/s."),
        (f"**Thoughts:** Hold it.\n{FENCED}", "Hold it."),
        (f"THOUGHTS: Hold it.\n{FENCED}\nGood luck!", "Hold it.\nGood luck!"),
        (f"Hold it.\r\n{FENCED}".replace("\n", "\r\n"), "Hold it."),
        (FENCED, ""),
        (PROGRAM, ""),
        (f"Hold it.\n```\n{PROGRAM}```", "Hold it."),
        (f"<think>```python\ndef draft():\n    yield 1\n```</think>Hold it.\n{FENCED}", "Hold it."),
        (f"Hold it.\n```python\n{PROGRAM}", "Hold it."),
    ],
)
def test_thoughts_and_program_are_told_apart(text, thoughts):
    reply = read_reply(text)
    assert reply.source is not None
    assert reply.source.strip() == PROGRAM.strip()
    assert [line for line in reply.thoughts.splitlines() if line] == [line for line in thoughts.splitlines() if line]
    assert reply.refusal == "" and reply.problem == ""


@pytest.mark.parametrize(
    "text",
    [
        "REFUSE: Not here.",
        "Thoughts: hm.\nREFUSE: Not here.",
        "**REFUSE:** Not here.",
        f"{FENCED}\nREFUSE: Not here.",
        "  > REFUSE : Not here.",
        "REFUSE:\n\n**Not here.**",
    ],
)
def test_a_refusal_is_taken_at_its_word(text):
    reply = read_reply(text)
    assert (reply.refusal, reply.source, reply.problem) == ("Not here.", None, "")


def test_a_refusal_without_a_reason_is_still_one():
    assert "without giving a reason" in read_reply("REFUSE:").refusal


def test_a_refusal_inside_a_program_or_a_sentence_is_none():
    assert read_reply(f"I will not REFUSE: fine.\n{FENCED}").source is not None
    assert read_reply("```python\n# REFUSE: x\ndef f():\n    yield autopilot()\n```").source is not None


@pytest.mark.parametrize(
    "text", ["", " \n", "Just prose.", '{"a": [1', "[]", "```python\n```", "```", "<think>still thinking", "\x00\ufffd"]
)
def test_nothing_usable_is_said_in_words(text):
    reply = read_reply(text)
    assert reply.source is None and reply.refusal == "" and reply.problem


def test_a_cut_answer_counts_only_when_its_program_is_closed():
    assert read_reply(f"Hm.\n{FENCED}\nAnd furth", cut=True).source is not None
    assert "cut off" in read_reply(f"Hm.\n```python\n{PROGRAM}", cut=True).problem
    assert "cut off" in read_reply("Hm, let me", cut=True).problem


@pytest.mark.parametrize(
    "text",
    [
        "`" * 5_000_000,
        "```\n" * 500_000,
        "REFUSE" * 500_000,
        "* " * 2_000_000,
        "\n" * 5_000_000,
        "REFUSE:" + " " * 3_000_000,
        "<think>" * 500_000,
        "def f():\n" * 300_000,
        "_" * 3_000_000,
        "(" * 1_000_000,
        "Thoughts" + " *" * 1_000_000,
        "def f():\n" + "    x = 1\n" * 100_000 + "and that is it\n" * 100,
    ],
)
def test_floods_take_no_time(text):
    started = time.process_time()
    reply = read_reply(text)
    assert time.process_time() - started < 2.0
    assert len(reply.thoughts) <= 8_000


@settings(max_examples=300, deadline=None)
@given(
    st.text(max_size=400)
    | st.lists(
        st.sampled_from(
            [
                "```",
                "```python",
                "~~~",
                "\n",
                "REFUSE:",
                "Thoughts:",
                "def f():",
                "    yield 1",
                "<think>",
                "</think>",
                " x",
            ]
        ),
        max_size=30,
    ).map("".join)
)
def test_no_text_raises_and_every_text_has_one_outcome(text):
    reply = read_reply(text)
    assert (reply.source is not None) + bool(reply.refusal) + bool(reply.problem) == 1
