"""The parking recipe: words and scenes, splits that are apart, training that resumes bit for bit, what ships."""

# ruff: noqa: E402
from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")

from chauffeur.concept import ConfigError
from chauffeur.models.train.trainer import Optimisation, bfloat16_pays, fit, stored
from chauffeur.models.vilad.losses import Noise, diffusion_loss, masked
from chauffeur.models.vilad.parking_recipe import PARKING, cases
from chauffeur.models.vilad.parking_scenes import scene
from chauffeur.models.vilad.parking_words import BANK, wish
from chauffeur.models.vilad.phrases import TESTS, held_back
from chauffeur.models.vilad.recipe import ViladRecipe, batches, loss_of, network, packed_words, train
from chauffeur.planners.vilad.engine import SHIPPED, ViladEngine
from chauffeur.planners.vilad.parking import NOTHING, TEMPLATE, best
from chauffeur.planners.vilad.unmasking import Unmasking
from chauffeur.planners.word_table import load_words

WORDS = load_words(SHIPPED / "words.npz")
SMALL = ViladRecipe(size="tiny", steps=6, batch=4, warmup=2)


def test_the_splits_are_what_they_say() -> None:
    phrases = {one.text.lower(): one.writer for one in BANK.lines}
    assert len(phrases) > 500
    for split in TESTS:
        rng = np.random.default_rng(3)
        for _ in range(150):
            said = wish(rng, split)
            parts = [name for name, value in said.asked.items() if value != NOTHING[name]]
            assert set(said.asked) == set(NOTHING)
            if split in ("seen", "composition"):
                assert held_back(said.asked, NOTHING) == (split == "composition")
                assert not BANK.unheard(said.text), said.text
            if split == "composition":
                assert len(parts) >= 2
            if split == "phrasing":
                assert not BANK.unheard(said.text), said.text
            if split == "vocabulary":
                assert BANK.unheard(said.text), said.text
    rng = np.random.default_rng(4)
    assert not any(held_back(wish(rng, "train").asked, NOTHING) for _ in range(300))
    held = {one.text.lower() for one in BANK.lines if one.writer in "xyz" and one.kind in "ps"}
    own = {one.text.lower() for one in BANK.lines if one.writer not in "xyz"}
    assert not held & own
    assert "wallbox" not in BANK.trained_words


def test_scenes_are_fresh_and_their_neighbours_are_counted() -> None:
    rng = np.random.default_rng(0)
    ones, twos = scene(rng, 8), scene(rng, 8)
    assert len(ones) == len(twos) == 8
    assert not np.array_equal(ones.x_m, twos.x_m)
    assert set(np.unique(np.concatenate([scene(rng, 12).neighbours for _ in range(20)]))) == {0, 1, 2}
    again = scene(np.random.default_rng(0), 8)
    assert np.array_equal(again.features(), ones.features())
    found = cases("phrasing", 20, 1)
    assert all(best(one.spots, one.asked)[0] == one.candidate for one in found)
    assert [one.text for one in cases("phrasing", 20, 1)] == [one.text for one in found]


def test_only_actions_are_masked_unless_the_pattern_is_free() -> None:
    rows = torch.from_numpy(np.repeat(TEMPLATE.encode(NOTHING | {"row": "B", "spot": 1})[None], 400, axis=0))
    maskable = torch.from_numpy(TEMPLATE.maskable)
    generator = torch.Generator().manual_seed(1)
    noisy, hidden, t = masked(rows, maskable, Noise(), generator)
    assert not hidden[:, ~maskable].any()
    assert torch.equal(noisy[~hidden], rows[~hidden])
    assert not noisy[hidden].any()
    assert float(t.min()) > 0.0
    share = hidden[:, maskable].float().mean(dim=1)
    assert float((share - t).mean().abs()) < 0.02  # each action is masked with probability t (Eq. 29)
    _, hidden, t = masked(rows, maskable, Noise(full=1.0), generator)
    assert bool((t == 1.0).all())
    assert bool(hidden[:, maskable].all())
    _, hidden, _ = masked(rows, maskable, Noise(fixed_pattern=False), generator)
    assert hidden[:, ~maskable].any()
    # Eq. 30 by hand: two masked tokens of probability 1/2 at t = 1/2 of a row with four actions.
    logits = torch.zeros((1, 4, 2))
    which = torch.tensor([[True, False, True, False]])
    rows, anything = torch.zeros((1, 4), dtype=torch.long), torch.ones((4, 2), dtype=torch.bool)
    found = diffusion_loss(logits, rows, which, torch.tensor([0.5]), anything, 4)
    assert float(found) == pytest.approx(2 * 0.693147 / 0.5 / 4, rel=1e-4)


