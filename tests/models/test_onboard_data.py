"""Data of the on-board model: every program was driven and did it, words and replies agree, splits are apart."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chauffeur.concept import DataError
from chauffeur.models.onboard import examples
from chauffeur.models.onboard.cases import Case, case_of, make_case
from chauffeur.models.onboard.engine import distinct, gathered, make_cases, masked, worded
from chauffeur.models.onboard.examples import questions, reasons
from chauffeur.models.onboard.pipeline import PipelinePlan, build_data
from chauffeur.planners.onboard.dialect import SKILLS
from chauffeur.planners.onboard.prompt import ASK, REFUSE, REPLY, WISH
from chauffeur.planners.onboard.reply import read_reply


@pytest.fixture(scope="module")
def cases() -> list[Case]:
    rows = [make_case((7, index)) for index in range(70)]
    return [case_of(row | {"index": place}) for place, row in enumerate(rows) if "left_out" not in row]


def test_a_draw_gives_the_same_case_again() -> None:
    assert make_case((7, 3)) == make_case((7, 3))


def test_draws_become_cases_of_many_kinds(cases: list[Case]) -> None:
    assert len(cases) > 30
    driven = {step.skill for case in cases if not case.refusal for step in case.steps}
    assert len(driven) > 12
    assert driven <= SKILLS.keys()


def test_replies_say_what_the_case_is_and_prompts_hold_the_words(cases: list[Case]) -> None:
    splits = gathered([worded(cases, 0, per_case=6)])
    by_index = {case.index: case for case in cases}
    for example in splits.train + splits.seen + splits.unseen:
        assert example.prompt.split(WISH)[1].removesuffix(REPLY).strip()
        reply = read_reply(example.reply)
        if example.kind == "wish" and not by_index[example.case].refusal:
            assert reply.steps == by_index[example.case].steps
        elif example.kind == "ask":
            assert example.reply.removeprefix(ASK) in questions()
        elif example.kind == "refuse":
            assert example.reply.removeprefix(REFUSE) in reasons()


def test_tests_share_neither_scenes_nor_held_out_words_with_training(cases: list[Case]) -> None:
    splits = gathered([worded(cases, 0, per_case=6)])
    assert not {e.case for e in splits.train if e.case >= 0} & {e.case for e in splits.unseen if e.case >= 0}
    assert not any(example.held for example in splits.train)
    known = {masked(example.wish) for example in splits.train}
    assert not any(masked(example.wish) in known for example in splits.unseen)


def test_only_training_is_said_with_other_words_reasons_and_talk(
    cases: list[Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    def wishes(shares: float) -> tuple[list[str], list[str]]:
        for name in ("REWORDED_SHARE", "CHATTER_SHARE", "REASON_SHARE"):
            monkeypatch.setattr(examples, name, shares)
        splits = worded(cases[:30], 0, per_case=4)
        return [e.wish for e in splits.train], [e.wish for e in splits.seen + splits.unseen]

    plain, tests = wishes(0.0)
    wide, same_tests = wishes(1.0)
    assert same_tests == tests
    assert sum(map(len, wide)) > 1.5 * sum(map(len, plain))


def test_near_duplicates_are_left_out(cases: list[Case]) -> None:
    some = worded(cases[:3], 0, per_case=3).train
    assert len(distinct(some + some)) == len(distinct(some))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("Please slow down to 45 mph.", "could you slow down to 60 mph?"),
        ("keep thirty-five meters", "Keep 20 meters, please!"),
    ],
)
def test_masked_wishes_forget_numbers_and_politeness(one: str, other: str) -> None:
    assert masked(one) == masked(other)


def test_masked_wishes_keep_sides_and_directions() -> None:
    assert len({masked(text) for text in ("left lane", "right lane", "go faster", "go slower")}) == 4


def test_a_stopped_run_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "cases.jsonl"
    whole = make_cases(5, 24, path, 1, lambda done, kept: None)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:9]) + "\n" + lines[9][:20])
    assert make_cases(5, 24, path, 1, lambda done, kept: None) == whole


def test_the_data_set_is_built_packed_and_described(tmp_path: Path) -> None:
    pytest.importorskip("tokenizers", reason="tokenizers is not installed (extra: models)")
    from chauffeur.models.onboard.packed import Packed
    from chauffeur.models.onboard.tokens import load_tokenizer

    build_data(tmp_path, PipelinePlan(seed=3, draws=110, per_case=3), 1, lambda stage, done, of: None)
    data = tmp_path / "data"
    facts: dict[str, Any] = json.loads((data / "data.json").read_text())
    packed = Packed.load(data / "train.npz")
    assert len(packed) == facts["examples"]["train"] > 50
    tokenizer = load_tokenizer(data)
    first = json.loads((data / "train.jsonl").read_text().split("\n")[0])
    tokens = packed.tokens[packed.starts[0] : packed.starts[1]]
    text = tokenizer.decode(tokens.tolist(), skip_special_tokens=False)
    assert text == f"{first['prompt']}{first['reply']}<|end|>"
    assert np.all(packed.replies < np.diff(packed.starts))
    card = (data / "DATA_CARD.md").read_text()
    assert f"{facts['examples']['train']:,} examples" in card


def test_data_for_a_finished_network_are_read_with_its_tokenizer(tmp_path: Path) -> None:
    pytest.importorskip("tokenizers", reason="tokenizers is not installed (extra: models)")
    first, second = tmp_path / "first", tmp_path / "second"
    build_data(first, PipelinePlan(seed=3, draws=100, per_case=2), 1, lambda stage, done, of: None)
    second.mkdir()
    (second / "cases.jsonl").write_bytes((first / "cases.jsonl").read_bytes())
    build_data(second, PipelinePlan(seed=3, draws=100, per_case=3, base=first), 1, lambda stage, done, of: None)
    known, kept = ((folder / "data" / "tokenizer.json").read_bytes() for folder in (first, second))
    assert kept == known
    plan = json.loads((second / "data" / "data.json").read_text())["plan"]
    assert plan["tokenizer"] == hashlib.sha256(known).hexdigest()
    with pytest.raises(DataError, match="cannot be read"):
        build_data(
            tmp_path / "third", PipelinePlan(draws=100, base=tmp_path / "nothing"), 1, lambda stage, done, of: None
        )
