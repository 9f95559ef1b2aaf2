"""Every column a report can have, with the legend that explains it to a reader who knows nothing of the benchmark."""

from __future__ import annotations

from chauffeur.bench.lampilot.metrics import Ruler
from chauffeur.bench.report.model import Column

ITEMS = Column("items", "Items", meaning="How many items (one scene with one command) the figures are over.")

SCORE_KEYS = ("collision", "completion", "ttc", "speed_variance", "time_efficiency", "driving_score")
"""The columns of the paper's Tab. IV, in its order."""

_COLLISION = {
    True: "Share of all planned items in which the car crashed or left the road (the end of the road included).",
    False: "Share of all planned items in which the car crashed. Leaving the road does not count here.",
}
_COMPLETION = {
    False: "Share of all planned items in which the car did what the command asked, by the benchmark's own condition.",
    True: "Share of all planned items in which the car did what the command asked, by the benchmark's own condition, "
    "within 60 s and without a crash.",
}


def score_columns(ruler: Ruler) -> tuple[Column, ...]:
    """The columns of the paper's Tab. IV, as a ruler fills them."""
    penalty = ""
    if ruler.collision_weight:
        penalty = f", less {ruler.collision_weight / 100:g} points for each per cent of collisions. It can be negative"
    floor = "" if ruler.floored else " It can be negative."
    return (
        Column("collision", "Collision", "%", "lower", _COLLISION[ruler.off_road_collides], 2, (0.0, 0.0)),
        Column("completion", "Completion", "%", "higher", _COMPLETION[ruler.within_limit], 1, (0.0, 100.0)),
        Column(
            "ttc",
            "TTC",
            "points",
            "higher",
            "Time to collision: 100 when the car never came within 2 s of meeting another vehicle, less the closer it "
            f"came. Mean over completed items.{floor}",
            1,
            (0.0, 100.0),
        ),
        Column(
            "speed_variance",
            "SV",
            "points",
            "higher",
            f"Speed variance: 100 for a constant speed, less the more it varied. Mean over completed items.{floor}",
            1,
            (0.0, 100.0),
        ),
        Column(
            "time_efficiency",
            "TE",
            "points",
            "higher",
            f"Time efficiency: 100 for done at once, 0 for done after 60 s. Mean over completed items.{floor}",
            1,
            (0.0, 100.0),
        ),
        Column(
            "driving_score",
            "Driving score",
            "points",
            "higher",
            "The whole in one number: completion times the mean score of completed items (half TTC, three tenths SV, "
            f"a fifth TE){penalty}.",
            1,
            (0.0, 100.0),
        ),
    )


LANE_TTC = Column(
    "lane_ttc",
    "Lane-aware TTC, median",
    "s",
    "higher",
    "Least time to collision of a drive, bumper to bumper, with vehicles in or entering the car's own lane only; the "
    "median over drives that had such a conflict at all.",
    1,
)
LANE_TTC_CLOSE = Column(
    "lane_ttc_close",
    "Lane-aware TTC under 2 s",
    "%",
    "lower",
    "Share of the drives in which that time fell below 2 s.",
    1,
    (0.0, 0.0),
)
STOP = Column(
    "stop",
    "Stopped at the sign",
    "%",
    "higher",
    "Of the drives that passed a stop sign, the share that slowed to less than 1 m/s at it, which is the origin's own "
    "bound for a stop. Its conditions never check it.",
    1,
    (0.0, 100.0),
)
FAULT_EGO = Column("ego", "Own fault", better="lower", meaning="Collisions that the car itself caused.")
FAULT_STRUCK = Column(
    "struck", "Struck", better="lower", meaning="Collisions in which another vehicle ran into the car."
)
FAULT_ROAD_END = Column(
    "road_end",
    "Road end",
    better="lower",
    meaning="Drove off the end of the road; the origin counts it as a collision.",
)
BESIDE = (LANE_TTC, LANE_TTC_CLOSE, STOP, FAULT_EGO, FAULT_STRUCK, FAULT_ROAD_END)
"""What the benchmark does not score and a reader should know."""

OUTCOMES = (
    Column("success", "Done as asked", meaning="The condition of the command was met."),
    Column("failure", "Not done", meaning="The condition was judged not met, e.g. not within 60 s."),
    Column("timeout", "Out of time or road", meaning="Time or road ran out before the condition was met."),
    Column("collision", "Crashed", meaning="The drive ended in a crash."),
    Column("off_road", "Left the road", meaning="The drive ended beside the road, or beyond its end."),
    Column("refused", "Refused", meaning="The planner or the checks declined the command; nothing was driven."),
    Column("not_driven", "Not driven", meaning="No plan could be had, or the scene could not be set up."),
)
CAUSES = (
    Column(
        "policy_failed",
        "Program failed",
        better="lower",
        meaning="The program was rejected by the checks, or died while it ran; it may have been driven up to there.",
    ),
    Column(
        "infra_failed",
        "Machine failed",
        better="lower",
        meaning="Endpoint, sandbox or machine failed. It says nothing about the planner; the item still counts as not "
        "completed.",
    ),
    Column(
        "fallback_used",
        "Autopilot took over",
        better="lower",
        meaning="The program was gone before the end and the autopilot brought the car to a safe state.",
    ),
)

LATENCY = (
    Column("p50", "Latency, median", "", "lower", "From the words to the plan, per item: half are faster."),
    Column("p95", "Latency, p95", "", "lower", "95 of 100 items are faster."),
    Column("prompt", "Tokens in", "per item", "lower", "Mean number of tokens sent to the language model.", 0),
    Column("completion", "Tokens out", "per item", "lower", "Mean number of tokens the language model wrote.", 0),
    Column("usd", "Cost", "USD", "lower", "Price of all calls, where the price list is known.", 4),
    Column("usd_k", "Cost per 1,000 items", "USD", "lower", "The same, for a thousand items.", 2),
)

PAIRS = (
    Column("both", "Both", meaning="Items that both runs completed."),
    Column("only_first", "Only A", meaning="Items that the first run completed and the second did not."),
    Column("only_second", "Only B", meaning="Items that the second run completed and the first did not."),
    Column("neither", "Neither", meaning="Items that neither run completed."),
    Column(
        "mcnemar",
        "McNemar p",
        meaning="Chance of flips at least this uneven if both were equally good (exact, two-sided). It takes every "
        "item for an observation of its own, which commands of one scene are not: read it with the next one.",
    ),
    Column(
        "by_scene",
        "p by scene",
        meaning="The same with one vote a scene: which run completed more of its commands. Fewer votes, no "
        "double counting.",
    ),
    Column(
        "completion",
        "Completion",
        "% points, B − A",
        "",
        "Difference of the completion rates; above 0, B is better.",
        1,
        (0.0, 0.0),
    ),
    Column(
        "collision",
        "Collision",
        "% points, B − A",
        "",
        "Difference of the collision rates; below 0, B is better.",
        2,
        (0.0, 0.0),
    ),
    Column(
        "driving_score",
        "Driving score",
        "points, B − A",
        "",
        "Difference of the driving scores; above 0, B is better. An interval that holds 0 leaves it open.",
        1,
        (0.0, 0.0),
    ),
)
