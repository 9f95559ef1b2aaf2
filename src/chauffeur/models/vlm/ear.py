"""A second reader of the style: the sorter of `chauffeur.language.text_classifier`, trained on the same sentences.

The network knows what words mean from a table of vectors and a few thousand sentences; the sorter knows which words and
pairs of words writers used. On unseen writers the sorter errs less, both together least: the planner multiplies what
they find, the network's with an exponent.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from chauffeur.language.text_classifier import TextClassifier
from chauffeur.models.sorting.sentences import Sentence
from chauffeur.models.sorting.training import SortingRecipe, train
from chauffeur.models.vlm.wishes import composed_wish, written
from chauffeur.planners.vlm.template import STYLES

NETWORK_SHARE: Final = 0.3
"""Exponent of the network's shares beside the sorter's: the best of 0, 0.15, 0.3, 0.5 and 1 on the tuning writers."""
_COMPOSED: Final = 12_000
"""Sentences of the grammars, beside all of the table's."""


def style_sorter(seed: int) -> TextClassifier:
    """The sorter, from the sentences of training alone; seven seconds of one core."""
    rng = np.random.default_rng([seed, 53])
    found = [Sentence(text, style, STYLES, "", "") for style, texts in written("train").items() for text in texts]
    for place in range(_COMPOSED):
        style = STYLES[place % len(STYLES)]
        found.append(Sentence(composed_wish(style, rng), style, STYLES, "", ""))
    return train(found, STYLES, SortingRecipe(epochs=14, rate=0.03, seed=seed))
