"""IDM and MOBIL on every development sample against the origin's own recorded outcomes.

    python benchmarks/lampilot_parity.py --data DIR   # DIR holds DbLv1-dev and peer_baselines_dev.json

Prints, per baseline, how many samples agree in success, collision, number of steps and all scores (to 1e-6).
"""

from __future__ import annotations

import argparse
import json
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from chauffeur.bench.lampilot.rollout import RolloutJob, roll_out
from chauffeur.concept import LAMPILOT_LIMITS
from chauffeur.driving.judge.metrics import points
from chauffeur.worlds.highway.dblv1 import load_dataset

COLUMNS = {
    "overall_score": "score",
    "ttc_score": "ttc",
    "speed_variance_score": "speed_variance",
    "time_efficiency_score": "time_efficiency",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    data = parser.parse_args().data
    dataset = load_dataset(data / "DbLv1-dev")
    rows = json.loads((data / "peer_baselines_dev.json").read_text())
    golden = {f"{row['file'].removesuffix('.json')}_{row['seed']}": row for row in rows}
    samples = {f"{task.name}_{s.seed}": s for task in dataset.tasks for s in task.samples}
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for baseline in ("idm", "mobil"):
            jobs = [RolloutJob(key, s, baseline, None, LAMPILOT_LIMITS) for key, s in samples.items()]
            agree = 0
            for rolled in pool.map(roll_out, jobs, chunksize=4):
                row = rolled | points(rolled, "origin")
                peer = golden[row["key"]][baseline]
                same = all(row[k] == peer[k] for k in ("success", "collision", "steps"))
                same = same and all(abs(row[ours] - peer[theirs]) <= 1e-6 for theirs, ours in COLUMNS.items())
                agree += same
                if not same:
                    print(f"differs: {row['sample']} {baseline}")
            print(f"{baseline}: {agree} of {len(jobs)} samples agree with the origin")


if __name__ == "__main__":
    main()
