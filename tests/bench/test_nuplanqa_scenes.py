"""Staged scenes and the questions about them: true, visible, balanced, and worth nothing without the pictures."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chauffeur.bench.nuplanqa import NuPlanQaBenchmark
from chauffeur.bench.nuplanqa.blind import blind_guesses
from chauffeur.bench.nuplanqa.questions import SUBTASKS, VqaItem, load_questions
from chauffeur.bench.nuplanqa.scenes import making
from chauffeur.bench.nuplanqa.scenes.facts import FAMILIES, facts_of, sighted
from chauffeur.bench.nuplanqa.scenes.gate import gate
from chauffeur.bench.nuplanqa.scenes.making import QaConfig, make_set, make_split
from chauffeur.bench.nuplanqa.scenes.scene import QaScene
from chauffeur.bench.nuplanqa.scenes.staging import stage
from chauffeur.bench.nuplanqa.scenes.wording import QuestionWriter, Split, free_pairs, word_bank
from chauffeur.concept import ConfigError
from chauffeur.geometry.box import overlap


def scenes(count: int, seed: int) -> list[QaScene]:
    return [stage(f"{seed:08x}{number:08x}", np.random.default_rng([seed, number])) for number in range(count)]


def written(staged: list[QaScene], split: Split) -> list[VqaItem]:
    writer = QuestionWriter(split)
    found: list[VqaItem] = []
    for number, scene in enumerate(staged):
        items = writer.write(scene, facts_of(scene, sighted(scene)), "", np.random.default_rng(number))
        found += [replace(item, id=f"{scene.token}.{place}", chain=scene.token) for place, item in enumerate(items)]
    return found


@pytest.fixture(scope="module")
def staged() -> list[QaScene]:
    return scenes(260, 7)


def test_nobody_overlaps_and_motion_is_continuous(staged: list[QaScene]) -> None:
    assert scenes(20, 7)[13].instants == staged[13].instants
    for scene in staged[:120]:
        for instant in scene.instants:
            boxes = [instant.ego.box, *(one.box for one in instant.others)]
            assert not any(overlap(a, b) for i, a in enumerate(boxes) for b in boxes[i + 1 :])
        for before, now in zip(scene.instants, scene.instants[1:], strict=False):
            moved = math.hypot(now.ego.x_m - before.ego.x_m, now.ego.y_m - before.ego.y_m)
            assert moved == pytest.approx(0.25 * (now.ego.speed_mps + before.ego.speed_mps), abs=0.05)


def test_classes_are_known_and_agree_with_the_observation(staged: list[QaScene]) -> None:
    for scene in staged:
        found = {fact.family: fact.value for fact in facts_of(scene, sighted(scene)) if not fact.side}
        assert all(value in word_bank().families[family].classes for family, value in found.items())
        lamps = {signal.id: signal.state for signal in scene.now.signals}
        assert found.get("light", lamps.get("own", "none")) == lamps.get("own", "none")
        if "gap" in found and scene.lead is not None:
            before, now = (
                math.dist((one.x_m, one.y_m), (at.ego.x_m, at.ego.y_m))
                for at in (scene.instants[0], scene.now)
                for one in at.others
                if one.id == scene.lead.id
            )
            change = now - before
            assert found["gap"] == ("closes" if change < -1.0 else "opens" if change > 1.0 else "same")


def test_nothing_is_asked_about_what_nobody_can_see(staged: list[QaScene]) -> None:
    scene = next(one for one in staged if one.lead is not None and one.light is not None)
    blind = {fact.family for fact in facts_of(scene, frozenset())}
    assert blind.isdisjoint({"ahead", "gap", "light", "key", "manoeuvre", "situation", "action"})


def test_the_gate_holds_where_words_signals_and_lengths_tell_nothing(staged: list[QaScene]) -> None:
    train, test = written(staged, "train"), written(scenes(200, 8), "test")
    assert {item.subtask for item in test} == set(SUBTASKS)
    lines = gate(test, train)
    assert len(lines) == 7 and lines[0].questions >= 100
    assert all(line.passes() for line in lines), [f"{line.trick}: {line.accuracy:.3f}" for line in lines]
    assert max(Counter(item.answer for item in train).values()) < 0.32 * len(train)


def test_the_baseline_finds_what_a_careless_set_gives_away(staged: list[QaScene]) -> None:
    careless: list[VqaItem] = []
    for item in written(staged, "train")[:300]:
        told = (f"{text} indeed" if place == item.answer else text for place, text in enumerate(item.options))
        careless.append(replace(item, options=tuple(told)))
    guesses = blind_guesses(careless)
    assert guesses is not None
    right = sum(guess == item.answer for guess, item in zip(guesses, careless, strict=True))
    assert right > 0.85 * len(careless)
    assert not all(line.passes() for line in gate(careless))


def test_wordings_of_the_test_split_are_heard_nowhere_else(staged: list[QaScene]) -> None:
    train, test = written(staged, "train"), written(staged, "test")
    said = {text for item in train for text in (item.question, *item.options)}
    assert said.isdisjoint({text for item in test for text in (item.question, *item.options)})


def test_free_pairs_are_answers_of_the_bank(staged: list[QaScene]) -> None:
    scene = staged[0]
    facts = list(facts_of(scene, sighted(scene)))
    pairs = list(free_pairs(scene, facts, 20, np.random.default_rng(0)))
    assert len(pairs) == 20 * len(facts) and len(set(pairs)) > 3 * len(facts)
    assert {subtask for subtask, _, _ in pairs} == {FAMILIES[fact.family] for fact in facts}


def test_a_set_is_the_same_at_once_again_and_in_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config, once, parts = QaConfig(scenes=12, pictures=False, pairs=1), tmp_path / "once", tmp_path / "parts"
    told: list[tuple[int, int]] = []
    made = make_set(once, config, 1, lambda *at: told.append(at))
    assert told[-1] == (16, 16) and made.questions["train"] > 20
    assert "imulated" in (once / "CARD.md").read_text()
    assert all(item.split == "test" for item in load_questions(once / "test" / "questions.json").items)
    assert json.loads((once / "train" / "pairs.json").read_text())[0]["QA"][0]["a"]
    written = {path: path.read_bytes() for path in once.rglob("*.json")}
    staged: list[int] = []
    stage_one = making._stage
    monkeypatch.setattr(making, "_stage", lambda *given: staged.append(given[2]) or stage_one(*given))
    make_set(once, config, 1, lambda *at: None)
    assert not staged and all(path.read_bytes() == held for path, held in written.items())
    with pytest.raises(ConfigError, match="another configuration"):
        make_set(once, replace(config, seed=1), 1, lambda *at: None)

    def interrupt(at: int, stop: int) -> None:
        if at == stop:
            raise KeyboardInterrupt

    for stop in (4, 13):  # in the training split, then in the next one
        with pytest.raises(KeyboardInterrupt):
            make_set(parts, config, 1, lambda at, _, stop=stop: interrupt(at, stop))
    make_set(parts, config, 1, lambda *at: None)
    assert len(staged) == 16, "none is staged twice"
    assert all((parts / path.relative_to(once)).read_bytes() == held for path, held in written.items())


def test_pictures_are_rendered_where_the_metadata_say(tmp_path: Path) -> None:
    pytest.importorskip("moderngl")
    config = QaConfig(scenes=5, width=112, height=64, frames=2)
    items = make_split(tmp_path, "val", config, lambda *at: None)
    bench = NuPlanQaBenchmark(str(tmp_path / "val"))
    assert items and not bench.frames.missing([item.token for item in items])
    paths = bench.frames.paths(items[0].token)
    assert [frame.ago_s for frame in paths] == [2.0] * 6 + [0.0] * 6
    assert bench.frames.scene_type(items[0].token).startswith("simulated ")
