"""How well words are read: labelled commands of real passengers, none of which any training saw.

    python benchmarks/meaning.py --commands FOLDER

FOLDER holds `*_dev.jsonl` (commands with labels) and `score.py`, the labels' own scorer, which judges. Printed are its
figures, the time a command, and how sure the readings were: share of right ones by log-probability.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from chauffeur.concept.utterance import acts_to_json
from chauffeur.language.meaning.reader import read


def main() -> None:
    """Read, score, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--commands", type=Path, required=True, help="folder of labelled commands and their scorer")
    folder: Path = parser.parse_args().commands
    for gold in sorted(folder.glob("*_dev.jsonl")):
        rows = [json.loads(line) for line in gold.read_text().splitlines()]
        spent, found = [], []
        for row in rows:
            begun = time.process_time()
            utterance = read(row["text"])
            spent.append(1000.0 * (time.process_time() - begun))
            found.append({"id": row["id"], "acts": acts_to_json(utterance.acts)})
        with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as file:
            file.write("".join(json.dumps(one) + "\n" for one in found))
            file.flush()
            told = subprocess.run(
                [sys.executable, str(folder / "score.py"), str(gold), file.name],
                capture_output=True,
                text=True,
                check=True,
            )
        print(f"{gold.stem} ({len(rows)}): {statistics.median(spent):.1f} ms a command (processor time, median)")
        print(told.stdout)


if __name__ == "__main__":
    main()