@pytest.mark.parametrize("mode", ["fixed", "plain", "twin"])
def test_every_mode_has_a_loss_to_learn_from(mode: Any) -> None:
    recipe = replace(SMALL, mode=mode)
    torch.manual_seed(0)
    model = network(PARKING, recipe)
    batch = next(batches(PARKING, recipe, WORDS)(0))
    loss = loss_of(model, recipe, batch)
    loss.backward()
    assert torch.isfinite(loss)
    learned = [p for name, p in model.named_parameters() if "embed_tokens" not in name]
    assert all(p.grad is not None and bool(torch.isfinite(p.grad).all()) for p in learned)


def test_a_stopped_run_goes_on_bit_for_bit(tmp_path: Path) -> None:
    whole = train(tmp_path / "whole", PARKING, SMALL, WORDS)

    class Stopped(Exception):
        pass

    def stop(step: int, loss: float, seconds: float) -> None:
        del loss, seconds
        if step == 3:
            raise Stopped

    with pytest.raises(Stopped):
        _train_saving(tmp_path / "parts", stop)
    kept = stored(tmp_path / "parts")
    assert kept is not None
    assert kept["step"] == 3
    parts = train(tmp_path / "parts", PARKING, SMALL, WORDS)
    for one, two in zip(whole.parameters(), parts.parameters(), strict=True):
        assert torch.equal(one, two)
    rows = [json.loads(line) for line in (tmp_path / "whole" / "log.jsonl").read_text().splitlines()]
    assert rows[-1]["step"] == SMALL.steps
    with pytest.raises(ConfigError, match="another recipe"):
        train(tmp_path / "whole", PARKING, replace(SMALL, seed=1), WORDS)


def _train_saving(folder: Path, watch: Any) -> None:
    """As `train`, with its state saved after every step."""
    from dataclasses import asdict

    torch.manual_seed(SMALL.seed)
    model = network(PARKING, SMALL)
    fit(
        model,
        batches(PARKING, SMALL, WORDS),
        lambda batch: loss_of(model, SMALL, batch),
        SMALL.rate_at,
        folder,
        asdict(SMALL),
        SMALL.steps,
        Optimisation(ema=0.998, precision="float32"),
        watch=watch,
        save_s=-1.0,
    )


def test_the_trainer_learns_and_a_probe_chooses_the_precision(tmp_path: Path) -> None:
    torch.manual_seed(0)
    model = torch.nn.Linear(3, 1)
    x = torch.randn(64, 3)
    y = x @ torch.tensor([[1.0], [-2.0], [0.5]])
    seen: list[float] = []
    fit(
        model,
        lambda first: itertools.repeat((x, y)),
        lambda batch: ((model(batch[0]) - batch[1]) ** 2).mean(),
        lambda step: 0.05,
        tmp_path,
        {"task": "line"},
        120,
        Optimisation(decay=0.0, precision="float32"),
        watch=lambda step, loss, seconds: seen.append(loss),
    )
    assert seen[-1] < 0.01 * seen[0]
    assert isinstance(bfloat16_pays(torch.device("cpu")), bool)


def test_what_ships_gives_the_networks_own_logits(tmp_path: Path) -> None:
    pytest.importorskip("onnxscript")
    from chauffeur.models.vilad.export import export

    torch.manual_seed(5)
    model = network(PARKING, SMALL).eval()
    export(model, tmp_path, {"version": "test", "length": TEMPLATE.length}, int8=False)
    engine = ViladEngine(tmp_path)
    one = cases("seen", 1, 1)[0]
    features = one.spots.features()
    ids, known = packed_words([one.text], WORDS)
    row = TEMPLATE.canvas.copy()
    row[1] = TEMPLATE.ids["near"]
    row[-2] = TEMPLATE.size + 2
    with torch.no_grad():
        wanted = model(
            torch.from_numpy(WORDS.vectors(ids)),
            torch.from_numpy(known),
            torch.from_numpy(features)[None],
            torch.from_numpy(row)[None],
        )[0].numpy()
    assert np.allclose(engine.predict(one.text, features)(row), wanted, atol=1e-3)
    decided = engine.decide(TEMPLATE, one.text, features, Unmasking(steps=4, tau=0.9))
    TEMPLATE.validate(decided.row, len(features))
    states = engine.steps(TEMPLATE, one.text, features, Unmasking(steps=4, tau=0.9))
    assert len(states) == decided.passes
    assert np.array_equal(states[-1], decided.row)


def test_training_goes_on_from_what_ships(tmp_path: Path) -> None:
    pytest.importorskip("onnxscript")
    from chauffeur.models.vilad.export import export

    torch.manual_seed(6)
    model = network(PARKING, SMALL).eval()
    export(model, tmp_path / "ships", {"version": "test", "length": TEMPLATE.length})
    again = train(tmp_path / "run", PARKING, replace(SMALL, steps=1, rate=0.0), WORDS, base=tmp_path / "ships")
    found = dict(again.named_parameters())
    for name, value in model.named_parameters():
        if name != "body.embed_tokens.weight":  # of no use to a network that is given vectors
            step = 1e-6 + float(value.detach().abs().max()) / 100.0
            assert torch.allclose(found[name], value, atol=step), name
