# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUntypedFunctionDecorator=false, reportUnknownParameterType=false
"""Adapting the on-board model to a person or a fleet: LoRA on accepted interactions, merged, judged, swapped in.

What ships is what is judged: base and adapted model answer the same prompts as exported int8 graphs, and the adapted
one is taken into use only if it forgot nothing and knows the held-back interactions no worse.

out/models/0001/    an adapted model, as the runtime loads it; of the interactions it holds counts only
out/current         symbolic link to the one in use; swapped by a rename, so that it names the old model or the new one
out/verdicts.jsonl  what was judged, in numbers
"""

from __future__ import annotations

import json
import logging
import math
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import (
    ChauffeurError,
    ConfigError,
    DataError,
    MissingExtraError,
    ProgramError,
)
from chauffeur.memory.files import locked, private_directory
from chauffeur.models.onboard.interactions import AcceptedInteraction, Pair, numbered_lines, pair_of, parted
from chauffeur.models.onboard.packed import Array, Packed
from chauffeur.planners.onboard.engine import MAX_PROMPT_TOKENS, Engine
from chauffeur.planners.onboard.hot import take_into_use
from chauffeur.planners.onboard.prompt import (
    END,
)
from chauffeur.planners.onboard.reply import read_reply

_log = logging.getLogger(__name__)

ADAPTED: Final = ("q_proj", "k_proj", "v_proj", "o_proj", "gate_proj", "up_proj", "down_proj")
"""Matrices that get a low-rank addition. The embeddings stay, so that the tokens mean what they meant."""
LEAST_STEPS: Final = 40
REPLAYED: Final = 4000
"""Most examples of the base's training data that are replayed."""
POINTER, MODELS, VERDICTS = "current", "models", "verdicts.jsonl"

Told = Callable[[str, int, int], None]
"""Is told (stage, done, of how many)."""


@dataclass(frozen=True, slots=True)
class AdaptRecipe:
    """What decides an adaptation.

    Attributes:
        validation: Examples of the base that were not trained on (JSON lines, e.g. `data/seen.jsonl`): the guard's.
        replay: Examples of the base's training data (e.g. `data/train.jsonl`), mixed in against forgetting.
        rank: Of the low-rank additions.
        rate: Highest learning rate.
        passes: How often each interaction is seen.
        batch: Examples a step.
        replay_share: Share of a batch that is replayed, where there is something to replay.
        keep: Weight of not moving from the base on what is replayed, against learning the interactions.
        held_share: Share of the interactions that is held back for judging.
        judged: Most validation examples that are judged.
        tolerance: Points of exact match on the validation examples that may be lost.
        seed: Of weights, order and parts.
        threads: Threads that train; 0 leaves it to PyTorch.
    """

    validation: Path
    replay: Path | None = None
    rank: int = 8
    rate: float = 3e-3
    passes: int = 30
    batch: int = 16
    replay_share: float = 0.5
    keep: float = 5.0
    held_share: float = 0.2
    judged: int = 1000
    tolerance: float = 0.5
    seed: int = 0
    threads: int = 0


def fine_tune(
    model: Any, tokenizer: Any, own: Sequence[Pair], replayed: Sequence[Pair], recipe: AdaptRecipe, told: Told
) -> Any:
    """A network with low-rank additions that learned some examples; not merged yet, and the same from the same seed.

    Args:
        model: A `LlamaForCausalLM` in float32; its own weights are not changed.
        tokenizer: Its `tokenizers.Tokenizer`.
        own: What is to be learned.
        replayed: What is not to be forgotten; may be empty.
        recipe: What decides it.
        told: Is told of the steps.
    """
    import torch
    from peft import LoraConfig, get_peft_model
    from torch.nn import functional

    from chauffeur.models.onboard.training import collate

    end: int = tokenizer.token_to_id(END)
    pairs = [(one.prompt, one.reply) for one in (*own, *replayed)]
    data = Packed.of(pairs, tokenizer, end, longest=MAX_PROMPT_TOKENS)  # as the runtime reads them
    config = LoraConfig(r=recipe.rank, lora_alpha=2 * recipe.rank, target_modules=list(ADAPTED), task_type="CAUSAL_LM")
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(recipe.seed)
        tuned: Any = get_peft_model(model, config)
    weights = [p for p in tuned.parameters() if p.requires_grad]
    optimiser = torch.optim.AdamW(weights, lr=recipe.rate, betas=(0.9, 0.98), weight_decay=0.0)
    of_own = recipe.batch if not replayed else max(1, round(recipe.batch * (1.0 - recipe.replay_share)))
    steps = max(LEAST_STEPS, math.ceil(recipe.passes * len(own) / of_own))
    rng = np.random.default_rng([recipe.seed, 41])
    turns = _turns(len(own), of_own, rng)
    tuned.train()
    for step in range(steps):
        which = next(turns)
        if replayed and recipe.batch > of_own:
            which = np.concatenate((which, len(own) + rng.integers(len(replayed), size=recipe.batch - of_own)))
        for group in optimiser.param_groups:
            group["lr"] = recipe.rate * min(1.0, (step + 1) / (0.1 * steps)) * (1.0 - step / steps)
        ids, targets = collate(data, which, end)
        logits = tuned(input_ids=ids, use_cache=False).logits.float()
        loss = functional.cross_entropy(logits[:of_own].flatten(0, 1), targets[:of_own].flatten(), ignore_index=-100)
        if len(which) > of_own:
            loss = loss + recipe.keep * _drift(tuned, ids[of_own:], logits[of_own:], targets[of_own:] != -100)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(weights, 1.0)
        optimiser.step()
        told("training", step + 1, steps)
    return tuned.eval()


