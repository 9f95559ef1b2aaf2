"""The paper's path for real weights, end to end on a random Qwen2.5-VL of some thousand weights."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("tokenizers")
pytest.importorskip("peft")

from tiny_qwen import tiny_qwen  # noqa: E402

from chauffeur.concept import ConfigError, Context, Instruction, PlanRequest, SystemMessage  # noqa: E402
from chauffeur.models.vlm.lora import ChatExamples, LoraRecipe, encoded, fine_tune_vlm  # noqa: E402
from chauffeur.planners.motion import MotionPlanner, read_matrix  # noqa: E402
from chauffeur.planners.vlm_processor import load_processor  # noqa: E402
from chauffeur.safety.gain_box import gain_box  # noqa: E402


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny_qwen(tmp_path_factory.mktemp("qwen"))


@pytest.fixture(scope="module")
def examples() -> ChatExamples:
    return ChatExamples(size=(112, 64))


def test_the_preset_is_the_papers() -> None:
    paper = LoraRecipe()
    assert (paper.epochs, paper.batch, paper.accumulate, paper.rate, paper.pairs) == (5, 2, 8, 1e-5, 10_000)
    assert paper.steps == 3125


def test_an_example_answers_with_gains_of_the_certified_box(examples: ChatExamples) -> None:
    for number in range(6):
        one = examples[number]
        policy, reply = read_matrix(one.answer)
        assert policy is not None and not gain_box().outside(policy) and "camera" in reply.thoughts
        assert any("image_url" in str(part) for part in one.messages[-1]["content"])
    assert examples[0].messages[-1]["content"][1] == examples[2].messages[-1]["content"][1]  # one picture, three styles


def test_only_the_answer_is_learned(checkpoint: Path, examples: ChatExamples) -> None:
    processor = load_processor(str(checkpoint))
    batch = encoded(processor, [examples[0], examples[1]])
    learned = batch["labels"] != -100
    assert learned.any(dim=1).all() and learned.float().mean() < 0.2
    assert (batch["labels"][learned] == batch["input_ids"][learned]).all()


def test_a_checkpoint_is_tuned_merged_resumed_and_asked_for_gains(
    checkpoint: Path, examples: ChatExamples, tmp_path: Path
) -> None:
    recipe = LoraRecipe(epochs=1, pairs=8, batch=1, accumulate=2, rate=5e-2, rank=2, alpha=4, precision="float32")
    seen: list[float] = []
    merged = fine_tune_vlm(str(checkpoint), tmp_path, recipe, examples, lambda step, loss, _: seen.append(loss))
    assert seen[-1] < seen[0]
    from safetensors.torch import load_file

    before, after = (load_file(folder / "model.safetensors") for folder in (checkpoint, merged))
    changed = {name for name, value in after.items() if not torch.equal(value, before[name])}
    assert changed and all("visual" not in name for name in changed)
    fine_tune_vlm(str(checkpoint), tmp_path, recipe, examples, lambda step, loss, _: pytest.fail("it was finished"))
    again = load_file(merged / "model.safetensors")  # its additions came back from the run's state
    assert all(torch.equal(value, again[name]) for name, value in after.items())
    planner = MotionPlanner.from_spec(f"transformers/{merged}")
    assert planner.sees
    plan = asyncio.run(planner.plan(_request()))
    assert plan.policy is None and "action matrix" in plan.refusal  # random weights write no matrix, and it is said


def test_a_folder_without_a_checkpoint_is_refused(examples: ChatExamples, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no vision-language model"):
        fine_tune_vlm(str(tmp_path / "none"), tmp_path, LoraRecipe(), examples)


def _request() -> PlanRequest:
    from chauffeur.describe.track import describe_track
    from chauffeur.driving.seat import SeatCamera
    from chauffeur.worlds.track import TrackWorld, track_scenario

    world = TrackWorld()
    observation = world.reset(track_scenario("left_turn", "snow"))
    context: Context = describe_track(observation)
    return PlanRequest(
        Instruction("Gently, please."), context, SystemMessage(""), images=SeatCamera(world, 3).take(observation)
    )
