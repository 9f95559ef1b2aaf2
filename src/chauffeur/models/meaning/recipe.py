"""Training the parser of meaning: from banks of phrases and an open sentence encoder to weights on disk."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn
from torch.utils.data import DataLoader

from chauffeur.concept import DataError
from chauffeur.language.meaning.pieces import WordPieces, read_vocabulary
from chauffeur.language.meaning.symbols import END, INDEX, MOST_SYMBOLS, PAD, POINTER, START, SYMBOLS, Written
from chauffeur.models.meaning.banks import banks, merged
from chauffeur.models.meaning.batches import Sentences, tensors
from chauffeur.models.meaning.labelled import written
from chauffeur.models.meaning.network import MeaningParser, ParserConfig

WEIGHTS: Final = "parser.pt"
CONFIG: Final = "config.json"
VOCABULARY: Final = "vocab.txt"


@dataclass(frozen=True)
class MeaningRecipe:
    """Settings that decide a training.

    Attributes:
        encoder: Folder of all-MiniLM-L6-v2 (Apache-2.0), or of another BERT of its width.
        out: Folder of the weights.
        base: Folder of a trained parser to go on from; empty to begin with the encoder alone.
        held_out: Writers whose banks and labelled sentences are left out.
        seconds: Time of training, s; the learning rate falls to zero over it.
        steps: Steps at most; 0 for as many as fit the time.
        batch: Sentences a step.
        encoder_rate, decoder_rate: Learning rates at their highest.
        frozen: The encoder's first layers that stay as they are, to save time when a training goes on.
        smoothing: Of the targets.
        seed: Of sentences and weights.
        workers: Processes that compose.
        device: Of torch.
        network: Sizes.
    """

    encoder: str
    out: str
    base: str = ""
    held_out: tuple[str, ...] = ()
    seconds: float = 900.0
    steps: int = 0
    batch: int = 256
    encoder_rate: float = 2.5e-4
    decoder_rate: float = 8e-4
    frozen: int = 0
    smoothing: float = 0.03
    seed: int = 1
    workers: int = 2
    device: str = "cpu"
    network: ParserConfig = field(default_factory=ParserConfig)


def fit(
    recipe: MeaningRecipe, tell: Callable[[str], None], look: Callable[[MeaningParser, int], None] | None = None
) -> MeaningParser:
    """Train a parser and write its weights.

    Args:
        recipe: What decides it.
        tell: Hears how it goes.
        look: Called with the network now and then, e.g. to score it.
    """
    from transformers import AutoModel

    torch.manual_seed(recipe.seed)
    encoder = AutoModel.from_pretrained(recipe.encoder, add_pooling_layer=False).float()
    network = MeaningParser(encoder, recipe.network).to(recipe.device)
    if recipe.base:
        go_on_from(network, Path(recipe.base))
    # Word vectors stay as they were: rare words that no bank holds keep their neighbourhood.
    encoder.embeddings.word_embeddings.weight.requires_grad_(False)
    if recipe.frozen:
        for part in (network.encoder.embeddings, *network.encoder.encoder.layer[: recipe.frozen]):
            part.requires_grad_(False)
    writers = banks(recipe.held_out)
    whole = merged(writers)
    vocabulary = Path(recipe.encoder) / VOCABULARY
    stream = Sentences(
        [whole, *(merged([whole, *[writer] * len(writers)], writer.name) for writer in writers)],
        written(recipe.held_out),
        vocabulary,
        recipe.seed,
        recipe.batch,
    )
    loader = DataLoader(
        stream, batch_size=None, num_workers=recipe.workers, prefetch_factor=8 if recipe.workers else None
    )
    parts = [one for one in network.encoder.parameters() if one.requires_grad]
    own = {id(one) for one in parts}
    rest = [one for one in network.parameters() if one.requires_grad and id(one) not in own]
    rates = (recipe.encoder_rate, recipe.decoder_rate)
    optimiser = torch.optim.AdamW(
        [{"params": parts, "lr": rates[0]}, {"params": rest, "lr": rates[1]}], weight_decay=0.01, betas=(0.9, 0.98)
    )
    begun, step, total, looked = time.monotonic(), 0, 0.0, 0.0
    network.train()
    try:
        for batch in loader:
            passed = time.monotonic() - begun - looked
            done = max(passed / recipe.seconds, step / recipe.steps if recipe.steps else 0.0)
            if done >= 1.0:
                break
            factor = min(1.0, (step + 1) / 200) * (0.5 * (1.0 + math.cos(math.pi * done)) * 0.98 + 0.02)
            for group, rate in zip(optimiser.param_groups, rates, strict=True):
                group["lr"] = rate * factor
            loss = loss_of(network, [one.to(recipe.device, non_blocking=True) for one in batch], recipe.smoothing)
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimiser.step()
            step += 1
            if step % 100 == 0:
                total = float(loss.detach())
                tell(f"step {step}  loss {total:.4f}  {step * recipe.batch / max(passed, 1e-9):.0f}/s  {passed:.0f} s")
            if look is not None and step % 2000 == 0:
                start = time.monotonic()
                look(network, step)
                looked += time.monotonic() - start
    except KeyboardInterrupt:
        tell(f"Stopped after {step} steps; what was learned is kept.")
    folder = Path(recipe.out)
    folder.mkdir(parents=True, exist_ok=True)
    torch.save(
        {name: value.half() if value.is_floating_point() else value for name, value in network.state_dict().items()},
        folder / WEIGHTS,
    )
    held = asdict(recipe) | {"trained_steps": step, "loss": total, "banks": [bank.name for bank in writers]}
    held["symbols"] = list(SYMBOLS)
    (folder / CONFIG).write_text(json.dumps(held, indent=1))
    return network


def mean_of(stages: Mapping[Path, float], out: Path) -> None:
    """Write the mean of the weights of several stages of one training, which reads better than its last one alone.

    Args:
        stages: Folders that `fit` wrote, one trained on from the other, and the share of each.
        out: Where the mean is written, in the form of `fit`.

    Raises:
        DataError: The shares do not add up to 1, or the networks have other parameters.
    """
    held = [torch.load(folder / WEIGHTS, weights_only=True) for folder in stages]
    shares = list(stages.values())
    shapes = [{name: value.shape for name, value in one.items()} for one in held]
    if not math.isclose(sum(shares), 1.0) or any(one != shapes[0] for one in shapes):
        raise DataError("A mean of weights is of networks with the same parameters, by shares that add up to 1.")
    mean = {
        name: torch.stack([share * one[name].float() for share, one in zip(shares, held, strict=True)])
        .sum(0)
        .to(value.dtype)
        if value.is_floating_point()
        else value
        for name, value in held[-1].items()
    }
    last = list(stages)[-1]
    about = json.loads((last / CONFIG).read_text()) | {
        "mean_of": [[folder.name, one] for folder, one in stages.items()]
    }
    out.mkdir(parents=True, exist_ok=True)
    torch.save(mean, out / WEIGHTS)
    (out / CONFIG).write_text(json.dumps(about, indent=1))


def go_on_from(network: MeaningParser, folder: Path) -> None:
    """Take over what a trained parser knows, symbol by symbol: symbols that it did not have begin untrained."""
    held: dict[str, Tensor] = torch.load(folder / WEIGHTS, weights_only=True)
    known: list[str] = json.loads((folder / CONFIG).read_text()).get("symbols", list(SYMBOLS))
    own = network.state_dict()
    rows = [(INDEX[symbol], at) for at, symbol in enumerate(known) if symbol in INDEX]
    new, old = torch.tensor([row[0] for row in rows]), torch.tensor([row[1] for row in rows])
    for name, value in held.items():
        if name in ("symbols.weight", "out.weight", "out.bias"):
            own[name][new] = value.float()[old]
        elif own[name].shape == value.shape:
            own[name] = value.to(own[name].dtype)
    network.load_state_dict(own)


def loss_of(network: MeaningParser, batch: Sequence[Tensor], smoothing: float) -> Tensor:
    """Cross-entropy of what is written next, pointers included."""
    ids, mask, symbols, tokens, targets = batch
    kind = ids.device.type
    with torch.autocast(kind, dtype=torch.bfloat16, enabled=kind == "cuda"):
        memory = network.encode(ids, mask)
        scores = network.decode(symbols[:, :-1], tokens[:, :-1], memory, mask)
    wanted = targets[:, 1:]
    # Smoothing is over symbols alone: a wrong token is never a little right.
    flat, aim = scores.float().flatten(0, 1), wanted.flatten()
    held = aim != INDEX[PAD]
    plain = nn.functional.cross_entropy(flat, aim, ignore_index=INDEX[PAD])
    spread = -torch.log_softmax(flat[:, : len(SYMBOLS)], -1).mean(-1)[held].mean()
    return (1.0 - smoothing) * plain + smoothing * spread


@torch.no_grad()
def written_for(network: MeaningParser, texts: Sequence[str], pieces: WordPieces, device: str) -> list[list[Written]]:
    """Output of the network for texts, greedily and without the grammar: for a look while it learns."""
    network.eval()
    split = [pieces.split(text) for text in texts]
    ids, mask, *_ = tensors([(list(one.ids), [INDEX[START]], [0]) for one in split])
    ids, mask = ids.to(device), mask.to(device)
    memory = network.encode(ids, mask)
    written = torch.full((len(texts), 1), INDEX[START], device=device)
    tokens = torch.zeros_like(written)
    for _ in range(MOST_SYMBOLS - 1):
        best = network.decode(written, tokens, memory, mask)[:, -1].argmax(-1)
        points = best >= len(SYMBOLS)
        written = torch.cat([written, torch.where(points, INDEX[POINTER], best)[:, None]], 1)
        tokens = torch.cat([tokens, torch.where(points, best - len(SYMBOLS), 0)[:, None]], 1)
        if bool((written == INDEX[END]).any(1).all()):
            break
    network.train()
    out: list[list[Written]] = []
    for symbols, pointed in zip(written[:, 1:].tolist(), tokens[:, 1:].tolist(), strict=True):
        row: list[Written] = []
        for symbol, token in zip(symbols, pointed, strict=True):
            if symbol == INDEX[END]:
                break
            row.append(token if symbol == INDEX[POINTER] else SYMBOLS[symbol])
        out.append(row)
    return out


def load(folder: Path, encoder: str, device: str = "cpu") -> tuple[MeaningParser, WordPieces]:
    """A trained network and its pieces. Raises DataError: no weights are there."""
    from transformers import AutoConfig, AutoModel

    if not (folder / WEIGHTS).is_file():
        raise DataError(f"{folder} holds no {WEIGHTS}.")
    config: dict[str, Any] = json.loads((folder / CONFIG).read_text())
    bare = AutoModel.from_config(AutoConfig.from_pretrained(encoder), add_pooling_layer=False)
    network = MeaningParser(bare, ParserConfig(**config["network"]))
    network.load_state_dict(
        {
            name: value.float() if value.is_floating_point() else value
            for name, value in torch.load(folder / WEIGHTS, weights_only=True).items()
        }
    )
    return network.to(device).eval(), WordPieces(read_vocabulary(Path(encoder) / VOCABULARY))
