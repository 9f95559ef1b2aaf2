# pyright: reportMissingImports=false, reportMissingModuleSource=false
"""The simple reader that stands beside the network: logistic regression over n-grams, in front of the same solver.

TF-IDF of words and their pairs and of runs of 2 to 5 letters, one multinomial logistic regression a criterion, fitted
by L-BFGS until it converges. The strength of regularisation is chosen on writers of the training split that the fit has
not met; with it the reader is fitted on the whole split.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from chauffeur.concept import MissingExtraError
from chauffeur.models.vilad.phrases import Split

COMMANDS: Final = 100_000
"""The networks meet 70,000 to 380,000 fresh commands; the paper's data sets have 3,000."""
_FITTED, _TUNING = 3_000, 2_000
"""Commands that a fit meets while the regularisation is chosen, and commands of the other writers that decide it."""
_INVERSE_STRENGTHS: Final = (10.0, 100.0, 1_000.0, 10_000.0)
"""C of `LogisticRegression`: the inverse of the weight of the L2 penalty."""
_WORD: Final = r"[\w']+"
_ITERATIONS: Final = 3_000
"""At most; fits take some 50, and one that is cut off warns."""


class AskedCommand(Protocol):
    """A command and what it asks for."""

    @property
    def text(self) -> str: ...
    @property
    def asked(self) -> Mapping[str, str]: ...


class LearnableTask(Protocol):
    """A task as its baseline learns it."""

    @property
    def criteria(self) -> Sequence[str]:
        """Slots that say what was understood."""
        ...

    def command(self, rng: np.random.Generator, split: Split = "train") -> AskedCommand:
        """A command of a split."""
        ...


@dataclass(frozen=True, slots=True)
class LinearReader:
    """A fitted reader.

    Attributes:
        vectors: Fitted TF-IDF vectoriser.
        models: A fitted classifier a criterion; the value itself where training has only one.
        inverse_strength: The C that was chosen.
    """

    vectors: Any
    models: Mapping[str, Any]
    inverse_strength: float

    def read(self, texts: Sequence[str]) -> list[dict[str, str]]:
        """Wishes of each text, by criterion."""
        table = self.vectors.transform(texts)
        columns = {
            name: [model] * len(texts) if isinstance(model, str) else model.predict(table)
            for name, model in self.models.items()
        }
        return [{name: str(column[row]) for name, column in columns.items()} for row in range(len(texts))]

    def __call__(self, text: str) -> dict[str, str]:
        """Wishes of a text, by criterion."""
        return self.read([text])[0]


def linear_reader(
    task: LearnableTask, seed: int, commands: int = COMMANDS, told: Callable[[int, int], None] | None = None
) -> LinearReader:
    """A reader trained on commands of the training split, its regularisation chosen on writers held out of that split.

    Args:
        task: What is learned.
        seed: Of the commands.
        commands: How many.
        told: Is told (fits done, of how many).

    Raises:
        DataError: The bank of phrases cannot be read.
        MissingExtraError: scikit-learn is not installed.
    """

    def drawn(stream: int, count: int, split: Split) -> list[AskedCommand]:
        rng = np.random.default_rng([seed, stream])
        return [task.command(rng, split) for _ in range(count)]

    fit, tune = drawn(12, min(commands, _FITTED), "fit"), drawn(13, min(commands, _TUNING), "tune")
    fits, texts = len(_INVERSE_STRENGTHS) + 1, [one.text for one in tune]
    understood: dict[float, float] = {}
    for done, strength in enumerate(_INVERSE_STRENGTHS, start=1):
        read = _fitted(task.criteria, fit, strength).read(texts)
        understood[strength] = float(np.mean([own == dict(one.asked) for own, one in zip(read, tune, strict=True)]))
        if told is not None:
            told(done, fits)
    chosen = max(understood, key=lambda strength: understood[strength])
    found = _fitted(task.criteria, drawn(11, commands, "train"), chosen)
    if told is not None:
        told(fits, fits)
    return found


def _fitted(criteria: Sequence[str], found: Sequence[AskedCommand], strength: float) -> LinearReader:
    try:
        from sklearn.feature_extraction.text import TfidfVectorizer
        from sklearn.linear_model import LogisticRegression
        from sklearn.pipeline import make_union
        from threadpoolctl import threadpool_limits
    except ImportError as error:
        raise MissingExtraError("The linear baseline needs scikit-learn.", extra="models") from error
    vectors = make_union(
        TfidfVectorizer(ngram_range=(1, 2), sublinear_tf=True, token_pattern=_WORD),
        TfidfVectorizer(analyzer="char_wb", ngram_range=(2, 5), sublinear_tf=True),
    )
    table = vectors.fit_transform([one.text for one in found])
    models: dict[str, Any] = {}
    for name in criteria:
        values = [one.asked[name] for one in found]
        if len(set(values)) == 1:
            models[name] = values[0]
        else:
            with threadpool_limits(1):  # the work is sparse: threads of a dense library would only wait for each other
                models[name] = LogisticRegression(C=strength, max_iter=_ITERATIONS).fit(table, values)
    return LinearReader(vectors, models, strength)
