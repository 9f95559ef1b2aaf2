"""IDM and MOBIL against the origin's own outcomes, sample by sample (golden file of the recorded peer).

Here every 14th sample is driven; `benchmarks/lampilot_parity.py` drives all of them.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

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


@pytest.mark.slow
@pytest.mark.parametrize("baseline", ["idm", "mobil"])
@pytest.mark.parametrize("part", range(4))
def test_baseline_outcomes_equal_the_origins(lampilot_data: Path, baseline: str, part: int) -> None:
    dataset = load_dataset(lampilot_data / "DbLv1-dev")
    golden = json.loads((lampilot_data / "peer_baselines_dev.json").read_text())
    expected = {f"{row['file'].removesuffix('.json')}_{row['seed']}": row[baseline] for row in golden}
    samples = [(task.name, s) for task in dataset.tasks for s in task.samples]
    for name, scenario in samples[part * 14 :: 56]:
        row = roll_out(RolloutJob("", scenario, baseline, None, LAMPILOT_LIMITS))
        row |= points(row, "origin")
        peer = expected[f"{name}_{scenario.seed}"]
        assert (row["success"], row["collision"], row["steps"]) == (peer["success"], peer["collision"], peer["steps"])
        for theirs, ours in COLUMNS.items():
            assert row[ours] == pytest.approx(peer[theirs], abs=1e-6), (scenario.id, theirs)