def _drift(tuned: Any, ids: Any, logits: Any, replies: Any) -> Any:
    """How far the network has moved from the base: divergence over the tokens of a reply, mean over the replies.

    The base itself is the teacher here, not the examples' text: it keeps what the base is sure and unsure of alike. A
    sum over the tokens, because most of them leave no choice, and a mean would thin out the few that do.
    """
    import torch
    from torch.nn import functional

    with torch.no_grad(), tuned.disable_adapter():
        base = tuned(input_ids=ids, use_cache=False).logits.float()[replies]
    now = functional.log_softmax(logits[replies], dim=-1)
    return functional.kl_div(now, functional.log_softmax(base, dim=-1), log_target=True, reduction="sum") / len(ids)


def _turns(count: int, size: int, rng: np.random.Generator) -> Iterator[Array]:
    """Endless batches in which every example comes as often as any other."""
    waiting = np.zeros(0, np.int64)
    while True:
        while len(waiting) < size:
            waiting = np.concatenate((waiting, rng.permutation(count)))
        yield waiting[:size]
        waiting = waiting[size:]


# Judging --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Score:
    """How many replies were exactly right."""

    right: int
    of: int

    @property
    def points(self) -> float:
        """Share in percent."""
        return 100.0 * self.right / max(1, self.of)

    def __str__(self) -> str:
        return f"{self.points:.1f} % of {self.of:,}"


@dataclass(frozen=True, slots=True)
class Marks:
    """What a model knows of the base's validation examples and of the held-back interactions."""

    validation: Score
    held_back: Score


@dataclass(frozen=True, slots=True)
class AdaptingVerdict:
    """What came of an adaptation.

    Attributes:
        taken: Whether the adapted model is in use now.
        why: In words.
        base: What the base knows.
        adapted: What the adapted model knows; None where its training came to nothing that can be run.
        in_use: What the adapted model that was in use before knows; None where there was none.
        folder: The adapted model, if taken.
    """

    taken: bool
    why: str
    base: Marks
    adapted: Marks | None
    in_use: Marks | None = None
    folder: Path | None = None


def decide(base: Marks, adapted: Marks, in_use: Marks | None, tolerance: float) -> tuple[bool, str]:
    """(whether the adapted model is to be taken into use, why).

    What may be forgotten is measured from the base, so that one adaptation after the other cannot wear it away.
    """
    fall = base.validation.points - adapted.validation.points
    if fall > tolerance + 1e-9:
        return False, (
            f"It forgot: {fall:.1f} points on validation examples ({base.validation} before, {adapted.validation} "
            f"adapted); {tolerance:g} may be lost."
        )
    rivals = [base, *([] if in_use is None else [in_use])]
    best = max((rival.held_back for rival in rivals), key=lambda score: score.right)
    told = f"held-back interactions: {best} before, {adapted.held_back} adapted"
    if adapted.held_back.right < best.right:
        return False, f"It knows less of the {told}."
    return True, f"Validation: {base.validation} before, {adapted.validation} adapted; {told}."


def judge(engine: Engine, pairs: Sequence[Pair], told: Callable[[int, int], None] | None = None) -> Score:
    """How often a model's greedy reply is exactly the wanted program, question or refusal."""
    right = 0
    for number, one in enumerate(pairs):
        right += _same(engine.write(one.prompt).text, one.reply)
        if told is not None:
            told(number + 1, len(pairs))
    return Score(right, len(pairs))


