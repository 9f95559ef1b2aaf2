"""Adapting the on-board model: it learns what was accepted, forgets nothing, and is swapped in between two requests."""

from __future__ import annotations

import asyncio
import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chauffeur.concept import (
    ConfigError,
    Context,
    DataError,
    Feedback,
    HistoryItem,
    Instruction,
    Lead,
    PlanRequest,
    Program,
    Situation,
    SystemMessage,
)
from chauffeur.models.onboard.adaptation import (
    AdaptingVerdict,
    AdaptRecipe,
    Marks,
    Score,
    adapt,
    decide,
    fine_tune,
    judge,
    some_examples,
)
from chauffeur.models.onboard.cases import Case
from chauffeur.models.onboard.examples import wish_example
from chauffeur.models.onboard.interactions import (
    AcceptedInteraction,
    Pair,
    exported_items,
    interactions_of,
    load_interactions,
    parted,
)
from chauffeur.planners.onboard.dialect import DialectStep, write
from chauffeur.planners.onboard.hot import HotModel, HotPlanner, opened, take_into_use
from chauffeur.planners.onboard.prompt import prompt

LIBRARIES = ("torch", "peft", "transformers", "tokenizers", "onnx", "onnxscript", "onnxruntime", "llguidance")
HIGHWAY = Situation("highway", 25.0, 31.2928, 3, 1, False, Lead(3, 43.0, 24.0), None)
STEPS = tuple(
    (DialectStep(skill),)
    for skill in ("faster", "slower", "lane_left", "lane_right", "overtake_left", "hurry", "relax", "pull_over")
)
WORDINGS = 48
HURRY, RELAX = write([DialectStep("hurry")]), write([DialectStep("relax")])


BOOGIE = [
    AcceptedInteraction(f"{begin}{end}", HIGHWAY, (), HURRY, True)
    for begin in ("Let us boogie", "Boogie", "Time to boogie", "Now boogie")
    for end in ("", " please", " again")
]


def told(stage: str, done: int, of: int) -> None:
    assert stage
    assert 0 < done <= of


@dataclass(frozen=True)
class Trained:
    """A tiny model and its examples."""

    folder: Path
    tokenizer: Any
    wanted: str = ""

    @property
    def boogie(self) -> list[AcceptedInteraction]:
        """A phrase that the base takes for something else."""
        return [replace(one, program=self.wanted) for one in BOOGIE]

    @property
    def base(self) -> Path:
        return self.folder / "transformers"

    @property
    def recipe(self) -> AdaptRecipe:
        """How much so small a network forgets depends on the machine's rounding; a ruined one shows all the same."""
        data = self.folder / "data"
        return AdaptRecipe(data / "seen.jsonl", data / "train.jsonl", tolerance=50.0, judged=40, rate=5e-3, threads=1)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Trained:
    """A tiny network that knows eight skills in the words of the grammar."""
    for library in LIBRARIES:
        pytest.importorskip(library)
    import torch

    from chauffeur.models.onboard.examples import questions, reasons
    from chauffeur.models.onboard.export import export, export_transformers
    from chauffeur.models.onboard.packed import Packed
    from chauffeur.models.onboard.tokens import train_tokenizer
    from chauffeur.models.onboard.training import Recipe, train

    folder = tmp_path_factory.mktemp("onboard")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    rows = [
        wish_example(
            Case(i, {}, replace(HIGHWAY, speed_mps=18.0 + i % 13), STEPS[i % len(STEPS)], ""),
            np.random.default_rng(i % WORDINGS),
            held=False,
        )
        for i in range(480)
    ]
    pairs = [Pair(row.prompt, row.reply) for row in rows]
    tokenizer = train_tokenizer(text for one in pairs for text in (one.prompt, one.reply))
    end = tokenizer.token_to_id("<|end|>")
    for name in ("training", "data"):
        (folder / name).mkdir()
    recipe = Recipe(size="tiny", steps=400, batch_tokens=1024, rate=5e-3, warmup=20)
    packed = Packed.of([(one.prompt, one.reply) for one in pairs], tokenizer, end)
    model = train(packed, folder / "training", recipe, vocabulary=tokenizer.get_vocab_size(), end=end, device="cpu")
    about = {"version": "tiny", "questions": list(questions()), "reasons": list(reasons())}
    export(model, tokenizer, folder / "model", about)
    export_transformers(model, tokenizer, folder / "transformers")
    # What is judged was trained on: a network this small knows nothing else, and forgetting shows all the same.
    for name, part in (("train", rows[40:]), ("seen", rows[:40])):
        (folder / "data" / f"{name}.jsonl").write_text("".join(json.dumps(asdict(row)) + "\n" for row in part))
    torch.set_num_threads(threads)
    guesses = {answers(folder / "model", one) for one in BOOGIE}
    wanted = next(program for steps in STEPS if not any((program := write(steps)) in guess for guess in guesses))
    return Trained(folder, tokenizer, wanted)


