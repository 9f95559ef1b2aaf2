"""How the figures were made: definitions of the measures under each ruler, and where every run comes from."""

from __future__ import annotations

from typing import Any, cast

from chauffeur.bench.kernel.stats import LEVEL
from chauffeur.bench.lampilot.metrics import ORIGIN, ruler_named
from chauffeur.bench.report.runs import Run
from chauffeur.bench.report.tables import RowSampling

_ORIGIN: tuple[tuple[str, str], ...] = (
    (
        "TTC points",
        "At every 0.1 s, the centre distance to each other vehicle, in every lane and at any lateral distance, along "
        "the car's own lane, over the closing speed; the least positive value t of the drive gives 100 when t > 2 s, "
        "else 100 - 1/t, not below -100. As the origin's code computes it: a vehicle that is merely passed two lanes "
        "away counts.",
    ),
    ("SV points", "100 (1 - standard deviation of the speed / 10 m/s); not floored."),
    ("TE points", "100 (1 - duration / 60 s); not floored."),
    ("Score of an item", "0.5 TTC + 0.3 SV + 0.2 TE, not below 0; 0 when not completed."),
    (
        "Driving score",
        "Completion rate x mean score of completed items - 500 x collision rate (rates in 0..1), as the origin's code "
        "aggregates.",
    ),
    ("Collision", "The car crashed, or its centre left every lane; the end of a road counts."),
)
_PAPER: tuple[tuple[str, str], ...] = (
    (
        "TTC points",
        "Eq. 1-3 as printed: for each other vehicle -(p0 - pi).(v0 - vi) / |v0 - vi|^2 in the plane; the least "
        "positive value t of the drive gives 100 when t > 2 s, else 100 - 1/t, not below 0.",
    ),
    (
        "SV points",
        "Eq. 4-6: 100 (1 - standard deviation of the speed / 10 m/s), not below 0. The 10 m/s are the origin's; the "
        "paper names none.",
    ),
    ("TE points", "Eq. 7: 100 (1 - duration / 60 s), not below 0. The 60 s are the origin's; the paper names none."),
    (
        "Score of an item",
        "Eq. 8: 0.5 TTC + 0.3 SV + 0.2 TE; 0 when not completed. Completed means: within 60 s and without a crash.",
    ),
    ("Driving score", "Mean score over all items, those not completed counting 0. The paper prints no aggregate."),
    ("Collision", "The car crashed. Leaving the road is no collision."),
)


def terms(ruler: str, how: RowSampling) -> tuple[tuple[str, str], ...]:
    """(term, definition) of every measure under a ruler, and of intervals and tests."""
    return (
        ("Ruler", f"{ruler}: {ruler_named(ruler).title}. Every table of this report is under this one."),
        ("Item", "One scene (road, traffic seed, success condition) with one command. Paraphrases share a scene."),
        *(_ORIGIN if ruler == ORIGIN.id else _PAPER),
        (
            "Intervals",
            f"{100 * LEVEL:.0f} % percentile bootstrap, {how.draws:,} resamples, seed {how.seed}. Whole scenes are "
            "resampled, with all their commands, because commands of one scene share its traffic and are no "
            "independent observations. They speak of other scenes like these, not of other traffic models or real "
            "roads. A run that never crashed has resamples that never crash, so the interval of its driving score does "
            "not hold the chance of a crash that was not seen.",
        ),
        (
            "Paired comparison",
            "Items that both runs have. McNemar's exact test over items, a sign test over scenes, and differences "
            "resampled by scene with the same resamples for both runs.",
        ),
        (
            "Denominators",
            "Every rate is over all planned items. Refusals, failed programs and failures of the machine stay in it.",
        ),
        (
            "Drives in the gallery",
            "Driven again from the stored program and seed while this report was made; a drive that ended differently "
            "from the recorded one says so.",
        ),
    )


def facts(run: Run, planned: int) -> tuple[tuple[str, str], ...]:
    """Where a run's figures come from, as (name, value); what is not known is left out."""
    row, config, known = run.rows[0], run.config, run.provenance
    found: list[tuple[str, Any]] = [
        ("run folder", run.folder.resolve().name),
        ("labels", "; ".join(run.labels)),
        ("planner", row.get("planner")),
        ("model", row.get("model") or known.get("model")),
        ("items", f"{planned:,}"),
        ("draw seed", config.get("seed")),
        ("scenario seeds", "as in the data"),
        *((name.replace("_", " "), _words(value)) for name, value in config.items() if name not in _TOLD),
        ("ruler", run.ruler),
        ("benchmark", known.get("bench") or run.plan.get("bench")),
        ("rollout", known.get("rollout") or row.get("rollout")),
        ("data sha256", row.get("data_sha256")),
        ("made with chauffeur", row.get("chauffeur")),
        *(
            (f"version of {name}", value)
            for name, value in _mapping(known.get("versions")).items()
            if name != "chauffeur"
        ),
        ("python", known.get("python")),
        ("machine", known.get("machine")),
    ]
    return tuple((name, str(value)) for name, value in found if value not in (None, ""))


_TOLD = ("planner", "data_sha256", "items", "seed")


def _words(value: Any) -> str:
    if isinstance(value, dict):
        named = ((name.replace("_", " "), item) for name, item in _mapping(value).items() if item is not None)
        return ", ".join(item if isinstance(item, str) else f"{name} {item}" for name, item in named)
    if isinstance(value, list):
        return ", ".join(str(item) for item in cast("list[Any]", value))
    return "" if value is None else str(value)


def _mapping(value: Any) -> dict[str, Any]:
    return cast("dict[str, Any]", value) if isinstance(value, dict) else {}