def _same(written: str, wanted: str) -> bool:
    try:
        got, goal = read_reply(written), read_reply(wanted)
    except ProgramError:
        return False
    return (got.steps, got.question, got.refusal) == (goal.steps, goal.question, goal.refusal)


def _marks(name: str, folder: Path, validation: Sequence[Pair], held_back: Sequence[Pair], told: Told) -> Marks:
    engine = Engine(folder)
    of = len(validation) + len(held_back)
    first = judge(engine, validation, lambda done, _: told(f"judging {name}", done, of))
    return Marks(first, judge(engine, held_back, lambda done, _: told(f"judging {name}", len(validation) + done, of)))


# All of it ------------------------------------------------------------------------------------------------------------


def adapt(
    base: Path, interactions: Iterable[AcceptedInteraction], out: Path, recipe: AdaptRecipe, told: Told
) -> AdaptingVerdict:
    """Adapt a model, judge it, and take it into use if it passes. Stopped at any point, the old model stays in use.

    Args:
        base: A `transformers` folder as `export.export_transformers` writes; the model that ships is taken from
            `model` beside it, and exported afresh where there is none.
        interactions: What is to be learned from; they are not stored.
        out: Folder of the adapted models and of the pointer to the one in use.
        recipe: What decides it.
        told: Is told of progress.

    Raises:
        ConfigError: The recipe makes no sense.
        DataError: Base, examples or interactions cannot be used, or `out` cannot be written.
        MissingExtraError: A library is missing.
    """
    _check(recipe)
    learned, held_back = parted(interactions, recipe.held_share, recipe.seed)
    rng = np.random.default_rng([recipe.seed, 43])
    validation = some_examples(recipe.validation, recipe.judged, rng)
    if not validation:
        raise DataError(f"{recipe.validation} holds no validation examples.")
    known = frozenset(one.prompt for one in validation)
    replayed = [] if recipe.replay is None else some_examples(recipe.replay, REPLAYED, rng, known)
    try:
        private_directory(out / MODELS)  # the weights know what a person said
        with (
            locked(out / ".lock", alone=True),
            tempfile.TemporaryDirectory(dir=out / MODELS, prefix=".making-") as scratch,
        ):
            verdict = _adapted(base, learned, held_back, validation, replayed, out, Path(scratch), recipe, told)
            with (out / VERDICTS).open("a", encoding="utf-8") as file:
                row = asdict(verdict) | {"folder": None if verdict.folder is None else verdict.folder.name}
                file.write(json.dumps(row) + "\n")
    except OSError as error:
        raise DataError(f"The adapted model cannot be written to {out}: {error.strerror or error}.") from error
    return verdict


def _adapted(
    base: Path,
    learned: Sequence[AcceptedInteraction],
    held_back: Sequence[AcceptedInteraction],
    validation: Sequence[Pair],
    replayed: Sequence[Pair],
    out: Path,
    scratch: Path,
    recipe: AdaptRecipe,
    told: Told,
) -> AdaptingVerdict:
    try:
        import peft
        import torch

        from chauffeur.models.onboard.export import export
    except ImportError as error:
        raise MissingExtraError(f"Adapting needs {error.name}.", extra="models") from error
    del peft
    if recipe.threads:
        torch.set_num_threads(recipe.threads)
    shipped, tokenizer, model = _base(base, scratch)
    judged = [pair_of(one) for one in held_back]
    mark = partial(_marks, validation=validation, held_back=judged, told=told)
    before = mark("the base", shipped)
    in_use = _in_use(out, mark)
    # Each is learned with the trips that were remembered and without: the phrase is known whatever memory holds.
    own = [pair_of(one) for one in learned] + [pair_of(one, history=False) for one in learned if one.history]
    taboo = {one.prompt for one in judged}
    own = [one for one in own if one.prompt not in taboo]
    tuned = fine_tune(model, tokenizer, own, replayed, recipe, told).merge_and_unload()
    if not all(bool(torch.isfinite(p).all()) for p in tuned.parameters()):
        return AdaptingVerdict(False, "Training diverged: the weights are no finite numbers.", before, None, in_use)
    number = 1 + max((int(path.name) for path in (out / MODELS).iterdir() if path.name.isdigit()), default=0)
    made = export(tuned, tokenizer, scratch / "model", _about(shipped, number, learned, held_back, replayed, recipe))
    after = mark("the adapted model", made)
    taken, why = decide(before, after, in_use, recipe.tolerance)
    if not taken:
        return AdaptingVerdict(taken, why, before, after, in_use)
    folder = made.rename(out / MODELS / f"{number:04d}")
    take_into_use(out / POINTER, folder)
    _tidy(out, number)
    return AdaptingVerdict(taken, why, before, after, in_use, folder)