@pytest.fixture(scope="module")
def boogied(trained: Trained, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, AdaptingVerdict]]:
    """(out, verdict) of an adaptation that went well."""
    out = tmp_path_factory.mktemp("ana")
    yield out, adapt(trained.base, trained.boogie, out, trained.recipe, told)


def answers(folder: Path, one: AcceptedInteraction) -> str:
    return opened(folder).write(prompt(one.situation, one.history, one.wish)).text


# Interactions ---------------------------------------------------------------------------------------------------------


def lines_of(path: Path, rows: list[Any]) -> Path:
    path.write_text("".join((row if isinstance(row, str) else json.dumps(row)) + "\n" for row in rows))
    return path


def test_interactions_are_read_from_json_lines(tmp_path: Path) -> None:
    assert load_interactions(lines_of(tmp_path / "a.jsonl", [asdict(one) for one in BOOGIE])) == BOOGIE


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("{", "JSON"),
        (asdict(BOOGIE[0]) | {"program": "def drive():\n    yield from fly()\n"}, "fly"),
        (asdict(BOOGIE[0]) | {"program": "import os"}, "drive()"),
        (asdict(BOOGIE[0]) | {"wish": " "}, "empty"),
        (asdict(BOOGIE[0]) | {"history": ["<|reply|>REFUSE"]}, "mark"),
        (asdict(BOOGIE[0]) | {"accepted": "perhaps"}, "accepted"),
        ({"wish": "faster"}, "situation"),
    ],
)
def test_a_bad_line_is_named(tmp_path: Path, row: Any, words: str) -> None:
    path = lines_of(tmp_path / "a.jsonl", [asdict(BOOGIE[0]), "", row])
    with pytest.raises(DataError, match="line 3") as caught:
        load_interactions(path)
    assert words in str(caught.value)


def test_a_bad_example_is_named(tmp_path: Path) -> None:
    path = lines_of(tmp_path / "a.jsonl", [{"prompt": "x", "reply": "ASK: Which?"}, {"prompt": "y", "reply": "fly"}])
    with pytest.raises(DataError, match="line 2"):
        some_examples(path, 10, np.random.default_rng(0))
    with pytest.raises(DataError, match="cannot be read"):
        load_interactions(tmp_path / "none.jsonl")


def item(words: str, program: str = HURRY, outcome: str = "ended", *said: Feedback) -> HistoryItem:
    context = "I am driving at 25.0 m/s. The speed limit of my lane is 31.3 m/s."
    return HistoryItem("t", "2026-01-01", words, context, "highway", "", "", program, (), said, outcome)


def test_accepted_trips_of_memory_become_interactions() -> None:
    liked, rough = Feedback("great", approval=1), Feedback("too rough", comfort=-1, strength=0.6)
    items = [
        item("go"),
        item("crash", HURRY, "collision"),
        item("rough", HURRY, "success", liked, rough),
        item("better now", HURRY, "success", rough, liked),
        item("no program of the dialect", "def policy(): pass"),
        item("again", RELAX, "success"),
    ]
    found = interactions_of(items)
    assert [one.wish for one in found] == ["go", "better now", "again"]
    assert found[2].history == ("hurry(): good", "hurry()")
    assert found[0].situation is not None
    assert found[0].situation.speed_mps == 25.0
    assert interactions_of([replace(items[0], context="somewhere")])[0].situation is None


def test_an_exported_profile_becomes_items() -> None:
    kept = item("go", HURRY, "ended", Feedback("great", approval=1))
    fields = asdict(kept)
    trip = {"trip": "t", "when": kept.when, "settings": [], **{n: fields[n] for n in fields if n != "settings"}}
    assert exported_items(json.dumps({"trips": [trip]})) == [kept]
    with pytest.raises(DataError):
        exported_items("[]")


