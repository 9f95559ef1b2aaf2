"""How much of what the on-board model is judged by stands in its training data.

    python benchmarks/onboard_overlap.py --run runs/onboard --data DbLv1

A sentence counts as known when it occurs in training word for word, or with other numbers and politeness (`masked`). No
grammar template was taken from either set; plain wishes ("turn left") are nevertheless said by everybody.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from chauffeur.bench.passengers import load_wishes
from chauffeur.models.onboard.engine import masked
from chauffeur.worlds.highway.dblv1 import load_dataset


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", type=Path, required=True, help="Folder of `chauffeur model train onboard`.")
    parser.add_argument("--data", type=Path, required=True, help="LaMPilot's DbLv1 folder.")
    arguments = parser.parse_args()
    with (arguments.run / "data" / "train.jsonl").open(encoding="utf-8") as file:
        said = {str(json.loads(line)["wish"]) for line in file}
    known = {_words(wish) for wish in said}
    alike = {masked(wish) for wish in said}
    commands = sorted({command for task in load_dataset(arguments.data).tasks for command in task.commands})
    wishes = [wish.wish for wish in load_wishes()]
    print("| set | sentences | word for word in training | with other numbers and politeness |")
    print("|---|---:|---:|---:|")
    for name, sentences in (("LaMPilot's development commands", commands), ("passengers' wishes", wishes)):
        same = sum(_words(sentence) in known for sentence in sentences)
        near = sum(masked(sentence) in alike for sentence in sentences)
        print(f"| {name} | {len(sentences)} | {same} | {near} |")


def _words(sentence: str) -> str:
    return " ".join("".join(c if c.isalnum() else " " for c in sentence.lower()).split())


if __name__ == "__main__":
    main()
