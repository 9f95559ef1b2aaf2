"""How well words are read: labelled commands of real passengers, none of which any training saw.

    python benchmarks/meaning.py --commands FOLDER

FOLDER holds `*_dev.jsonl` (commands with labels) and `score.py`, the labels' own scorer, which judges; the commands of
`data/realization`, by writers whom no training saw, are scored beside them. Printed are its figures and the time a
command, for the parser and for two readers beside it: `nearest` answers with the meaning of the most similar of 200,000
sentences of training (TF-IDF of words and of letters); `blind` says "turn" to everything, the commonest act that is
composed. Behind them stand the two numbers of the reader's calibration, fitted on all of these commands, and how well
probability and share of right readings agree when each set is left out of the fit.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np
from sklearn.feature_extraction.text import TfidfVectorizer
from sklearn.linear_model import LogisticRegression
from sklearn.pipeline import make_union

from chauffeur.concept.data import data_folder
from chauffeur.concept.utterance import Act, acts_to_json
from chauffeur.language.meaning.reader import SURE_BIAS, SURE_SLOPE, read
from chauffeur.models.meaning.banks import banks
from chauffeur.models.meaning.batches import SentenceSource
from chauffeur.models.meaning.labelled import written
from chauffeur.models.meaning.noise import with_noise

SENTENCES: Final = 200_000
SEED: Final = 11


def parsed(text: str) -> tuple[Act, ...]:
    """As the parser reads it."""
    return read(text).acts


def nearest() -> Callable[[str], tuple[Act, ...]]:
    """A reader that answers with the meaning of the most similar composed sentence."""
    rng = np.random.default_rng(SEED)
    source = SentenceSource(banks(), written(), rng)
    composed = [with_noise(source.draw(), rng) for _ in range(SENTENCES)]
    features = make_union(
        TfidfVectorizer(ngram_range=(1, 2), sublinear_tf=True, min_df=2),
        TfidfVectorizer(analyzer="char_wb", ngram_range=(3, 4), sublinear_tf=True, min_df=5),
    )
    table = features.fit_transform([one.text for one in composed]).T.tocsc()

    def answer(text: str) -> tuple[Act, ...]:
        scores = features.transform([text]) @ table
        best = composed[int(np.asarray(scores.todense()).argmax())]
        return tuple(one.act for one in best.acts)

    return answer


def blind(text: str) -> tuple[Act, ...]:
    """The same for every text."""
    del text
    return (Act("turn"),)


def main() -> None:
    """Read, score, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=Path, required=True, help="folder of labelled commands and their scorer")
    folder: Path = parser.parse_args().commands
    readers = {"parser": parsed, "nearest": nearest(), "blind": blind}
    right: dict[str, list[tuple[float, bool]]] = {}
    for gold in (*sorted(folder.glob("*_dev.jsonl")), *sorted(data_folder("realization").glob("*.jsonl"))):
        rows = [json.loads(line) for line in gold.read_text().splitlines()]
        for name, reader in readers.items():
            spent, found = [], []
            for row in rows:
                begun = time.process_time()
                acts = reader(row["text"])
                spent.append(1000.0 * (time.process_time() - begun))
                found.append({"id": row["id"], "acts": acts_to_json(acts)})
            print(f"{gold.stem}, {name} ({len(rows)}): {statistics.median(spent):.1f} ms a command (processor, median)")
            print(scored(folder / "score.py", gold, found))
            if name == "parser":
                wrong = wrong_in(folder / "score.py", gold, found)
                right[gold.stem] = [(log_probability(row["text"]), row["id"] not in wrong) for row in rows]
    calibrate(right)


def log_probability(text: str) -> float:
    """The parser's own, of what it read: the reader's probability taken back through its calibration."""
    sure = min(max(read(text).sure, 1e-12), 1.0 - 1e-12)
    return (math.log(sure / (1.0 - sure)) - SURE_BIAS) / SURE_SLOPE


def calibrate(right: dict[str, list[tuple[float, bool]]]) -> None:
    """Print the logistic map from log-probability to being right, and its error on each set when that is left out."""

    def fitted(sets: Iterable[str]) -> tuple[float, float]:
        points = [point for name in sets for point in right[name]]
        model = LogisticRegression(C=1e6).fit([[value] for value, _ in points], [good for _, good in points])
        return float(model.intercept_[0]), float(model.coef_[0][0])

    for name, points in right.items():
        bias, slope = fitted(other for other in right if other != name)
        sure = [1.0 / (1.0 + math.exp(-(bias + slope * value))) for value, _ in points]
        share = sum(good for _, good in points) / len(points)
        print(f"{name}: mean probability {sum(sure) / len(sure):.2f}, right {share:.2f}")
    bias, slope = fitted(right)
    print(f"calibration: bias {bias:.2f}, slope {slope:.2f}")


def wrong_in(scorer: Path, gold: Path, found: list[dict[str, Any]]) -> set[str]:
    """Ids of commands that the labels' own scorer does not call whole."""
    told = scored(scorer, gold, found, "--worst", str(len(found)))
    ids = {row["id"] for row in found}
    return {word for line in told.splitlines() if (word := line.partition("  ")[0]) in ids}


def scored(scorer: Path, gold: Path, found: list[dict[str, Any]], *options: str) -> str:
    """What the labels' own scorer says of some readings."""
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as file:
        file.write("".join(json.dumps(one) + "\n" for one in found))
        file.flush()
        told = subprocess.run(
            [sys.executable, str(scorer), str(gold), file.name, *options], capture_output=True, text=True, check=True
        )
    return told.stdout


if __name__ == "__main__":
    main()
