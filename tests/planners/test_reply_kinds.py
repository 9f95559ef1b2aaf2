"""Replies of kinds that models write in the field, for every reader: which program, parameters or gains they mean."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from chauffeur.concept import ActionMatrix
from chauffeur.planners.llm_reply import read_reply
from chauffeur.planners.motion import read_matrix
from chauffeur.planners.talk2drive.answer import read_answer
from chauffeur.programs import check_source


def program(speed: str = "22", name: str = "drive") -> str:
    return f"def {name}():\n    set_target_speed({speed})\n    for _ in range(50):\n        yield autopilot()\n"


def block(source: str, label: str = "python") -> str:
    return f"```{label}\n{source}```"


GOOD, DRAFT = block(program()), block(program("31"))


# Recorded replies -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        "reply-helper-in-own-block",
        "reply-reasoning-refuse-inside",
        "reply-refuse-none",
        "reply-run-on-turns",
        "reply-two-blocks-usage",
    ],
)
def test_recorded_replies_give_their_program(case_folder: Callable[[str], Path], case: str) -> None:
    reply = read_reply((case_folder(case) / "reply.txt").read_text(encoding="utf-8"))
    assert reply.source is not None and (reply.refusal, reply.problem) == ("", "")
    assert "set_target_speed(22)" in reply.source or "slow(24)" in reply.source
    assert check_source(reply.source).passed


@pytest.mark.parametrize("file", ["parameters.txt", "null.txt"])
def test_recorded_parameters_without_a_refusal_are_parameters(case_folder: Callable[[str], Path], file: str) -> None:
    answer = read_answer((case_folder("reply-refuse-none") / file).read_text(encoding="utf-8"))
    assert answer.parameters is not None and answer.refusal == ""


# Programs -------------------------------------------------------------------------------------------------------------

HELPER = "def slow(v):\n    return v - 2\n"
STEPS = "def ease(v):\n    set_target_speed(v)\n    yield autopilot()\n"
USES = "def drive():\n    set_target_speed(slow(24))\n    yield autopilot()\n"
EASES = "def drive():\n    yield from ease(22)\n"

MEANT = {
    "a draft in thoughts of any spelling": f"<scratchpad>{DRAFT}</scratchpad>\n{GOOD}",
    "a draft in closed thoughts": f"{DRAFT}</think>\n{GOOD}",
    "a draft in an analysis channel": (
        f"<|channel|>analysis<|message|>{DRAFT}<|end|><|start|>assistant<|channel|>final<|message|>{GOOD}"
    ),
    "thoughts behind the answer": f"{GOOD}\n<think>{DRAFT}</think>",
    "a turn made up": f"{GOOD}\n<|im_end|>\n<|im_start|>user\nfaster\n<|im_start|>assistant\n{DRAFT}",
    "a turn made up, escaped": f"{GOOD}\n<\\|im_end\\|>\n{DRAFT}",
    "a turn made up in plain words": f"{GOOD}\n\nUser: faster\n\nAssistant: Sure.\n{DRAFT}",
    "an instruction made up": f"{GOOD}\n\n### Instruction:\nfaster\n\n### Response:\n{DRAFT}",
    "a prompt made up": f'{GOOD}\n\n<data name="instruction">\n| faster\n</data>\n{DRAFT}',
    "a block that a token ends": f"```python\n{program()}<|im_end|>\n<|im_start|>user",
    "usage behind": f"{GOOD}\nRun it:\n{block('for step in drive():' + chr(10) + '    print(step)' + chr(10))}",
    "usage in front": f"{block('drive()' + chr(10))}\nwhere\n{GOOD}",
    "usage in the shell": f"{GOOD}\n{block('python drive.py' + chr(10), 'bash')}",
    "numbers beside": f"{block(chr(123) + chr(34) + 'speed' + chr(34) + ': 31' + chr(125) + chr(10), 'json')}\n{GOOD}",
    "output behind": f"{GOOD}\nOutput:\n{block('22 m/s' + chr(10), '')}",
    "the same twice": f"{GOOD}\nOnce more in full:\n{block(program().replace('50):', '50):  # five seconds'))}",
    "the same in other words": f"{GOOD}\n{block(program().replace('(22)', '( 22 )'), 'py')}",
    "pseudo code in front": f"{block('def drive: speed = 31, follow the road' + chr(10), 'text')}\n{GOOD}",
    "a block without a label": block(program(), ""),
    "a capital label": block(program(), "Python"),
    "marks behind the code": f"```python\n{program().rstrip()}```",
    "marks behind the prose": f"Here it is: ```python\n{program()}```",
    "code behind the marks": f"```python {program()}```",
    "no marks at all": f"I slow down.\n\n{program()}\nThat is all.",
    "quotes around marks": f"I use ```python blocks```.\n{GOOD}",
    "numbers in full width": block(program("２２")),
    "a blank that does not break": block(program().replace("    ", "\u00a0\u00a0\u00a0\u00a0")),
    "a zero-width space": block(program().replace("22", "22\u200b")),
    "no refusal": f"REFUSE: N/A\n{GOOD}",
    "no refusal, behind": f"{GOOD}\nREFUSE: none",
    "no refusal, in brackets": f"Thoughts: slower.\nREFUSE: (not applicable)\n{GOOD}",
    "no refusal, left empty": f"Thoughts: slower.\nREFUSE:\n\n{GOOD}",
    "no refusal, the form repeated": f"REFUSE: <the reason in one sentence, addressed to the passenger>\n{GOOD}",
    "no refusal, in a sentence": f"REFUSE: None. The wish is safe.\n{GOOD}",
    "a message as an object": json.dumps({"role": "assistant", "reasoning_content": DRAFT, "content": GOOD}),
    "an honest remark": f"Thoughts:\nUser: wants to slow down.\n{GOOD}",
}


@pytest.mark.parametrize("name", MEANT)
def test_the_program_that_is_meant_is_taken(name: str) -> None:
    reply = read_reply(MEANT[name])
    assert (reply.refusal, reply.problem) == ("", "")
    assert reply.source is not None and "31" not in reply.source
    assert check_source(reply.source).passed, reply.source
    assert "set_target_speed" in reply.source.replace(" ", "")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (f"{block(HELPER)}\n{block(USES)}", 2),
        (f"{block(USES)}\nwith\n{block(HELPER)}", 2),
        (f"{block(STEPS)}\n{block(EASES)}", 2),
        (f"{block(HELPER)}\n{block(STEPS)}\n{block(EASES.replace('22', 'slow(24)'))}", 3),
        (f"{block(HELPER)}\nNot needed:\n{block(program())}", 1),
    ],
)
def test_a_helper_in_its_own_block_is_joined_where_it_is_used(text: str, parts: int) -> None:
    reply = read_reply(text)
    assert reply.source is not None and reply.source.count("def ") == parts
    assert check_source(reply.source).passed, reply.source


@pytest.mark.parametrize(
    "text",
    [
        f"{GOOD}\nOr faster:\n{DRAFT}",
        f"First try:\n{DRAFT}\nBetter:\n{GOOD}",
        f"{GOOD}\n{block(program('31', 'drive_fast'))}",
        f"{program()}\nor\n\n{program('31')}",
        f"{block(program(), '')}\n{block(program('31'), '')}",
    ],
)
def test_two_different_programs_are_none_and_the_last_is_no_better(text: str) -> None:
    reply = read_reply(text)
    assert reply.source is None and "different programs" in reply.problem


@pytest.mark.parametrize(
    "text",
    [
        f"<thinking>{DRAFT}",
        f"<thinking>{DRAFT}\n{DRAFT[:60]}",
        f"◁think▷{DRAFT}",
        f"<|channel|>analysis<|message|>{DRAFT}",
        f"analysisWe need speed. {DRAFT}",
        f"[THINK]{DRAFT}",
        f"```thinking\n{program('31')}",
        f"Well. <reasoning>{DRAFT}",
        f"{DRAFT}\n<think>No, that is too",
        f"<think>a</think><thinking>{DRAFT}",
        f"<thinking><reflection>hm</reflection>{DRAFT}",
    ],
)
@pytest.mark.parametrize("cut", [True, False])
def test_a_draft_in_unfinished_thoughts_drives_nothing(text: str, cut: bool) -> None:
    reply = read_reply(text, cut=cut)
    assert reply.source is None and "thoughts did not come to an end" in reply.problem
    assert read_matrix(text.replace(DRAFT, "P = [[1, 0, 0], [5, 10, 300]]"), whole=not cut)[0] is None
    assert read_answer(text.replace(DRAFT, json.dumps(SAID)), whole=not cut).parameters is None


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        (f"{GOOD}\nThis slows the c", True),
        (f"{GOOD}\n<|im_end|>\n<|im_start|>user\nand then", True),
        (f"{GOOD}\nOr else:\n```python\ndef drive():\n    set_t", False),
        (f"```python\n{program()}", False),
        (program(), False),
        ("Thoughts: I", False),
        ("REFUSE: There is no lane on the le", None),
    ],
)
def test_a_reply_that_was_cut_counts_where_all_of_its_blocks_are_closed(text: str, whole: bool | None) -> None:
    reply = read_reply(text, cut=True)
    if whole is None:
        assert reply.refusal
    else:
        assert (reply.source is not None) == whole
        assert whole or "cut off" in reply.problem


@pytest.mark.parametrize(
    "reason",
    ["No lane is free.", "None of the lanes is free.", "Not here.", "No, that is unlawful.", "Nothing can pass."],
)
@pytest.mark.parametrize("beside", ["", f"\n{GOOD}"])
def test_a_refusal_with_a_reason_is_one_whatever_stands_beside_it(reason: str, beside: str) -> None:
    assert read_reply(f"REFUSE: {reason}{beside}").refusal == reason


def test_nothing_refused_and_nothing_written_is_neither() -> None:
    reply = read_reply("REFUSE: N/A")
    assert reply.refusal == "" and "no program" in reply.problem


# Parameters -----------------------------------------------------------------------------------------------------------

SAID = {"thoughts": "Slower.", "velocity_kmh": 36, "lookahead_distance_m": 12, "lookahead_ratio_s": 2.0, "lane": "keep"}
WRITTEN = json.dumps(SAID)
FASTER = json.dumps(SAID | {"velocity_kmh": 110})


@pytest.mark.parametrize(
    "text",
    [
        WRITTEN,
        f"<thinking>{FASTER}</thinking>{WRITTEN}",
        f"{FASTER}</think>{WRITTEN}",
        f"{WRITTEN}\n<|eot_id|><|start_header_id|>user<|end_header_id|>faster{FASTER}",
        f"{WRITTEN}\nUser: faster\nAssistant: {FASTER}",
        f"```json\n{WRITTEN}\n```",
        str(SAID | {"refusal": None}),
        WRITTEN.replace("}", ",}"),
        json.dumps(SAID | {"refusal": "N/A"}),
        json.dumps(SAID | {"refusal": "none"}),
        json.dumps(SAID | {"refusal": None, "thoughts": None}),
        json.dumps(SAID | {"refusal": "-", "lane": None}),
        json.dumps(SAID | {"refusal": False}),
        WRITTEN.replace("36", "３６"),
        WRITTEN.replace('"', "＂").replace("{", "｛").replace("}", "｝"),
        WRITTEN.replace('"', "“"),
        f'The format is {{"a": 1}}. {WRITTEN}',
        f"{WRITTEN} (in short: {WRITTEN})",
    ],
)
def test_the_parameters_that_are_meant_are_taken(text: str) -> None:
    answer = read_answer(text)
    assert answer.parameters is not None, answer
    assert answer.parameters.target_speed_mps == 10.0


@pytest.mark.parametrize("text", [f"{WRITTEN} or {FASTER}", f"First {FASTER}, better {WRITTEN}", WRITTEN[:-1]])
def test_parameters_that_are_not_one_are_none(text: str) -> None:
    assert read_answer(text).parameters is None
    assert read_answer(text, whole=False).problem


def test_a_refusal_beside_parameters_counts() -> None:
    assert read_answer(json.dumps(SAID | {"refusal": "No lane is free."})).refusal == "No lane is free."


# Gains ----------------------------------------------------------------------------------------------------------------

GAINS = ActionMatrix((0.2, 0.01, 0.1), (5.0, 10.0, 300.0))
MATRIX = "[[0.2, 0.01, 0.1], [5, 10, 300]]"
HARD = "[[0.9, 0.05, 0.02], [20, 45, 90]]"


@pytest.mark.parametrize(
    "text",
    [
        f"P = {MATRIX}",
        MATRIX,
        f"**P** = `{MATRIX}`",
        f"P: {MATRIX}",
        f"Moderate would be {HARD}.\nP = {MATRIX}",
        f"P = {MATRIX}\nCompare {HARD}, which is sporty.",
        f"<think>P = {HARD}</think>P = {MATRIX}",
        f"P = {HARD}</think>\nP = {MATRIX}",
        f"P = {MATRIX}\n<|im_end|>\n<|im_start|>user\nfaster\n<|im_start|>assistant\nP = {HARD}",
        f"P = {MATRIX}\nP = {MATRIX}",
        f"REFUSE: N/A\nP = {MATRIX}",
        "P = [[０．２, 0.01, 0.1], [5, 10, 300]]",
        "P ＝ ［［0.2，0.01，0.1］，［5，10，300］］",
        "P = [[0,2; 0,01; 0,1], [5; 10; 300]]",
        "P = [[2e-1, 1×10⁻², .1], [5., 10, 3e2]]",
        "P = [[0.2, 0.01, 0.1],\n     [5, 10, 300]]",
        "P = [[0.2 0.01 0.1]; [5 10 300]]",
        f"```python\nP = {MATRIX}\n```",
    ],
)
def test_the_gains_that_are_meant_are_taken(text: str) -> None:
    policy, reply = read_matrix(text)
    assert policy == GAINS, reply


@pytest.mark.parametrize(
    "text",
    [
        f"P = {MATRIX}\nor P = {HARD}",
        f"{MATRIX} or {HARD}",
        "P = [[0.2, 0.01], [5, 10, 300]]",
        "P = [[0.2, 0.01, x], [1, 2, 3]]",
    ],
)
def test_gains_that_are_not_one_matrix_are_none(text: str) -> None:
    policy, reply = read_matrix(text)
    assert policy is None and "action matri" in reply.problem


def test_gains_of_a_reply_that_was_cut_count_where_they_are_named() -> None:
    assert read_matrix(f"I begin with {MATRIX} and", whole=False)[0] is None
    assert read_matrix(f"P = {MATRIX}\nThat is", whole=False)[0] == GAINS


def test_a_sign_of_gains_is_never_lost() -> None:
    for minus in "-\u2212\u2013\uff0d":
        policy, _ = read_matrix(f"P = [[{minus}0.2, 0.01, 0.1], [5, 10, 300]]")
        assert policy is not None and policy.pid[0] == -0.2