def _check(recipe: AdaptRecipe) -> None:
    whole = min(recipe.rank, recipe.passes, recipe.batch, recipe.judged) >= 1
    if not whole or recipe.rate <= 0.0 or min(recipe.tolerance, recipe.keep) < 0.0:
        raise ConfigError("Rank, passes, batch, judged and rate must be positive, tolerance and keep not negative.")
    if not 0.0 < recipe.held_share < 1.0 or not 0.0 <= recipe.replay_share < 1.0:
        raise ConfigError("Shares lie between 0 and 1.")


def _base(base: Path, scratch: Path) -> tuple[Path, Any, Any]:
    """(the folder that ships, tokenizer, network) of a base."""
    import torch
    from transformers import LlamaForCausalLM

    from chauffeur.models.onboard.examples import questions, reasons
    from chauffeur.models.onboard.export import export
    from chauffeur.models.onboard.tokens import load_tokenizer

    if not (base / "config.json").exists():
        raise DataError(f"{base} is no `transformers` folder.", hint="Give the `transformers` folder of a training.")
    try:
        model: Any = LlamaForCausalLM.from_pretrained(base, dtype=torch.float32, local_files_only=True)
        shipped = base.parent / "model"
        ships = (shipped / "model.onnx").exists()
        tokenizer: Any = load_tokenizer(shipped if ships else base)
    except Exception as error:  # the two libraries raise whatever they met in a damaged file
        raise DataError(f"The base model in {base} cannot be read: {error}.") from error
    if not ships:
        about = {"version": "unnamed", "questions": list(questions()), "reasons": list(reasons())}
        shipped = export(model, tokenizer, scratch / "base", about)
    return shipped, tokenizer, model


def _in_use(out: Path, mark: Callable[[str, Path], Marks]) -> Marks | None:
    """What the adapted model in use knows; None where there is none that can be opened."""
    pointer = out / POINTER
    if not pointer.exists():
        return None
    try:
        return mark("the model in use", pointer.resolve())
    except ChauffeurError as error:
        _log.warning("the adapted model in use cannot be judged: %s", error)
        return None


def _about(
    shipped: Path,
    number: int,
    learned: Sequence[AcceptedInteraction],
    held_back: Sequence[AcceptedInteraction],
    replayed: Sequence[Pair],
    recipe: AdaptRecipe,
) -> dict[str, Any]:
    """`model.json` of an adapted model: the base's, and counts."""
    about: dict[str, Any] = json.loads((shipped / "model.json").read_text(encoding="utf-8"))
    settings = {name: value for name, value in asdict(recipe).items() if not isinstance(value, Path | None)}
    counts = {"learned": len(learned), "held_back": len(held_back), "replayed": len(replayed)}
    version = f"{about.get('version', 'unnamed')}+adapted.{number}"
    return about | {"version": version, "adapted": {"recipe": settings, "interactions": counts}}


def some_examples(path: Path, most: int, rng: np.random.Generator, without: frozenset[str] = frozenset()) -> list[Pair]:
    """Examples of a file as the data engine writes them, drawn at random where there are more than wanted.

    Raises:
        DataError: The file cannot be read, or a drawn line is no example; says which.
    """
    count = sum(1 for _ in numbered_lines(path))
    drawn = set(rng.choice(count, min(most, count), replace=False).tolist()) if count else set[int]()
    found: list[Pair] = []
    for place, (number, line) in enumerate(numbered_lines(path)):
        if place not in drawn:
            continue
        try:
            row = json.loads(line)
            one = Pair(str(row["prompt"]), str(row["reply"]))
            read_reply(one.reply)
        except (ValueError, KeyError, TypeError, ProgramError) as error:
            raise DataError(f"{path}, line {number}: no example ({error!r}).") from None
        if one.prompt not in without:
            found.append(one)
    return found


def _tidy(out: Path, newest: int) -> None:
    """Leave the newest model and the one before it: older ones are of no use, and know what a person said."""
    numbers = sorted(int(path.name) for path in (out / MODELS).iterdir() if path.name.isdigit() and path.is_dir())
    for number in [number for number in numbers if number < newest][:-1]:
        shutil.rmtree(out / MODELS / f"{number:04d}", ignore_errors=True)
