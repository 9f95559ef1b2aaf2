"""ViLaD on frames: waypoints as tokens, training end to end on a tiny set, the model folder, and asking it."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("safetensors")

from PIL import Image  # noqa: E402

from chauffeur.bench.openloop.driving import COMMANDS  # noqa: E402
from chauffeur.bench.openloop.frames import FramesConfig  # noqa: E402
from chauffeur.bench.openloop.nuscenes import NuScenesTables  # noqa: E402
from chauffeur.bench.openloop.requests import opening, question  # noqa: E402
from chauffeur.bench.openloop.writer import DrivenSample, DrivenScene, picture_file, write_tables  # noqa: E402
from chauffeur.concept import ConfigError, DataError  # noqa: E402
from chauffeur.foreign.waypoints import read_waypoints  # noqa: E402
from chauffeur.models.net.vision import VisionConfig  # noqa: E402
from chauffeur.models.vilad.frames_answerer import FramesAnswerer  # noqa: E402
from chauffeur.models.vilad.frames_baselines import FOLDS, expected_paths, strangers_paths, train_status_mlp  # noqa: E402
from chauffeur.models.vilad.frames_data import ego_features, joined, load_frames  # noqa: E402
from chauffeur.models.vilad.frames_pipeline import FramesPlan, make_frames_model  # noqa: E402
from chauffeur.models.vilad.frames_recipe import ONE_PASS, FramesRecipe, plan_path, plan_paths, prompts, soft_targets  # noqa: E402
from chauffeur.models.vilad.frames_store import OWN, load_frames_model, measured, store_frames_model  # noqa: E402
from chauffeur.models.vilad.frames_vision import VisionRecipe, tokens_of  # noqa: E402
from chauffeur.models.vilad.waypoints import codebook, displacements, geometric_median  # noqa: E402
from chauffeur.planners.vilad.template import MASK  # noqa: E402
from chauffeur.planners.vilad.unmasking import Unmasking  # noqa: E402

SIZE = (32, 48)
TINY = FramesPlan(
    VisionRecipe(VisionConfig("small", SIZE, (8, 16, 16), stem=4), steps=90, batch=12, rate=4e-3),
    FramesRecipe(hidden=32, layers=1, heads=2, inner=48, steps=150, batch=12, rate=4e-3),
    codes=8,
    status_steps=60,
)


def write_frames(root: Path, scenes: int) -> None:
    """A world in which the picture alone tells: green goes on at 8 m/s, red brakes to a stop, whatever was before."""
    rng = np.random.default_rng(0)
    camera = FramesConfig(width=SIZE[1], height=SIZE[0]).camera
    for split in ("train", "val", "test"):
        made: list[DrivenScene] = []
        for number in range(scenes):
            red, name = bool(rng.integers(2)), f"{split}-{number}"
            steps = [4.0] * 4 + ([3.0, 2.0, 1.0, 0.0, 0.0, 0.0] if red else [4.0] * 6)
            xs = np.concatenate(([0.0], np.cumsum(steps)))
            mark = (COMMANDS[""], "brakes" if red else "goes on", "town")
            samples = tuple(DrivenSample(float(x), 5.0, 0.0, mark if i == 4 else None) for i, x in enumerate(xs))
            made.append(DrivenScene(name, "test", samples))
            path = root / picture_file(name, 4)
            path.parent.mkdir(parents=True, exist_ok=True)
            picture = Image.new("RGB", SIZE[::-1], (110, 110, 110))
            picture.paste((220, 20, 20) if red else (20, 220, 20), (16, 4, 32, 20))
            picture.save(path, "JPEG")
        write_tables(root, f"v1.0-{split}", made, camera)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, list[Any]]:
    root = tmp_path_factory.mktemp("frames")
    write_frames(root / "data", 24)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        model, lines = make_frames_model(root / "data", root / "run", TINY, lambda stage, done, of: None)
    finally:
        torch.set_num_threads(threads)
    return root / "data", model, lines


def test_the_set_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_frames(tmp_path, 3)
    frames = load_frames(tmp_path, "test", SIZE)
    assert frames.pictures.shape == (3, *SIZE, 3) and frames.pictures.dtype == np.uint8
    assert np.isnan(frames.known).all()  # nothing is known of these pictures
    assert {one.place for one in frames.samples} == {"town"}
    assert frames.ego.shape == (3, len(ego_features(frames.histories[0])))
    with pytest.raises(DataError):
        load_frames(tmp_path, "none", SIZE)


def test_a_codebook_holds_what_happens() -> None:
    rng = np.random.default_rng(1)
    histories = np.zeros((60, 5, 3))
    histories[:, :, 0] = np.array([-8.0, -6.0, -4.0, -2.0, 0.0])
    futures = np.stack([np.stack((2.0 * np.arange(1, 7) * (i % 3), np.zeros(6)), axis=1) for i in range(60)])
    futures += rng.normal(0.0, 0.01, futures.shape)
    off = displacements(histories, futures)
    book = codebook(off, 3)
    codes = book.nearest(off)
    assert [len(set(codes[i::3, 5].tolist())) for i in range(3)] == [1, 1, 1]
    sure = np.eye(3)[codes[1]]
    assert np.allclose(book.waypoints(futures[1] - off[1], sure), futures[1], atol=0.1)
    soft = soft_targets(book, off, 0.15)
    assert np.allclose(soft.sum(axis=-1), 1.0) and (soft.argmax(axis=-1) == codes).all()
    template = book.template
    assert template.length == 12 and int(template.maskable.sum()) == 6 and (template.canvas == MASK).sum() == 6


def test_the_geometric_median_is_the_point_of_least_distance() -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [10.0, 0.0]])
    middle = geometric_median(points, np.array([0.3, 0.4, 0.3]))
    assert np.allclose(middle, [1.0, 0.0], atol=0.15)
    assert np.allclose(geometric_median(points, np.array([1.0, 0.0, 0.0])), points[0], atol=1e-6)


def test_pictures_are_learnt_where_they_alone_tell(trained: tuple[Path, Path, list[Any]]) -> None:
    _, folder, lines = trained
    found = {one.method: one.l2["stp3"][3] for one in lines}
    assert found["ViLaD"] < 0.5 * found["ego-status MLP"]
    assert found["ViLaD"] < 0.5 * found["ViLaD, black pictures"]
    assert found["ViLaD"] < 0.5 * found["constant velocity"]
    assert {one.method: one.passes for one in lines}["autoregressive twin"] == 12.0
    card = (folder / "MODEL_CARD.md").read_text()
    assert "Simulated" in card and all(one.method in card for one in lines)


def test_the_stored_model_answers_as_the_conversation_asks(trained: tuple[Path, Path, list[Any]]) -> None:
    data, folder, _ = trained
    sample = next(one for one in NuScenesTables(data, "v1.0-test").samples() if one.kind == "brakes")
    model = load_frames_model(folder)
    frames = load_frames(data, "test", SIZE)
    place = [one.id for one in frames.samples].index(sample.id)
    for part in ("vilad", "twin", "regression", "status"):
        who = FramesAnswerer.from_spec(f"{folder},{part}")
        for setting in ("sft", "zero-shot"):
            said = asyncio.run(who.write([opening(sample, question(sample, setting), "pictures", 0)]))
            path = read_waypoints(said.text)
            expected, _ = model.waypoints(part, sample.history, sample.command, frames.pictures[place])
            assert path is not None and np.allclose(path, expected, atol=0.1)  # two decimals of history
    assert path is not None


def test_a_batch_decides_as_one_by_one(trained: tuple[Path, Path, list[Any]]) -> None:
    data, folder, _ = trained
    model, frames = load_frames_model(folder), load_frames(data, "test", SIZE)
    words, tokens = prompts(frames.ego, frames.commands), tokens_of(model.vision, frames.pictures)
    expected = expected_paths(model.status, frames)
    for decoder in (model.vilad, model.twin):
        for how in (Unmasking(steps=6, tau=0.9), ONE_PASS):
            many = plan_paths(decoder, model.book, expected, words, tokens, how, batch=5)
            for i in range(0, len(many), 7):
                one = plan_path(decoder, model.book, expected[i], words[i : i + 1], tokens[i : i + 1], how)
                assert (one.decided.row == many[i].decided.row).all()
                assert one.decided.passes == many[i].decided.passes
                assert np.allclose(one.waypoints, many[i].waypoints, atol=1e-3)


def test_a_model_that_is_not_there_or_damaged_is_told(tmp_path: Path, trained: tuple[Path, Path, list[Any]]) -> None:
    with pytest.raises(DataError):
        FramesAnswerer(tmp_path)
    with pytest.raises(ConfigError):
        FramesAnswerer.from_spec(f"{trained[1]},nobody")
    for file in trained[1].iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "vilad.safetensors").write_bytes(b"nothing")
    with pytest.raises(DataError):
        load_frames_model(tmp_path)


def test_a_run_goes_on_and_keeps_to_its_recipe(trained: tuple[Path, Path, list[Any]]) -> None:
    data, folder, lines = trained
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # as it was trained: sums in another order are other figures
    try:
        _, again = make_frames_model(data, folder.parent, TINY, lambda stage, done, of: None)
    finally:
        torch.set_num_threads(threads)
    assert [one.l2 for one in again] == [one.l2 for one in lines]
    other = replace(TINY, decoder=replace(TINY.decoder, rate=1e-3))
    with pytest.raises(ConfigError):
        make_frames_model(data, folder.parent, other, lambda stage, done, of: None)


def test_sets_are_joined_scene_by_scene(trained: tuple[Path, Path, list[Any]]) -> None:
    one = load_frames(trained[0], "train", SIZE)
    both = joined([one, one])
    assert len(both.samples) == len(both.pictures) == len(both.futures) == len(both.known) == 2 * len(one.samples)
    assert len({sample.scene for sample in both.samples}) == 2 * len({sample.scene for sample in one.samples})
    assert joined([one]) is one


def test_half_the_bits_answer_alike(tmp_path: Path, trained: tuple[Path, Path, list[Any]]) -> None:
    data, folder, _ = trained
    model, frames = load_frames_model(folder), load_frames(data, "test", SIZE)
    store_frames_model(tmp_path, model, half=True)
    size = sum(one.stat().st_size for one in tmp_path.glob("*.safetensors"))
    assert size < 0.6 * sum(one.stat().st_size for one in folder.glob("*.safetensors"))
    whole, _ = measured(model, "regression", frames)
    half, _ = measured(load_frames_model(tmp_path), "regression", frames)
    assert np.abs(whole - half).max() < 0.1


def test_what_ships_answers() -> None:
    answerer = FramesAnswerer.from_spec("")
    assert answerer.id == "vilad-frames/,vilad" and "vilad-frames-v2" in answerer.model
    model = load_frames_model(OWN)
    history = np.stack((np.linspace(-12.0, 0.0, 5), np.zeros(5), np.zeros(5)), axis=1)
    found, passes = model.waypoints("vilad", history, COMMANDS[""], np.full((*model.size, 3), 110, np.uint8))
    assert passes == 1 and found.shape == (6, 2) and np.isfinite(found).all()
    assert sum(one.stat().st_size for one in OWN.iterdir()) < 4e6
    unseen = {one["method"]: one["l2"]["stp3"][3] for one in model.about["figures"]["test"]}
    assert unseen["ViLaD"] < min(unseen["ego-status MLP"], unseen["autoregressive twin"])


def test_displacements_are_from_constant_velocity() -> None:
    histories = np.zeros((1, 5, 3))
    histories[0, :, 0] = [-12.0, -9.0, -6.0, -3.0, 0.0]
    futures = np.stack((3.0 * np.arange(1, 7), np.zeros(6)), axis=1)[None]
    assert np.allclose(displacements(histories, futures), 0.0)


def test_whoever_expects_a_frame_was_trained_without_its_scene(trained: tuple[Path, Path, list[Any]]) -> None:
    frames = load_frames(trained[0], "train", SIZE)
    roads = ["town"] * 12 + ["highway"] * 12  # each place's scenes are dealt out, so no fold is a place of its own
    samples = tuple(replace(one, place=road) for one, road in zip(frames.samples, roads, strict=True))
    frames = replace(frames, samples=samples)
    turn = np.arange(len(frames.samples)) % 12 % FOLDS  # a frame a scene
    found = strangers_paths(frames, steps=20)
    for fold in (0, FOLDS - 1):
        own = turn == fold
        alone = train_status_mlp(frames.part(~own), frames.part(own), 20)
        assert np.allclose(found[own], expected_paths(alone, frames.part(own)), atol=1e-5)
