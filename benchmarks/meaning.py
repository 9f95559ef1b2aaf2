"""How well words are read: labelled commands of real passengers, none of which any training saw.

    python benchmarks/meaning.py --commands FOLDER

FOLDER holds `*_dev.jsonl` (commands with labels) and `score.py`, the labels' own scorer, which judges. Printed are its
figures and the time a command, for the parser and for two readers beside it: `nearest` answers with the meaning of the
most similar of 200,000 composed sentences (TF-IDF of words and of letters), trained on what the parser is trained on;
`blind` says "turn" to everything, the commonest act that is composed.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from sklearn.feature_extraction.text import TfidfVectorizer
from sklearn.pipeline import make_union

from chauffeur.concept.utterance import Act, acts_to_json
from chauffeur.language.meaning.reader import read
from chauffeur.models.meaning.banks import banks
from chauffeur.models.meaning.composer import Composer
from chauffeur.models.meaning.noise import with_noise

SENTENCES: Final = 200_000
SEED: Final = 11


def parsed(text: str) -> tuple[Act, ...]:
    """As the parser reads it."""
    return read(text).acts


def nearest() -> Callable[[str], tuple[Act, ...]]:
    """A reader that answers with the meaning of the most similar composed sentence."""
    rng = np.random.default_rng(SEED)
    composers = [Composer(bank, rng) for bank in banks()]
    composed = [with_noise(composers[i % len(composers)].sentence(), rng) for i in range(SENTENCES)]
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
    for gold in sorted(folder.glob("*_dev.jsonl")):
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


def scored(scorer: Path, gold: Path, found: list[dict[str, Any]]) -> str:
    """What the labels' own scorer says of some readings."""
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as file:
        file.write("".join(json.dumps(one) + "\n" for one in found))
        file.flush()
        told = subprocess.run(
            [sys.executable, str(scorer), str(gold), file.name], capture_output=True, text=True, check=True
        )
    return told.stdout


if __name__ == "__main__":
    main()
