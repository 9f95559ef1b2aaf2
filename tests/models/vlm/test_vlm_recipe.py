"""The on-board VLM's recipe: scenes, wishes and gains that are held apart, and a network that learns from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("onnxscript")
pytest.importorskip("osqp")

from chauffeur.bench.motion.items import commands, style_ranges  # noqa: E402
from chauffeur.bench.motion.scoring import command_alignment  # noqa: E402
from chauffeur.concept import ConfigError, DataError  # noqa: E402
from chauffeur.models.vlm.config import VlmRecipe  # noqa: E402
from chauffeur.models.vlm.ear import fitted_head, style_worth  # noqa: E402
from chauffeur.models.vlm.export import VlmGraph, export  # noqa: E402
from chauffeur.models.vlm.gains import GainCase, taught_gains  # noqa: E402
from chauffeur.models.vlm.network import SIZES, CompactVlm  # noqa: E402
from chauffeur.models.vlm.recipe import answer_row, batches, loss_of, train  # noqa: E402
from chauffeur.models.vlm.scenes import PictureSet, SceneFacts, load_pictures, make_pictures, seat_scene  # noqa: E402
from chauffeur.models.vlm.seeing import mirrored, picture_batches, sights, varied  # noqa: E402
from chauffeur.models.vlm.wishes import TEST_WRITERS, held_wishes, training_wish, written  # noqa: E402
from chauffeur.planners.camera_faults import (  # noqa: E402
    CELLS,
    HEIGHT,
    WIDTH,
)
from chauffeur.planners.vlm.engine import VlmEngine  # noqa: E402
from chauffeur.planners.vlm.sentences import FEATURES, load_head, shipped_encoder  # noqa: E402
from chauffeur.planners.vlm.template import SEEN_WEATHERS, STYLES, TEMPLATE, GainCodebook  # noqa: E402
from chauffeur.planners.word_table import SHIPPED_WORDS, load_words  # noqa: E402
from chauffeur.planners.word_table import WIDTH as WORD_WIDTH  # noqa: E402
from chauffeur.safety.gain_box import care, gain_box  # noqa: E402

CODEBOOK = GainCodebook.of(gain_box())
TINY = VlmRecipe(size="tiny", scenes=20, seeing_steps=2, seen_pictures=3, steps=3, pictures=3)


def test_taught_gains_fit_their_style_and_are_the_more_careful_the_worse_the_weather() -> None:
    for style in STYLES:
        cares: list[float] = []
        for weather in SEEN_WEATHERS:
            grade = "clear" if weather == "sunny" else "heavy"
            policy = CODEBOOK.matrix(CODEBOOK.tokens(taught_gains(GainCase(style, weather, grade))))
            assert not gain_box().outside(policy)
            assert command_alignment(policy, style_ranges()[style]) > 99.0
            cares.append(care(policy))
        assert cares == sorted(cares) and cares[0] < cares[1]


def test_feedback_moves_taught_gains_and_never_towards_boldness_in_bad_weather() -> None:
    def careful(style: str, weather: str, recall: str) -> float:
        case = GainCase(style, weather, "clear" if weather == "sunny" else "light", recall=recall)
        return care(CODEBOOK.matrix(CODEBOOK.tokens(taught_gains(case))))

    for style in STYLES:
        assert careful(style, "sunny", "gentler") > careful(style, "sunny", "none")
    assert careful("moderate", "sunny", "brisker") < careful("moderate", "sunny", "none")
    assert careful("aggressive", "snow", "brisker") == careful("aggressive", "snow", "none")


def test_no_sentence_of_the_tests_is_one_of_training() -> None:
    known = {text for texts in written("train").values() for text in texts}
    unknown = {text for texts in written("test").values() for text in texts}
    assert len(unknown) > 1000 and len(known & unknown) < 0.02 * len(unknown)  # two may say the same few words
    assert len(TEST_WRITERS) == 6
    rng = np.random.default_rng(0)
    drawn = {training_wish(style, rng) for style in STYLES for _ in range(150)}
    assert not drawn & {command.text for command in commands()}
    assert held_wishes("test", 9, 1) == held_wishes("test", 9, 1)
    assert [style for _, style in held_wishes("test", 6, 1)] == [*STYLES, *STYLES]


def test_a_scene_is_its_numbers_own_and_splits_share_no_place() -> None:
    one, again = seat_scene("train", 7), seat_scene("train", 7)
    assert one.facts == again.facts and one.seed == again.seed
    seeds = {split: {seat_scene(split, i).seed for i in range(15)} for split in ("train", "test")}
    assert not seeds["train"] & seeds["test"]
    assert {seat_scene("val", i).facts.weather for i in range(5)} == set(SEEN_WEATHERS)


def pictures(count: int) -> PictureSet:
    rng = np.random.default_rng(3)
    facts = [SceneFacts(SEEN_WEATHERS[i % 5], "light", "lead", "bend_left", "left_turn", "track") for i in range(count)]
    pixels = rng.integers(0, 255, (count, HEIGHT, WIDTH, 3), np.uint8)
    return PictureSet(pixels, rng.integers(0, 255, (count, 2, *CELLS), np.uint8), tuple(facts))


def test_an_answer_says_what_is_true_and_what_the_table_gives() -> None:
    row = answer_row(pictures(1).facts[0], "moderate", "gentler", CODEBOOK)
    values = TEMPLATE.decode(row)
    assert (values["style"], values["weather"], values["road"]) == ("moderate", "sunny", "bend_left")


def test_variation_keeps_pictures_pictures() -> None:
    shown = varied(pictures(3).pixels, np.random.default_rng(0))
    assert shown.shape == (3, HEIGHT, WIDTH, 3) and shown.min() >= 0.0 and shown.max() <= 1.0


def test_a_mirrored_picture_comes_with_what_is_true_of_it() -> None:
    held = pictures(4)
    shown, sight, cells = next(picture_batches(replace(TINY, seen_pictures=16), held)(0))
    assert shown.shape == (16, HEIGHT, WIDTH, 3) and sight.shape == (16, 4) and cells.shape == (16, 2, *CELLS)
    assert set(sight[:, 3].tolist()) == {1, 2}  # bends to the left, and in the mirror to the right
    assert mirrored(mirrored(held.facts[0])) == held.facts[0]


def test_the_same_recipe_gives_the_same_weights_and_another_is_not_continued(tmp_path: Path) -> None:
    words, held = load_words(SHIPPED_WORDS), pictures(20)
    whole = train(tmp_path / "whole", TINY, held, words)
    with pytest.raises(ConfigError):
        train(tmp_path / "whole", replace(TINY, steps=4), held, words)
    again = train(tmp_path / "again", TINY, held, words)
    assert all(torch.equal(a, b) for a, b in zip(whole.parameters(), again.parameters(), strict=True))
    seen, facts = sights(whole, held, TINY.seed)
    first, second = (next(batches(TINY, seen, facts, words)(2)) for _ in range(2))
    assert torch.equal(first.words, second.words) and torch.equal(first.seen, second.seen)
    assert float(loss_of(whole, first).detach()) > 0.0


def test_the_style_is_heard_before_anything_is_seen() -> None:
    torch.manual_seed(0)
    model = CompactVlm(SIZES["tiny"]).eval()
    row = torch.from_numpy(answer_row(pictures(1).facts[0], "moderate", "none", CODEBOOK))[None]
    words, known = torch.randn(1, 5, WORD_WIDTH), torch.ones(1, 5, dtype=torch.bool)
    with torch.inference_mode():
        one, two = (model(words, known, model.seen(torch.rand(1, HEIGHT, WIDTH, 3)), row) for _ in range(2))
    at = TEMPLATE.places
    assert torch.equal(one[:, at["style"]], two[:, at["style"]])
    assert not torch.equal(one[:, at["weather"]], two[:, at["weather"]])


def test_the_graph_that_ships_is_the_network(tmp_path: Path) -> None:
    torch.manual_seed(0)
    model = CompactVlm(SIZES["tiny"]).eval()
    row = torch.from_numpy(answer_row(pictures(1).facts[0], "moderate", "none", CODEBOOK))[None]
    words, pixels = torch.randn(1, 9, WORD_WIDTH), torch.rand(1, HEIGHT, WIDTH, 3)
    with torch.inference_mode():
        own = model(words, torch.ones(1, 9, dtype=torch.bool), model.seen(pixels), row)[:, 2:]
        graph = VlmGraph(model)(words, pixels, row)[:, 2:]
    assert torch.allclose(own, graph, atol=1e-4)
    about = {"version": "test", "tokens": list(TEMPLATE.words), "codebook": dict(CODEBOOK.values)}
    engine = VlmEngine(export(model, tmp_path / "model", about, int8=False))
    given = {"task": "left_turn", "recall": "none"}
    read = engine.read("gently please", pictures(1).pixels[0], given)
    assert read == engine.read("gently please", pictures(1).pixels[0], given)
    assert not gain_box().outside(read.policy) and read.values["task"] == "left_turn"
    forced = engine.read("gently please", None, {**given, "weather": "snow", "style": "conservative"})
    assert (forced.values["weather"], forced.values["style"]) == ("snow", "conservative")
    with pytest.raises(DataError, match="weather"):
        engine.read("gently", None, {**given, "weather": "hail"})
    (tmp_path / "model" / "model.json").write_text('{"codebook": {}, "tokens": ["other"], "version": "x"}')
    with pytest.raises(DataError, match="other tokens"):
        VlmEngine(tmp_path / "model")


def test_pictures_are_rendered_once_and_read_back(tmp_path: Path) -> None:
    pytest.importorskip("moderngl")
    make_pictures(tmp_path, "val", 3, lambda *_: None)
    (file,) = tmp_path.iterdir()
    stamp = file.stat().st_mtime_ns
    make_pictures(tmp_path, "val", 3, lambda *_: None)
    held = load_pictures(tmp_path, "val", 3)
    assert file.stat().st_mtime_ns == stamp and len(held) == 3
    assert held.facts[1] == seat_scene("val", 1).facts and held.pixels.std() > 5.0
    assert all((lead <= vehicles).all() for vehicles, lead in held.cells)
    with pytest.raises(DataError, match="not 4"):
        load_pictures(tmp_path, "val", 4)


def test_in_doubt_between_haste_and_care_moderate_gains_fit_best() -> None:
    worth = np.array(style_worth())
    assert (np.diag(worth) > 0.99).all() and worth.shape == (3, 3)
    assert int((worth @ np.array([0.5, 0.0, 0.5])).argmax()) == STYLES.index("moderate")
    assert int((worth @ np.array([0.0, 0.1, 0.9])).argmax()) == STYLES.index("aggressive")


def test_a_head_learns_what_separates_styles_and_is_read_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    wanted = rng.integers(0, 3, 300)
    features = rng.standard_normal((300, FEATURES), np.float32)
    features[:, :3] += 4.0 * np.eye(3, dtype=np.float32)[wanted]
    fitted_head(features, wanted, 0).store(tmp_path / "head.npz")
    head = load_head(tmp_path / "head.npz")
    assert np.mean([head.scores(row).argmax() == want for row, want in zip(features, wanted, strict=True)]) > 0.9
    (tmp_path / "head.npz").write_bytes(b"damaged")
    with pytest.raises(DataError):
        load_head(tmp_path / "head.npz")


def test_the_encoder_that_ships_tells_sentences_apart() -> None:
    encoder = shipped_encoder()
    late, later, calm = (encoder.features(text) for text in ("I am late.", "I'm running late!", "What a calm evening."))
    assert late.shape == (FEATURES,)

    def like(one: Any, two: Any) -> float:
        return float(one @ two / np.linalg.norm(one) / np.linalg.norm(two))

    assert like(late, later) > like(late, calm)
