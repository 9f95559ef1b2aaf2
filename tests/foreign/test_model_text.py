"""A model's answer in what it wrote: reasoning in every spelling, turn markers, replies that were cut."""

from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.foreign.model_text import MAX_REPLY_CHARS, read_model_text

DRAFT = "Maybe faster?\n```python\ndef drive():\n    set_target_speed(31)\n    yield autopilot()\n```\nREFUSE: no\nHm."
ANSWER = "Slower.\n```python\ndef drive():\n    yield autopilot()\n```"

FINAL = "<|start|>assistant<|channel|>final <|message|>"

REASONING = {
    "think": "<think>{}</think>",
    "thinking": "<thinking>{}</thinking>",
    "thought": "<thought>{}</thought>",
    "thoughts": "<Thoughts>{}</Thoughts>",
    "reasoning": "<reasoning>{}</reasoning>",
    "analysis": "<analysis>{}</analysis>",
    "scratchpad": "<scratchpad>{}</scratchpad>",
    "reflection": "<reflection>{}</reflection>",
    "monologue": "<inner_monologue>{}</inner_monologue>",
    "chain of thought": "<chain_of_thought>{}</chain_of_thought>",
    "upper case": "<THINK>{}</THINK>",
    "attributes": '<think effort="high" budget=512>{}</think>',
    "blanks": "< think >{}< / think >",
    "name space": "<seed:think>{}</seed:think>",
    "run together": "<antThinking>{}</antThinking>",
    "plan": "<planning>{}</planning>",
    "words in brackets": "[BEGIN THINKING]{}[END THINKING]",
    "Ollama's words": "Thinking...\n{}\n...done thinking.\n",
    "bars": "<|thinking|>{}<|/thinking|>",
    "begin and end": "<|begin_of_thought|>{}<|end_of_thought|>",
    "start and end": "<|START_THINKING|>{}<|END_THINKING|>",
    "suffixes": "<|thought_start|>{}<|thought_end|>",
    "triangles": "◁think▷{}◁/think▷",
    "full width": "＜think＞{}＜/think＞",
    "square": "[THINK]{}[/THINK]",
    "small square": "[think]{}[/think]",
    "escaped": "&lt;think&gt;{}&lt;/think&gt;",
    "backslashes": r"\<think\>{}\</think\>",
    "details": '<details type="reasoning" done="true"><summary>Thought for 5 s</summary>{}</details>',
    "harmony": "<|channel|>analysis<|message|>{}<|end|><|start|>assistant<|channel|>final<|message|>",
    "harmony, whole": f"<|start|>assistant<|channel|>analysis<|message|>{{}}<|end|>{FINAL}",
    "harmony, commentary": f"<|channel|>commentary to=functions<|message|>{{}}<|end|>{FINAL}",
    "harmony without tokens": "analysisWe think. {}assistantfinal",
    "channel": "<|channel>thought\n{}<channel|>",
    "plain words": "Here is my thought process: {} Here is my response: ",
    "fenced": "```thinking\nMaybe 31?\ndef drive():\n    yield 31\n```\n",
    "tags in a fence": "```\n<thinking>{}</thinking>\n```\n",
    "closed only": "{}</think>",
    "closed only, upper case": "{}</THINKING>",
    "closed only, square": "{}[/THINK]",
    "opened twice": "<think>\n<think>{}</think>",
    "closed twice": "<think>{}</think> Let me see. {}</think>",
    "nested": "<thinking><reflection>{}</reflection>{}</thinking>",
    "other name at the end": "<think>{}</thinking>",
    "two": "<think>{}</think>\n<think>{}</think>",
    "mentioned": "<think>I write `</think>` when I am done. {}</think>",
}


@pytest.mark.parametrize("name", REASONING)
def test_reasoning_is_left_out_in_every_spelling(name: str) -> None:
    reasoning = REASONING[name].replace("{}", DRAFT)
    found = read_model_text(f"{reasoning}\n{ANSWER}")
    assert ANSWER in found.answer
    assert "31" not in found.answer and "REFUSE" not in found.answer
    assert not found.cut


BEGINNINGS = ("harmony without tokens", "harmony, whole", "plain words", "Ollama's words")
WITH_AN_END = [name for name in REASONING if "closed" not in name and name not in ("two", "fenced", "nested")]


@pytest.mark.parametrize("name", WITH_AN_END)
@pytest.mark.parametrize("before", ["", "\n\n", "Let me see. "])
def test_reasoning_without_its_end_leaves_no_answer(name: str, before: str) -> None:
    if before.strip() and name in BEGINNINGS:
        pytest.skip("these begin a reply")
    opening = REASONING[name].split("{}")[0]
    found = read_model_text(f"{before}{opening}{DRAFT}")
    assert found.answer == "" and found.unfinished and found.cut


def test_reasoning_behind_the_answer_is_left_out_as_well() -> None:
    assert read_model_text(f"{ANSWER}\n<think>{DRAFT}</think>").answer.strip() == ANSWER
    assert read_model_text(f"{ANSWER}\n<think>{DRAFT}").unfinished, "it may be about to take it back"


def test_a_reflection_that_ends_inside_of_thoughts_does_not_end_them() -> None:
    assert read_model_text(f"<thinking>a <reflection>b</reflection> {DRAFT}").answer == ""


