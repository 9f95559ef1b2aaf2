"""LaMPilot-Bench runs as the Markdown of RESULTS.md.

    python benchmarks/lampilot_table.py runs/lampilot-onboard runs/lampilot-idm ...

Each argument is a finished run folder of `chauffeur bench lampilot`; the first one is also shown by task family.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.lampilot.report import comparison_lines, family_lines


def _rows(folder: Path) -> list[dict[str, Any]]:
    lines = (folder / "results.jsonl").read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines if line]


def main() -> None:
    folders = [Path(name) for name in sys.argv[1:]]
    if not folders:
        sys.exit(__doc__)
    runs = [(str(_rows(folder)[0]["planner"]), _rows(folder)) for folder in folders]
    facts = json.loads((folders[0] / "provenance.json").read_text(encoding="utf-8"))
    config = facts["config"]
    print(markdown(*comparison_lines(*runs[0], *runs[1:])))
    print(f"\n### {runs[0][0]} by task family\n")
    print(markdown(*family_lines(runs[0][1])))
    versions = ", ".join(f"{name} {number}" for name, number in facts["versions"].items())
    models = {row["model"] for _, rows in runs for row in rows if row["model"]}
    print(
        f"\n{facts['bench']}, {facts['rollout']}; data sha256 `{config['data_sha256'][:16]}`; scenario seeds as in the "
        f"data; draw seed {config['seed']}; limits `{config['limits']['name']}`; models {', '.join(sorted(models))}; "
        f"{versions}; Python {facts['python']}; {facts['machine']}."
    )


if __name__ == "__main__":
    main()
