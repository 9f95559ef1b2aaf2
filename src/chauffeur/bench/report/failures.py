"""Which failures are worth showing, and everything that explains them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.report import families_in
from chauffeur.bench.report.model import Failure, Gallery
from chauffeur.bench.report.redrive import KeptDrive, drive_again
from chauffeur.bench.report.runs import NOTHING_DRIVEN, Run, item_key
from chauffeur.bench.report.sentences import PERIOD_S, ending_words, goal_words, happened
from chauffeur.bench.report.tables import name_with_labels
from chauffeur.concept import Program, Scenario

PICKED = 12
"""Failures shown of a run, unless told otherwise."""

_RANK = ("collision", "off_road", "failure", "timeout", "refused", "not_driven")

Tell = Callable[[int, int], None]
"""Called as (failures done, of how many)."""


def failed(row: Row) -> bool:
    """Whether an item is a failure: not completed, or with a collision."""
    return not row["success"] or bool(row["collision"])


def choose_failures(rows: Sequence[Row], limit: int) -> list[Row]:
    """Up to `limit` failures: the families in turn, and within a family one of every kind, task and scene before a
    second of any; the worst kinds first, failures of the machine last. The same rows give the same choice."""
    waiting = {
        family: [(place, row) for place, row in enumerate(rows) if row["family"] == family and failed(row)]
        for family in families_in(rows)
    }
    seen: Counter[tuple[str, str]] = Counter()

    def weight(entry: tuple[int, Row]) -> tuple[int, ...]:
        place, row = entry
        return (
            seen["sample", str(row["sample"])],
            int(bool(row["infra_failed"])),
            seen["kind", _kind(row)],
            seen["task", str(row["task"])],
            _RANK.index(str(row["outcome"])) if row["outcome"] in _RANK else len(_RANK),
            place,
        )

    chosen: list[Row] = []
    while len(chosen) < limit and any(waiting.values()):
        for family, entries in waiting.items():
            if not entries or len(chosen) >= limit:
                continue
            best = min(entries, key=weight)
            entries.remove(best)
            chosen.append(best[1])
            seen.update([("sample", str(best[1]["sample"])), ("kind", _kind(best[1])), ("task", str(best[1]["task"]))])
            waiting[family] = entries
    return chosen


def _kind(row: Row) -> str:
    return f"{row['family']} {row['outcome']} {row['policy_failed']} {row['infra_failed']}"


def make_gallery(run: Run, others: Sequence[Run], scenes: Mapping[str, Scenario], limit: int, tell: Tell) -> Gallery:
    """The gallery of a run; the drives are driven again.

    Args:
        run: Whose failures.
        others: Runs to compare the same items with.
        scenes: Scenes by sample; a drive whose scene is not among them is left out, and that is said.
        limit: Failures at most.
        tell: Called after each.

    Raises:
        DataError: A stage file of the run cannot be read.
    """
    chosen = choose_failures(run.rows, limit)
    kept = KeptDrive(run)
    commands = Counter(str(row["sample"]) for row in run.rows)
    failures = Counter(str(row["sample"]) for row in run.rows if failed(row))
    found: list[Failure] = []
    for row in chosen:
        sample = str(row["sample"])
        siblings = ""
        if commands[sample] > 1:
            siblings = f"{failures[sample]} of this scene's {commands[sample]} commands failed."
        found.append(_failure(run, row, siblings, _elsewhere(run, row, others), scenes, kept))
        tell(len(found), len(chosen))
    return Gallery(run.name, run.labels, sum(failures.values()), len(run.rows), tuple(found))


def _failure(
    run: Run,
    row: Row,
    siblings: str,
    elsewhere: tuple[tuple[str, str], ...],
    scenes: Mapping[str, Scenario],
    kept: KeptDrive,
) -> Failure:
    scenario = scenes.get(str(row["sample"]))
    if scenario is None:
        drive, note = None, "Nothing was driven." if row["outcome"] in NOTHING_DRIVEN else "The run kept no scenes."
    else:
        drive, note = drive_again(row, scenario, kept)
    plan = kept.plan(row)
    context = kept.context(row) or (drive.trip.context if drive is not None else None)
    return Failure(
        run=run.name,
        labels=run.labels,
        item=str(row["item"]),
        sample=str(row["sample"]),
        family=str(row["family"]),
        scenario_seed=str(row["scenario_seed"]),
        command=str(row["command"]),
        goal="" if scenario is None else goal_words(scenario.goal),
        outcome=str(row["outcome"]),
        happened=happened(row),
        facts=_facts(row),
        siblings=siblings,
        elsewhere=elsewhere,
        context=context,
        thoughts="" if plan is None else plan.thoughts.text,
        program=plan.policy if plan is not None and isinstance(plan.policy, Program) else None,
        verdicts=kept.verdicts(row),
        drive=drive,
        drive_note=note,
    )


def _facts(row: Row) -> tuple[tuple[str, str], ...]:
    facts = [("family", str(row["family"])), ("item", str(row["item"])), ("scene seed", str(row["scenario_seed"]))]
    if row.get("intent"):
        facts.append(("understood as", str(row["intent"])))
    if row.get("steps"):
        facts.append(("drive", f"{row['steps'] * PERIOD_S:.1f} s"))
    if row.get("lane_ttc_s") is not None:
        facts.append(("least lane-aware TTC", f"{float(row['lane_ttc_s']):.1f} s"))
    return tuple((name, value) for name, value in facts if value)


def _elsewhere(run: Run, row: Row, others: Sequence[Run]) -> tuple[tuple[str, str], ...]:
    """How other runs fared with the same item."""
    found: list[tuple[str, str]] = []
    for other in others:
        if other.folder == run.folder:
            continue
        same_data = other.data_sha256 == run.data_sha256
        key = item_key(row, same_data=same_data)
        match = next((r for r in other.rows if item_key(r, same_data=same_data) == key), None)
        if match is not None:
            found.append((name_with_labels(other), ending_words(match)))
    return tuple(found)
