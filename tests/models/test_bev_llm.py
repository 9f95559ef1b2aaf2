"""BEV-LLM: its geometry, Eq. 9 and 10, ablations, training that goes on where it stopped, and Mllama's own weights."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")

from nuplanqa_items import tiny_split  # noqa: E402

from chauffeur.bench.nuplanqa.scenes.wording import wordings  # noqa: E402
from chauffeur.camera import nuplan_rig  # noqa: E402
from chauffeur.concept import ConfigError, DataError  # noqa: E402
from chauffeur.models.bev_llm.facets import KINDS, cells_of, facets, labels_of  # noqa: E402
from chauffeur.models.bev_llm.fusion import BevFusion, FusionConfig, rig_tensors  # noqa: E402
from chauffeur.models.bev_llm.geometry import BevGrid, rig_geometry  # noqa: E402
from chauffeur.models.bev_llm.network import CompactBevLlm, MllamaBevLlm  # noqa: E402
from chauffeur.models.bev_llm.recipe import (  # noqa: E402
    BevLlmRecipe,
    CompactAnswerer,
    compact,
    inherit_weights,
    joined,
    train_compact,
)
from chauffeur.models.bev_llm.views import FRONT_VIEWS, VIEWS, camera_of, cut, view_cameras  # noqa: E402
from chauffeur.models.bev_llm.vocabulary import QuestionWordTable  # noqa: E402

RIG = nuplan_rig(112, 64).only("CAM_F0", "CAM_L0", "CAM_B0")
PATCHES = (4, 7)


def test_a_cell_looks_where_it_is_seen() -> None:
    grid = BevGrid()
    geometry = rig_geometry(RIG.cameras, PATCHES, grid)
    assert geometry.rays.shape == (84, 6) and geometry.bias.shape == (60, 84)
    per_view = geometry.bias.reshape(60, 3, 28).max(axis=2)
    centres = grid.centres()
    far_ahead = int(np.argmin(np.hypot(centres[:, 0] - 30.0, centres[:, 1])))
    behind = int(np.argmin(np.hypot(centres[:, 0] + 12.0, centres[:, 1])))
    assert per_view[far_ahead].argmax() == 0 and per_view[behind].argmax() == 2
    left = int(np.argmin(np.hypot(centres[:, 0] - 8.0, centres[:, 1] - 10.0)))
    assert per_view[left].argmax() == 1


def _fuse(config: FusionConfig, views: Any, motion: Any | None = None) -> Any:
    torch.manual_seed(0)
    rig = rig_tensors(rig_geometry(RIG.cameras, PATCHES, config.grid))
    given = torch.zeros(views.shape[0], views.shape[1], 3) if motion is None else motion
    return BevFusion(config)(views[:, -1], views[:, :-1], rig, given)[0]


def test_history_reaches_the_present_through_the_cells_alone() -> None:
    torch.manual_seed(1)
    views = torch.randn(2, 3, 84, 32)
    changed = views.clone()
    changed[:, 0] += 1.0
    full, blind_to_it, without = (
        FusionConfig(16, 2, bev_width=16),
        FusionConfig(16, 2, bev_width=16, history=False),
        FusionConfig(16, 2, bev_width=16, bev=False),
    )
    assert not torch.allclose(_fuse(full, views), _fuse(full, changed))
    assert torch.equal(_fuse(blind_to_it, views), _fuse(blind_to_it, changed))
    assert torch.equal(_fuse(without, views), _fuse(without, changed))
    moved = torch.zeros(2, 3, 3)
    moved[:, 1:, 0] = 1.0
    assert not torch.allclose(_fuse(full, views), _fuse(full, views, moved))


def test_a_silent_fusion_changes_nothing() -> None:
    torch.manual_seed(0)
    config = FusionConfig(16, 2, bev_width=16)
    fusion = BevFusion(config)
    fusion.start_silent()
    views = torch.randn(1, 2, 84, 32)
    rig = rig_tensors(rig_geometry(RIG.cameras, PATCHES, config.grid))
    fused, cells = fusion(views[:, -1], views[:, :-1], rig, torch.zeros(1, 2, 3))
    assert torch.allclose(fused, views[:, -1], atol=1e-6)
    assert cells.shape == (1, config.grid.cells, 16)


def test_of_earlier_instants_fewer_patches_may_come() -> None:
    torch.manual_seed(0)
    config = FusionConfig(16, 2, bev_width=16)
    rig = rig_tensors(rig_geometry(RIG.cameras, PATCHES, config.grid))
    now, past = torch.randn(2, 84, 32), torch.randn(2, 1, 28, 32)
    fusion = BevFusion(config)
    fused, _ = fusion(now, past, rig, torch.zeros(2, 2, 3))
    assert fused.shape == (2, 84, 32)
    assert not torch.allclose(fused, fusion(now, past + 1.0, rig, torch.zeros(2, 2, 3))[0])


def test_training_learns_goes_on_and_is_loaded_again(tmp_path: Path) -> None:
    data = tiny_split()
    recipe = BevLlmRecipe(
        steps=30, scenes=8, rate=3e-3, gather_steps=20, gather_scenes=8, word_steps=20, questions=6, word_rate=5e-3
    )
    one = train_compact(tmp_path / "one", recipe, data, data)
    assert one.perceived(data)["light"] > 0.9
    assert one.accuracy(data)["total"] > 0.9
    again = CompactAnswerer.load(tmp_path / "one" / "model")
    assert again.choose(data) == one.choose(data)
    short = BevLlmRecipe(steps=3, scenes=4, gather_steps=2, word_steps=2, questions=2)
    train_compact(tmp_path / "two", short, data, data)
    train_compact(tmp_path / "two", replace(short, steps=5, gather_steps=3, word_steps=4), data, data)
    for stage, steps in (("perception", [3, 5]), ("gathering", [2, 3]), ("language", [2, 4])):
        lines = [json.loads(line) for line in (tmp_path / "two" / stage / "log.jsonl").read_text().splitlines()]
        assert [line["step"] for line in lines] == steps
    with pytest.raises(ConfigError, match="another recipe"):
        train_compact(tmp_path / "two", replace(short, seed=1), data, data)
    begun = replace(short, steps=0, gather_steps=0, word_steps=1)
    after = train_compact(tmp_path / "three", begun, data, data, begin=tmp_path / "one" / "model")
    assert after.perceived(data)["light"] == one.perceived(data)["light"]  # what was learned is taken over
    with pytest.raises(DataError, match="no BEV-LLM"):
        train_compact(tmp_path / "four", begun, data, data, begin=tmp_path / "nowhere")


def test_what_was_known_of_a_view_goes_to_the_view_of_that_name(tmp_path: Path) -> None:
    data = tiny_split(2)
    new, old = _answerer(data), _answerer(data)
    cameras = [data.cameras[-1], *(replace(one, name=f"{one.name}?") for one in data.cameras[1:-1]), data.cameras[0]]
    CompactAnswerer(old.network, old.words, old.facets, cameras).save(tmp_path)
    inherit_weights(new, tmp_path)
    before, after = (
        one.network.gist.patches.weight.detach().half().unflatten(1, (len(VIEWS), -1)) for one in (old, new)
    )
    assert torch.equal(after[:, 0], before[:, -1]) and torch.equal(after[:, -1], before[:, 0])
    assert not after[:, 1:-1].any()


def test_splits_of_several_sets_are_learned_as_one() -> None:
    one, two = tiny_split(3), tiny_split(2)
    both = joined([one, two])
    assert len(both.truth) == 5 and both.now.shape[0] == 5 and len(both.items) == len(one.items) + len(two.items)
    with pytest.raises(DataError, match="cameras"):
        joined([one, replace(two, cameras=two.cameras[:2])])


def test_an_option_fits_as_far_as_what_it_means_is_believed() -> None:
    data = tiny_split()
    answerer = _answerer(data)
    network, words = answerer.network.eval(), answerer.words
    names = [(name, value) for name, classes in answerer.facets for value in classes]
    options = ("The light ahead is red.", "The light ahead is green.")
    texts = torch.tensor([words.text("What does the light show?", option) for option in options])
    believed = torch.full((1, len(names)), -9.0)
    believed[0, names.index(("light", "green"))] = -0.1
    network.beliefs = lambda tokens: believed.expand(len(tokens), -1)  # type: ignore[method-assign]
    optimiser = torch.optim.Adam(network.means.parameters(), 0.03)
    meant = torch.tensor([names.index(("light", "red")), names.index(("light", "green"))])
    for _ in range(20):
        optimiser.zero_grad()
        torch.nn.functional.nll_loss(network.means(texts), meant).backward()
        optimiser.step()
    with torch.inference_mode():
        scores, found = network(answerer.all_tokens(data)[:1].expand(2, -1, -1), texts, torch.ones_like(texts))
    assert found.argmax(dim=1).tolist() == meant.tolist()
    assert scores[1] > scores[0]


def test_wordings_can_be_kept_apart_to_choose_by() -> None:
    said = {"train": ("a", "b", "c"), "test": ("d",)}
    assert wordings(said, "spoken") == ("a", "b") and wordings(said, "unspoken") == ("c",)
    assert wordings(said, "train") == ("a", "b", "c") and wordings(said, "test") == ("d",)


def _answerer(data: Any, keep: Any = "full") -> CompactAnswerer:
    words, of = QuestionWordTable.taught(), facets()
    torch.manual_seed(0)
    network = CompactBevLlm(compact(BevLlmRecipe(ablation=keep), words, of, data.now.shape[-2:]))
    return CompactAnswerer(network.eval(), words, of, data.cameras, keep)


@pytest.mark.parametrize("keep", ["full", "no-bev", "no-history", "single-view", "blind"])
def test_ablations_keep_from_the_network_what_they_say(keep: Any) -> None:
    data = tiny_split()
    trained, tested = _answerer(data, keep), _answerer(data).keeping(keep)
    for answerer in (trained, tested):
        rows = slice(0, 1)

        def tokens(now: Any, past: Any, answerer: CompactAnswerer = answerer, rows: slice = rows) -> Any:
            return answerer.tokens(now, past, data.motion[rows])[0]

        before = tokens(data.now[rows], data.past[rows])

        def changed(view: int, past: bool, tokens: Any = tokens, before: Any = before, rows: slice = rows) -> bool:
            now, earlier = data.now[rows].copy(), data.past[rows].copy()
            at = earlier[:, 0] if past else now
            at[:, view] = 255 - at[:, view]
            return not torch.equal(before, tokens(now, earlier))

        assert changed(0, past=False) is (keep != "blind")
        assert changed(4, past=False) is (keep not in {"blind", "single-view"})
        assert changed(0, past=True) is (keep in {"full", "single-view"})


def test_an_option_is_read_by_itself() -> None:
    data = tiny_split()
    answerer = _answerer(data)
    tokens = answerer.all_tokens(data)
    item = data.items[0]
    with torch.inference_mode():
        scores = answerer.scores(tokens, [(0, item.question, item.options, item.speeds_mps)])[0]
        moved = answerer.scores(tokens, [(0, item.question, item.options[1:] + item.options[:1], item.speeds_mps)])[0]
    assert torch.allclose(scores.roll(-1), moved, atol=1e-5)  # nothing hangs on the letter


def test_labels_say_what_is_known_and_no_more() -> None:
    truth = {
        "motion": "steady",
        "lead": [18.0, -4.0],
        "facts": [["beside", "left", "bus"], ["sky", "", "clear night"]],
        "users": [("car", 20.0, 1.0, True), ("truck", -10.0, 5.0, False), ("car", 300.0, 0.0, True)],
    }
    of = facets()
    labels = dict(zip([name for name, _ in of], labels_of(truth, of).tolist(), strict=True))
    classes = dict(of)
    assert classes["beside left"][labels["beside left"]] == "bus" and labels["beside right"] == -1
    assert classes["distance"][labels["distance"]] == "below 22 m"
    assert classes["approach"][labels["approach"]] == "below -3 m/s"
    assert labels_of({**truth, "lead": None}, of)[[name for name, _ in of].index("distance")] == -1
    cells = cells_of(truth, BevGrid())
    assert sorted(set(cells.tolist())) == [-1, 0, KINDS.index("car")] and (cells > 0).sum() == 1


def test_cuts_of_the_front_picture_are_cameras_of_their_own() -> None:
    from PIL import Image

    front = nuplan_rig(224, 128)["CAM_F0"]
    cameras = view_cameras([front], (64, 112))
    points = np.array([[30.0, 1.0, 1.0], [60.0, -2.0, 3.0]])
    pixels, _ = front.project(points)
    picture = np.zeros((128, 224, 3), np.uint8)
    for u, v in pixels:
        picture[int(v), int(u)] = 255
    assert len(cameras) == FRONT_VIEWS
    for camera in cameras:
        shown = cut(Image.fromarray(picture), camera.name, (64, 112)).sum(axis=0)
        for u, v in camera.project(points)[0]:
            assert shown[int(v) - 1 : int(v) + 2, int(u) - 1 : int(u) + 2].max() > 100


def tiny_mllama() -> Any:
    from transformers import MllamaConfig, MllamaForConditionalGeneration

    vision = {
        "hidden_size": 16, "num_hidden_layers": 4, "num_global_layers": 1, "attention_heads": 2, "image_size": 28,
        "patch_size": 14, "intermediate_layers_indices": [1, 3], "vision_output_dim": 48, "max_num_tiles": 1,
        "supported_aspect_ratios": [[1, 1]], "intermediate_size": 32,
    }  # fmt: skip
    text = {
        "vocab_size": 64, "hidden_size": 32, "intermediate_size": 64, "num_hidden_layers": 3, "num_attention_heads": 4,
        "num_key_value_heads": 2, "cross_attention_layers": [1], "max_position_embeddings": 64, "pad_token_id": 0,
        "bos_token_id": 1, "eos_token_id": 2,
        "rope_parameters": {"rope_type": "default", "rope_theta": 10000.0},
    }  # fmt: skip
    torch.manual_seed(0)
    return MllamaForConditionalGeneration(MllamaConfig(vision_config=vision, text_config=text))


def test_mllama_weights_come_in_by_the_standard_path_and_answer_as_before(tmp_path: Path) -> None:
    mllama = tiny_mllama().eval()
    torch.nn.init.ones_(mllama.model.language_model.layers[1].cross_attn_attn_gate)
    mllama.save_pretrained(tmp_path)
    model = MllamaBevLlm.from_mllama(tmp_path).eval()
    pixels = torch.randn(1, 2, 3, 1, 3, 28, 28)
    ratios = torch.ones(1, 2, 3, dtype=torch.long)
    tokens = torch.tensor([[1, 5, 6, 7]])
    features = 8  # tokens of a tile: four patches and the class token, padded to eight
    grid = model.fusion.config.grid
    with torch.inference_mode():
        states = mllama.model.vision_model(pixels[:, -1], ratios[:, -1], torch.ones(1, 3, 1, dtype=torch.long))
        per_tile = states.last_hidden_state.shape[-2]
        assert per_tile <= features
        rig = (torch.randn(3 * per_tile, 6), torch.zeros(grid.cells, 3 * per_tile), torch.from_numpy(grid.centres()))
        seen = model.see(pixels, ratios, rig, torch.zeros(1, 2, 3))
        logits = model(seen, tokens)
        plain = mllama(
            input_ids=tokens, pixel_values=pixels[:, -1], aspect_ratio_ids=ratios[:, -1],
            aspect_ratio_mask=torch.ones(1, 3, 1, dtype=torch.long),
            cross_attention_mask=torch.ones(1, 4, 3, 1, dtype=torch.long),
        ).logits  # fmt: skip
    assert torch.allclose(logits, plain, atol=1e-4)  # an untrained fusion is silent: Llama-3.2-Vision as it was
    with torch.no_grad():
        model.fusion.sfa.out.weight.normal_()
    model.save(tmp_path / "tuned")
    loaded = MllamaBevLlm.from_mllama(tmp_path / "tuned").eval()
    with torch.inference_mode():
        assert torch.equal(
            loaded.see(pixels, ratios, rig, torch.zeros(1, 2, 3)), model.see(pixels, ratios, rig, torch.zeros(1, 2, 3))
        )
        assert not torch.allclose(loaded(loaded.see(pixels, ratios, rig, torch.zeros(1, 2, 3)), tokens), plain)


def test_it_answers_in_the_benchmark_as_it_does_alone(tmp_path: Path) -> None:
    import asyncio
    import base64
    import io

    from PIL import Image

    from chauffeur.bench.nuplanqa.frames import CAMERAS
    from chauffeur.models.bev_llm.answering import BevLlmAnswerer
    from chauffeur.planners.base import Answerer

    data = tiny_split(4)
    _answerer(data).save(tmp_path)
    alone = CompactAnswerer.load(tmp_path)
    model = BevLlmAnswerer.from_spec(str(tmp_path))
    assert isinstance(model, Answerer)
    rng = np.random.default_rng(1)
    for row, item in enumerate(found[0] for found in data.questions):
        taken = {(name, ago): rng.integers(0, 255, (32, 48, 3), dtype=np.uint8) for name in CAMERAS for ago in (2, 0)}
        parts: list[dict[str, Any]] = []
        now, past = data.now[:1].copy(), data.past[:1].copy()
        for (name, ago), pixels in taken.items():
            image = Image.fromarray(pixels)
            for place, view in enumerate(VIEWS):
                if camera_of(view) == name and (ago == 0 or place < 2):
                    (now if ago == 0 else past[:, 0])[0, place] = cut(image, view, (32, 48))
            file = io.BytesIO()
            image.save(file, "PNG")
            url = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
            parts += [
                {"type": "text", "text": f"{name} (view), {f'{ago} s ago' if ago else 'now'}:"},
                {"type": "image_url", "image_url": {"url": url}},
            ]
        motion = np.zeros((1, 2, 3), np.float32)
        motion[0, -1, 0] = 0.2  # 1 m/s for 2 s, in tens of metres
        parts.append({"type": "text", "text": f"{item.text()}\n\nAnswer with the letter."})
        answer = asyncio.run(model.write([{"role": "user", "content": parts}])).text  # type: ignore[list-item]
        with torch.inference_mode():
            tokens, _ = alone.tokens(now, past, motion)
            scores = alone.scores(tokens, [(0, item.question, item.options, item.speeds_mps)])
        assert answer == f"({'abcd'[int(scores.argmax())]})", row
