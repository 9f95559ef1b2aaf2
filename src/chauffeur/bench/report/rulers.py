"""Which metrics a report is under. Two rulers never stand in one table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.metrics import RULERS, points, ruler_named
from chauffeur.bench.report.runs import NOTHING_DRIVEN, Run
from chauffeur.concept import ConfigError, DataError


def under_one_ruler(runs: Sequence[Run], wanted: str = "") -> tuple[Run, ...]:
    """The runs, all scored by one ruler.

    Args:
        runs: Runs as they were scored.
        wanted: `origin`, `paper` or a ruler's id; empty takes the one that the runs agree on.

    Raises:
        ConfigError: The ruler is unknown, or the runs disagree and none was named.
        DataError: A run must be scored anew and did not keep the signals for it.
    """
    if not wanted:
        found = list(dict.fromkeys(run.ruler for run in runs))
        if len(found) > 1:
            scored = "; ".join(f"{run.name} by {run.ruler}" for run in runs)
            raise ConfigError(
                f"The runs were scored by different rulers ({scored}), and two rulers never stand in one table.",
                hint=f"Score all by one: add --metrics {' or --metrics '.join(RULERS)}.",
            )
        return tuple(runs)
    ruler = ruler_named(wanted).id
    return tuple(run if run.ruler == ruler else _rescored(run, ruler) for run in runs)


def _rescored(run: Run, ruler: str) -> Run:
    rollouts = run.stage("rollout", "key")
    return replace(run, ruler=ruler, rows=tuple(_rescored_row(run, row, rollouts, ruler) for row in run.rows))


def _rescored_row(run: Run, row: Row, rollouts: dict[str, Row], ruler: str) -> Row:
    rollout = rollouts.get(str(row.get("rollout_key", "")))
    if row["outcome"] in NOTHING_DRIVEN:
        return row | {"metrics": ruler}
    if rollout is None or not rollout.get("signals"):
        raise DataError(
            f"{run.folder} kept no signals of {row['item']}, so it cannot be scored by {ruler}.",
            hint="It was made by an earlier version: run the benchmark again in a new folder, "
            f"or report it under its own ruler, {run.ruler}.",
        )
    return row | points(rollout, ruler)
