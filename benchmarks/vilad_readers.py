"""What reads the words of ViLaD's tasks, with the exact solver behind each: the network, simple readers, and none.

    python benchmarks/vilad_readers.py                 # the models that ship, 300 commands a split
    python benchmarks/vilad_readers.py --seed 77       # other commands and scenes

Success is judged by the solver that stands behind every row, so rows differ in how words are read and in nothing else.
The first row reads nothing: it is what a scene gives away. Some four CPU minutes; the extra is `chauffeur-lab[models]`.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from chauffeur.bench.kernel.report import markdown
from chauffeur.models.vilad.baseline import COMMANDS, linear_reader
from chauffeur.models.vilad.evaluation import figures, solved
from chauffeur.models.vilad.phrases import TESTS
from chauffeur.models.vilad.pipeline import MODELS, TEST_COMMANDS, TEST_SEED, ViladModel
from chauffeur.planners.vilad import driving, parking
from chauffeur.planners.vilad.engine import SHIPPED, ViladEngine

FOLDERS = {"vilad-parking": (SHIPPED, parking.NOTHING), "vilad-drive": (SHIPPED / "drive", driving.NOTHING)}
PAPERS = 3_000
"""Commands that the paper's data sets have."""


def table(model: ViladModel, name: str, count: int, seed: int) -> str:
    folder, nothing = FOLDERS[name]
    engine = ViladEngine(folder)
    cases = {split: model.cases(split, count, seed) for split in TESTS}
    network = {split: figures(engine, found, model.how, model.task.criteria) for split, found in cases.items()}
    readers = {
        f"linear reader, {many:,} commands": linear_reader(model.task, TEST_SEED + 1, many)
        for many in (PAPERS, COMMANDS)
    }

    def unread(text: str) -> Mapping[str, str]:
        del text
        return nothing

    rows = {
        "no words read": [solved(unread, cases[split])[0] for split in TESTS],
        **{who: [solved(read, cases[split])[0] for split in TESTS] for who, read in readers.items()},
        "network, pointers and waypoints unused": [network[split].solved for split in TESTS],
        "network, as driven": [network[split].verified for split in TESTS],
        "network alone, no solver": [network[split].success for split in TESTS],
    }
    cells = [(who, *(f"{value:.1f}" for value in values)) for who, values in rows.items()]
    return markdown(("success, %", *TESTS), cells)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=TEST_COMMANDS, help="commands a split")
    parser.add_argument("--seed", type=int, default=TEST_SEED, help="of commands and scenes")
    parser.add_argument("--model", choices=list(MODELS), action="append", help="only this one; may come again")
    given = parser.parse_args()
    for name in given.model or MODELS:
        model = MODELS[name]()
        print(f"\n{name}, {given.count} commands a split, seed {given.seed}\n")
        print(table(model, name, given.count, given.seed), flush=True)


if __name__ == "__main__":
    main()