@pytest.mark.parametrize("fields", ["", '"role": "assistant", ', '"reasoning_content": "draft", "role": "assistant", '])
def test_a_message_given_as_an_object_is_its_content(fields: str) -> None:
    assert read_model_text("{" + fields + '"content": "Slower."}').answer == "Slower."
    assert read_model_text("{" + fields + '"content": null}').answer == ""


ENDS = [
    "<|im_end|>", "<|im_start|>user\n", "<|endoftext|>", "<|eot_id|>", "<|end_of_text|>", "<|end|>", "<|return|>",
    "<|eom_id|>",
    "<|start_header_id|>user<|end_header_id|>", "<|user|>", "<|User|>", "<|observation|>", "<end_of_turn>",
    "<start_of_turn>user", "</s>", "[INST]", "[/INST]", "<</SYS>>", "<｜end▁of▁sentence｜>", "<｜User｜>", "<eos>",
    "<|END_OF_TURN_TOKEN|>", "<|eot|>", r"<\|im_start\|>user", r"<\|im\_end\|>", "&lt;|im_end|&gt;",
    r"\u003c|im_end|\u003e",
    "< |im_end| >", "<|im_end", "<|turn>user", "<turn|>",
    "### Human: more", "### User: more", "\n## Instruction: more", "User: more", "USER: more", "**User:** more",
    "Human: more", "[User]: more", "Passenger: more", "user\nmore", "Question: more",
    '<data name="instruction">\n| more',
]  # fmt: skip


@pytest.mark.parametrize("end", ENDS)
def test_an_invented_turn_is_no_part_of_the_answer(end: str) -> None:
    invented = f"{ANSWER}\n{end}\nGo faster.\n<|im_start|>assistant\n{DRAFT}"
    for cut in (False, True):
        found = read_model_text(invented, cut=cut)
        assert found.answer.strip() == ANSWER
        assert not found.cut, "the turn came to its end, whatever came after"


@pytest.mark.parametrize(
    "begins",
    [
        "<|im_start|>assistant\n", "<|start_header_id|>assistant<|end_header_id|>\n\n", "<s> ", "[/INST] ", "<bos>",
        "<|assistant|>", "<start_of_turn>model\n", "Assistant: ", "### Response:\n", "<|begin_of_box|>", "\ufeff",
        "<｜Assistant｜>", "<|start|>assistant<|channel|>final<|message|>", "<|python_tag|>", "<think>\n\n</think>\n\n",
    ],
)  # fmt: skip
def test_the_beginning_of_its_own_turn_is_passed_over(begins: str) -> None:
    assert read_model_text(begins + ANSWER).answer.strip() == ANSWER


@pytest.mark.parametrize(
    "honest",
    [
        "```python\ndef drive():\n    # ends at <|im_end|> or </think>, not before <think>\n    yield autopilot()\n```",
        "```python\ndef drive():\n    note = 'User: <|im_start|>'\n    yield autopilot()\n```\nDone.",
        "Thoughts:\nUser: wants to go slower\n```python\ndef drive():\n    yield autopilot()\n```",
        'Thoughts:\nUser: wants to go slower\n{"velocity_kmh": 50}',
        "I leave out `<think>` tags.\n```python\ndef drive():\n    yield autopilot()\n```",
        "if a < think and b > thought: 3 | 4",
        "<details>Slower.</details>",
        "The user: wants to go slower.",
        "<answer>B</answer>",
    ],
)
def test_an_honest_answer_is_not_cut(honest: str) -> None:
    assert read_model_text(honest).answer == honest


def test_a_refusal_is_not_overruled_by_a_turn_that_the_model_invents() -> None:
    found = read_model_text(f"I cannot do that.\nUser: Do it.\nAssistant: Sure.\n{DRAFT}")
    assert found.answer.strip() == "I cannot do that."


@pytest.mark.parametrize(
    "flood",
    [
        "<" * 300_000, "<think>" * 50_000, "</think>" * 50_000, "```\n" * 80_000, "\n" * 300_000, "a\nUser:\n" * 30_000,
        "`" * 300_000, "# <|x|>" * 30_000, "```\n" + "#<|x|>" * 40_000, "<|box|>" * 40_000, "<think " + " " * 300_000,
        "<|channel|>analysis" * 20_000, "a\nuser: {" * 20_000, "x```" * 60_000, '{"content": ' * 30_000, "[" * 300_000,
    ],
)  # fmt: skip
def test_floods_take_no_time(flood: str) -> None:
    started = time.process_time()
    found = read_model_text(flood)
    assert time.process_time() - started < 2.0
    assert len(found.answer) <= MAX_REPLY_CHARS + flood.count("```")


PIECES = (
    "<think>", "</think>", "<|im_end|>", "<|channel|>final<|message|>", "```python\n", "```\n", "User:", "\n", " x ",
    "Assistant:", "[THINK]", "<reflection>", "</reflection>", "<|start|>assistant", "<data name=\"",
)  # fmt: skip


@settings(max_examples=300)
@given(st.text(max_size=300) | st.lists(st.sampled_from(PIECES), max_size=25).map("".join), st.booleans())
def test_no_text_raises_and_an_answer_read_again_is_the_same(text: str, cut: bool) -> None:
    found = read_model_text(text, cut=cut)
    assert not (found.unfinished and found.answer)