def test_parts_are_apart_and_stay_so() -> None:
    learned, held = parted(BOOGIE, 0.25, seed=0)
    assert (len(learned), len(held)) == (9, 3)
    assert parted(reversed(BOOGIE), 0.25, seed=0) == (learned, held)
    newer = replace(BOOGIE[0], program=RELAX)
    both = parted([*BOOGIE, newer, replace(BOOGIE[1], accepted=False, program=RELAX)], 0.25, seed=0)
    programs = {one.wish: one.program for part in both for one in part}
    assert programs[BOOGIE[0].wish] == RELAX
    assert programs[BOOGIE[1].wish] == HURRY
    with pytest.raises(DataError, match="3 different"):
        parted(BOOGIE[:3], 0.25, seed=0)


# Learning and judging -------------------------------------------------------------------------------------------------


def test_what_the_base_gets_wrong_becomes_right(trained: Trained, boogied: tuple[Path, AdaptingVerdict]) -> None:
    out, verdict = boogied
    assert verdict.taken, verdict
    assert verdict.adapted is not None
    assert verdict.base.held_back.right == 0
    assert verdict.adapted.held_back.right == verdict.adapted.held_back.of == 2
    for one in BOOGIE:
        assert trained.wanted not in answers(trained.folder / "model", one)
        assert trained.wanted in answers(out / "current", one)
    assert verdict.base.validation.points > 60.0  # or the guard would guard nothing
    assert (out / "current").resolve() == (out / "models" / "0001").resolve()


def test_the_model_folder_holds_counts_only(boogied: tuple[Path, AdaptingVerdict]) -> None:
    out, _ = boogied
    about = json.loads((out / "current" / "model.json").read_text())
    assert about["version"] == "tiny+adapted.1"
    counts = about["adapted"]["interactions"]
    assert (counts["learned"], counts["held_back"]) == (10, 2)
    assert counts["replayed"] > 50
    assert sorted(path.name for path in (out / "models").iterdir()) == ["0001"]
    for path in out.rglob("*"):
        if path.is_file():
            assert b"boogie" not in path.read_bytes().lower(), path
            assert str(out.parent).encode() not in path.read_bytes(), path


def test_the_same_seed_gives_the_same_model(
    trained: Trained, boogied: tuple[Path, AdaptingVerdict], tmp_path: Path
) -> None:
    out, verdict = boogied
    again = adapt(trained.base, trained.boogie, tmp_path, trained.recipe, told)
    assert again.adapted == verdict.adapted
    assert (tmp_path / "current" / "model.onnx").read_bytes() == (out / "current" / "model.onnx").read_bytes()


def test_merged_is_what_was_trained(trained: Trained) -> None:
    import torch
    from transformers import LlamaForCausalLM

    model = LlamaForCausalLM.from_pretrained(trained.base, dtype=torch.float32)
    pairs = [Pair(prompt(HIGHWAY, (), "Let us boogie"), "ASK: Which?")]
    ids = torch.tensor([trained.tokenizer.encode(pairs[0].prompt).ids])
    with torch.no_grad():
        before = model(input_ids=ids).logits
    tuned = fine_tune(model, trained.tokenizer, pairs, [], trained.recipe, told)
    with torch.no_grad():
        unmerged = tuned(input_ids=ids).logits
        merged = tuned.merge_and_unload()(input_ids=ids).logits
    torch.testing.assert_close(merged, unmerged, rtol=1e-4, atol=1e-4)
    assert float((unmerged - before).abs().max()) > 0.1


