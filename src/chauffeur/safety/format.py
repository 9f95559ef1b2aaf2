"""`format-v1`: the plan holds a policy of a known form. The first of the papers' two safety checks (Sec. V-A4)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from typing import Final

from chauffeur.concept import ActionMatrix, Limits, Observation, Parameters, Plan, Program, Trajectory, Verdict
from chauffeur.concept.registry import load_plugin, plugin_names

FORMAT_CHECK = "format-v1"
EXECUTORS: Final = "chauffeur.executors"
"""Entry points of executors for kinds of policies beside the built-in ones."""

MOST_ROUTE_CHARS: Final = 40
"""Of the name of a place that parameters lead to."""


def check_format(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
    """Judge whether the policy is present, of a known kind, accepted by the static gate, and made of finite numbers."""
    match plan.policy:
        case None if plan.refusal:  # asked back, answered or declined: nothing is to be driven
            return Verdict(FORMAT_CHECK, True, "There is no policy to check.", not_compared="no-policy")
        case None:
            return _fail("The planner gave no policy.", "Say the wish in other words, or ask for less at once.")
        case Program(source=source, library=library):
            return _program(source, library, observation.kind)
        case Parameters() as values:
            if values.lane not in (-1, 0, 1):
                return _fail(f"The lane wish is {values.lane!r}.", "Give -1 (left), 0 (stay) or 1 (right).")
            if len(values.route) > MOST_ROUTE_CHARS:
                return _fail("The route is no name of a place.", "Give a turn or a place of the lot.")
            return _finite(
                "parameters",
                (
                    ("target_speed_mps", values.target_speed_mps),
                    ("look_ahead_m", values.look_ahead_m),
                    ("look_ahead_ratio", values.look_ahead_ratio),
                ),
            )
        case ActionMatrix(pid=pid, mpc=mpc):
            if (len(pid), len(mpc)) != (3, 3):
                return _fail(
                    f"The action matrix has rows of {len(pid)} and {len(mpc)} numbers.",
                    "Give [[Kp, Ki, Kd], [Wl, Wh, Ws]]: two rows of three numbers.",
                )
            return _finite("action matrix", zip(("Kp", "Ki", "Kd", "Wl", "Wh", "Ws"), (*pid, *mpc), strict=True))
        case Trajectory() as trajectory:
            return check_trajectory_format(trajectory)
        case other:  # pyright: ignore[reportUnnecessaryComparison] - planners are third-party code
            return _of_another_kind(other, observation, limits)


def _of_another_kind(policy: object, observation: Observation, limits: Limits) -> Verdict:
    """A policy of a third party's kind is judged by its executor: `fault(policy, observation, limits)`, in words, empty
    for none. One that is registered without is not driven: nobody has vouched for it."""
    kind = str(getattr(policy, "kind", ""))
    if kind not in plugin_names(EXECUTORS):
        return _fail(
            f"The policy is a {type(policy).__name__}, which no executor knows.",
            "Give a program, parameters, an action matrix or a trajectory.",
        )
    judge: Callable[[object, Observation, Limits], str] | None
    judge = getattr(load_plugin(EXECUTORS, kind), "fault", None)
    if judge is None:
        return _fail(f"The executor of the kind {kind!r} has no `fault`.", "Have it say what is wrong with a policy.")
    found = judge(policy, observation, limits)
    return _fail(found, "Ask again, in other words.") if found else _pass(f"Its executor finds no fault in the {kind}.")


def _program(source: str, library: str, kind: str) -> Verdict:
    from chauffeur.programs.catalogue import vocabulary_of
    from chauffeur.programs.gate import check_source

    errors = check_source(source, library, vocabulary_of(kind)).errors
    if errors:
        first, rest = errors[0], len(errors) - 1
        more = f" (and {rest} more finding{'s' if rest > 1 else ''})" if rest else ""
        return Verdict(FORMAT_CHECK, False, first.reason + more, first.line, first.remedy)
    return _pass("The program keeps to the driving language.")


def check_trajectory_format(trajectory: Trajectory) -> Verdict:
    """Judge whether a trajectory is waypoints of two finite numbers, a positive time apart."""
    points = trajectory.waypoints_m
    if not points:
        return _fail("The trajectory has no waypoints.", "Give at least one waypoint.")
    if not (_is_finite(trajectory.period_s) and trajectory.period_s > 0):
        return _fail(
            f"The waypoints are {trajectory.period_s!r} s apart.", "Give a time between waypoints greater than 0 s."
        )
    for index, point in enumerate(points, start=1):
        if len(point) != 2:
            return _fail(f"Waypoint {index} has {len(point)} coordinates.", "Give (x forward, y left) in metres.")
    return _finite(
        "trajectory",
        ((f"waypoint {i} {axis}", v) for i, p in enumerate(points, 1) for axis, v in zip("xy", p, strict=True)),
    )


def _finite(form: str, values: Iterable[tuple[str, object]]) -> Verdict:
    """One verdict over named numbers. `object`, because a reply's JSON may hold anything where a number should be."""
    for name, value in values:
        if not _is_finite(value):
            return _fail(f"{name} of the {form} is {value!r}, not a finite number.", f"Give {name} as a plain number.")
    return _pass(f"All numbers of the {form} are finite.")


def _is_finite(value: object) -> bool:
    """Compared rather than converted: `math.isfinite` raises on integers beyond the float range."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def _pass(reason: str) -> Verdict:
    return Verdict(FORMAT_CHECK, True, reason)


def _fail(reason: str, remedy: str) -> Verdict:
    return Verdict(FORMAT_CHECK, False, reason, None, remedy)
