# pyright: reportMissingImports=false, reportUnknownParameterType=false
"""Two more readers of the style beside the network: a sorter of words, and a head on a frozen sentence encoder.

The network knows what words mean from a table of vectors and a few thousand sentences; the sorter
(`chauffeur.language.text_classifier`) knows which words and pairs of words writers used; the encoder (all-MiniLM-L6-v2)
knows the world's English, and what somebody late for a train is after. On unseen writers all three together err least:
the planner multiplies what they find, with an exponent each.
"""

from __future__ import annotations

from statistics import fmean
from typing import Any, Final

import numpy as np
import torch
from torch import nn

from chauffeur.bench.motion.items import style_ranges
from chauffeur.bench.motion.scoring import command_alignment
from chauffeur.language.text_classifier import TextClassifier
from chauffeur.models.sorting.sentences import Sentence
from chauffeur.models.sorting.training import SortingRecipe, train
from chauffeur.models.vlm.gains import GainCase, taught_gains
from chauffeur.models.vlm.wishes import composed_wish, with_weather, written
from chauffeur.planners.vlm.sentences import FEATURES, SentenceEncoder, StyleHead
from chauffeur.planners.vlm.template import SEEN_WEATHERS, STYLES, GainCodebook
from chauffeur.safety.gain_box import gain_box

Array = np.ndarray[Any, Any]

NETWORK_SHARE: Final = 0.15
HEAD_SHARE: Final = 1.5
"""Exponents of the network's and the head's shares beside the sorter's, chosen on the tuning writers."""
_COMPOSED: Final = 12_000
_COMPOSED_FOR_HEAD: Final = 3_000
"""Sentences of the grammars, beside all of the table's."""
_WEATHER_SAID: Final = 0.2
"""Sentences that come a second time with a remark on the weather behind them."""
_MEMBERS, _HIDDEN, _STEPS, _BATCH, _RATE = 4, 128, 500, 512, 2e-3
_DROPPED: Final = (0.3, 0.3)
_SMOOTHED: Final = 0.05


def style_sorter(seed: int) -> TextClassifier:
    """The sorter, from the sentences of training alone; seven seconds of one core."""
    found = [Sentence(text, style, STYLES, "", "") for text, style in _sentences(seed, _COMPOSED)]
    return train(found, STYLES, SortingRecipe(epochs=14, rate=0.03, seed=seed))


def style_head(seed: int, encoder: SentenceEncoder) -> StyleHead:
    """The head, from the same sentences; a minute of one core, most of it the encoder's."""
    found = _sentences(seed, _COMPOSED_FOR_HEAD)
    features = np.stack([encoder.features(text) for text, _ in found])
    return fitted_head(features, np.array([STYLES.index(style) for _, style in found]), seed)


def _sentences(seed: int, composed: int) -> list[tuple[str, str]]:
    rng = np.random.default_rng([seed, 53])
    found = [(text, style) for style, texts in written("train").items() for text in texts]
    for place in range(composed):
        style = STYLES[place % len(STYLES)]
        found.append((composed_wish(style, rng), style))
    # Somebody late on a slippery road is late all the same: what is said of the weather is heard elsewhere.
    some = rng.permutation(len(found))[: int(_WEATHER_SAID * len(found))]
    return found + [(with_weather(found[int(place)][0], rng), found[int(place)][1]) for place in some]


def fitted_head(features: Array, wanted: Array, seed: int) -> StyleHead:
    """A head that was trained on features (N, FEATURES) of sentences and the places of their styles (N,).

    Several small networks, each from its own start; every style counts alike.
    """
    mean, deviation = features.mean(axis=0), features.std(axis=0) + 1e-5
    x, y = torch.from_numpy((features - mean) / deviation), torch.from_numpy(wanted)
    weight = torch.tensor([1.0 / max(1, int((wanted == place).sum())) for place in range(len(STYLES))])
    weight = weight * len(wanted) / len(STYLES)
    parts: list[tuple[Array, ...]] = []
    for member in range(_MEMBERS):
        torch.manual_seed(seed * 100 + member)
        chance = torch.Generator().manual_seed(seed * 100 + member)
        first, second = nn.Linear(FEATURES, _HIDDEN), nn.Linear(_HIDDEN, len(STYLES))
        net = nn.Sequential(nn.Dropout(_DROPPED[0]), first, nn.ReLU(), nn.Dropout(_DROPPED[1]), second)
        optimiser = torch.optim.AdamW(net.parameters(), _RATE, weight_decay=0.05)
        for step in range(_STEPS):
            for group in optimiser.param_groups:
                group["lr"] = _RATE * (1.0 - step / _STEPS)
            some = torch.randint(0, len(x), (_BATCH,), generator=chance)
            loss = nn.functional.cross_entropy(net(x[some]), y[some], weight=weight, label_smoothing=_SMOOTHED)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        w, b = first.weight.detach().numpy(), first.bias.detach().numpy()
        out, last = second.weight.detach().numpy(), second.bias.detach().numpy()
        parts.append(((w / deviation).T, b - w @ (mean / deviation), out.T / _MEMBERS, last / _MEMBERS))
    return StyleHead(
        np.concatenate([part[0] for part in parts], axis=1).astype(np.float16),
        np.concatenate([part[1] for part in parts]),
        np.concatenate([part[2] for part in parts]),
        np.sum([part[3] for part in parts], axis=0),
    )


def style_worth() -> list[list[float]]:
    """Fit of the gains taught for a style (row) fit the ranges of the one that was meant (column), Eq. 27 / 100.

    In doubt between haste and care, moderate gains are off by less than either: a reader that is not sure takes the
    style whose expected worth is highest.
    """
    codebook = GainCodebook.of(gain_box())

    def worth(taken: str, meant: str) -> float:
        cases = [GainCase(taken, weather, "clear" if weather == "sunny" else "heavy") for weather in SEEN_WEATHERS]
        policies = [codebook.matrix(codebook.tokens(taught_gains(case))) for case in cases]
        return fmean(command_alignment(policy, style_ranges()[meant]) for policy in policies) / 100.0

    return [[round(worth(taken, meant), 4) for meant in STYLES] for taken in STYLES]