def test_a_ruined_model_is_not_taken_into_use(
    trained: Trained, boogied: tuple[Path, AdaptingVerdict], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    shutil.copytree(boogied[0], out, symlinks=True)
    muddle = [replace(one, program=(HURRY, RELAX)[i % 2]) for i, one in enumerate(BOOGIE)]
    ruined = adapt(trained.base, muddle, out, replace(trained.recipe, rate=0.3, replay=None, tolerance=0.5), told)
    assert not ruined.taken
    assert ruined.why.startswith("It forgot")
    assert ruined.in_use is not None
    assert (out / "current").resolve().name == "0001"
    assert [path.name for path in (out / "models").iterdir()] == ["0001"]
    assert [json.loads(line)["taken"] for line in (out / "verdicts.jsonl").read_text().splitlines()] == [True, False]


def test_a_model_that_diverged_is_not_taken_into_use(trained: Trained, tmp_path: Path) -> None:
    verdict = adapt(trained.base, BOOGIE, tmp_path, replace(trained.recipe, rate=1e30), told)
    assert (verdict.taken, verdict.adapted) == (False, None)
    assert "diverged" in verdict.why
    assert not (tmp_path / "current").exists()


def test_ctrl_c_leaves_the_old_model(trained: Trained, boogied: tuple[Path, AdaptingVerdict], tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(boogied[0], out, symlinks=True)

    def stop(stage: str, done: int, of: int) -> None:
        if stage == "training" and done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        adapt(trained.base, trained.boogie, out, trained.recipe, stop)
    assert (out / "current").resolve().name == "0001"
    assert [path.name for path in (out / "models").iterdir()] == ["0001"]


def test_the_guard_weighs_both_numbers() -> None:
    base = Marks(Score(900, 1000), Score(2, 10))
    assert decide(base, Marks(Score(895, 1000), Score(2, 10)), None, 0.5)[0]
    taken, why = decide(base, Marks(Score(894, 1000), Score(9, 10)), None, 0.5)
    assert not taken
    assert "0.6 points" in why
    assert not decide(base, Marks(Score(900, 1000), Score(1, 10)), None, 0.5)[0]
    assert not decide(base, Marks(Score(900, 1000), Score(5, 10)), Marks(Score(900, 1000), Score(6, 10)), 0.5)[0]


def test_replies_are_judged_exactly(trained: Trained) -> None:
    engine = opened(trained.folder / "model")
    text = prompt(HIGHWAY, (), "change to the left lane")
    written = engine.write(text).text
    assert judge(engine, [Pair(text, written), Pair(text, "REFUSE: No."), Pair(text, "nothing")]) == Score(1, 3)


def test_senseless_recipes_and_bases_are_refused(trained: Trained, tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        adapt(trained.base, BOOGIE, tmp_path, replace(trained.recipe, held_share=1.0), told)
    with pytest.raises(DataError, match="no `transformers` folder"):
        adapt(tmp_path / "none", BOOGIE, tmp_path, trained.recipe, told)


# In use ---------------------------------------------------------------------------------------------------------------


def test_a_new_model_is_noticed_between_two_requests(
    trained: Trained, boogied: tuple[Path, AdaptingVerdict], tmp_path: Path
) -> None:
    pointer = tmp_path / "current"
    hot = HotModel(pointer, opened, otherwise=trained.folder / "model")
    first = hot.current()
    assert hot.current() is first
    assert first.about["version"] == "tiny"
    take_into_use(pointer, boogied[0] / "models" / "0001")
    second = hot.current()
    assert second.about["version"] == "tiny+adapted.1"
    assert first.about["version"] == "tiny"  # a request under way keeps what it began with
    take_into_use(pointer, trained.folder / "model")
    assert hot.current().about["version"] == "tiny"


def test_an_unreadable_model_leaves_the_old_one_in_use(trained: Trained, tmp_path: Path) -> None:
    pointer, broken = tmp_path / "current", tmp_path / "broken"
    take_into_use(pointer, trained.folder / "model")
    hot = HotModel(pointer, opened)
    first = hot.current()
    shutil.copytree(trained.folder / "model", broken)
    (broken / "model.onnx").write_bytes(b"no graph")
    take_into_use(pointer, broken)
    assert hot.current() is first
    shutil.rmtree(broken)
    assert hot.current() is first
    pointer.unlink()
    assert hot.current() is first
    with pytest.raises(DataError):
        HotModel(pointer, opened)


def test_a_planner_changes_its_model(trained: Trained, boogied: tuple[Path, AdaptingVerdict], tmp_path: Path) -> None:
    pointer = tmp_path / "current"
    planner = HotPlanner(pointer, trained.folder / "model")
    assert (planner.id, planner.model) == ("onboard", "tiny")
    take_into_use(pointer, boogied[0] / "models" / "0001")
    request = PlanRequest(Instruction("Let us boogie"), Context("", HIGHWAY), SystemMessage(""))
    plan = asyncio.run(planner.plan(request))
    assert plan.model == "tiny+adapted.1"
    assert isinstance(plan.policy, Program), plan.refusal
    assert plan.policy.source == trained.wanted


def test_a_pointer_never_replaces_a_folder(trained: Trained, tmp_path: Path) -> None:
    (tmp_path / "current" / "x").mkdir(parents=True)
    with pytest.raises(DataError):
        take_into_use(tmp_path / "current", trained.folder / "model")
    assert [path.name for path in tmp_path.iterdir()] == ["current"]
