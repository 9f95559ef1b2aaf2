"""The recipe of short drives: splits that are apart, streets that fit, and a start from another run's reading."""

# ruff: noqa: E402
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")

from chauffeur.concept import ConfigError
from chauffeur.models.vilad.driving_recipe import DRIVING, drive_cases
from chauffeur.models.vilad.driving_words import BANK, drive_command
from chauffeur.models.vilad.parking_recipe import PARKING
from chauffeur.models.vilad.phrases import TESTS, held_back
from chauffeur.models.vilad.recipe import ViladRecipe, batches, loss_of, network, train
from chauffeur.planners.vilad.driving import NOTHING, TEMPLATE, DriveGoal, goal, reference
from chauffeur.planners.vilad.engine import SHIPPED
from chauffeur.planners.word_table import load_words

WORDS = load_words(SHIPPED / "words.npz")
SMALL = ViladRecipe(size="tiny", steps=3, batch=4, warmup=2)


@pytest.mark.parametrize("split", TESTS)
def test_the_splits_are_what_they_say(split: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        said = drive_command(rng, split)  # type: ignore[arg-type]
        assert bool(BANK.unheard(said.text)) == (split == "vocabulary"), said.text
        if split in ("seen", "composition"):
            assert held_back(said.asked, NOTHING) == (split == "composition")
    rng = np.random.default_rng(4)
    assert not any(held_back(DRIVING.command(rng).asked, NOTHING) for _ in range(200))


def test_writers_are_held_apart() -> None:
    held = {one.text.lower() for one in BANK.lines if one.writer in "xyz"}
    own = {one.text.lower() for one in BANK.lines if one.writer not in "xyz"}
    assert not held & own
    assert "kerb" in BANK.trained_words
    assert "chop" not in BANK.trained_words


def test_most_commands_can_be_done_where_they_are_said_and_the_exact_answer_is_judged_right() -> None:
    found = drive_cases("seen", 60, 1)
    assert [one.text for one in drive_cases("seen", 5, 1)] == [one.text for one in found[:5]]
    possible = [one for one in found if isinstance(goal(one.street, one.asked), DriveGoal)]
    assert 0.75 < len(possible) / len(found) < 1.0
    for one in found:
        judged = one.judged(reference(one.street, one.asked))
        assert judged == (True, True, True, True)
        assert one.solved(one.asked)


def test_a_batch_can_be_learned_from() -> None:
    torch.manual_seed(0)
    model = network(DRIVING, SMALL)
    batch = next(batches(DRIVING, SMALL, WORDS)(0))
    assert batch.rows.shape == (4, TEMPLATE.length)
    assert batch.scene.shape[2] == DRIVING.width
    again = next(batches(DRIVING, SMALL, WORDS)(0))
    assert torch.equal(batch.rows, again.rows)
    loss = loss_of(model, SMALL, batch)
    loss.backward()
    assert bool(torch.isfinite(loss))


def test_training_begins_with_the_reading_of_another_run(tmp_path: Path) -> None:
    base = train(tmp_path / "base", PARKING, replace(SMALL, steps=2), WORDS)
    begun = replace(SMALL, steps=1, rate=0.0, base="test")
    model = train(tmp_path / "own", DRIVING, begun, WORDS, base=tmp_path / "base")
    for one, two in zip(base.words.parameters(), model.words.parameters(), strict=True):
        assert torch.allclose(one, two, atol=1e-6)
    assert model.tokens.weight.shape != base.tokens.weight.shape
    with pytest.raises(ConfigError, match="another size"):
        train(tmp_path / "larger", DRIVING, replace(begun, size="lot"), WORDS, base=tmp_path / "base")
    with pytest.raises(ConfigError, match="no run"):
        train(tmp_path / "none", DRIVING, begun, WORDS, base=tmp_path / "nowhere")
