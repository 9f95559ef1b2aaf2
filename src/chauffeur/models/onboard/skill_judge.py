"""Checks of a program against its words, for every skill: the condition under which it becomes training data.

Where LaMPilot has a goal for a skill, that goal decides. Elsewhere the last instant is compared with the first: a
speed, a gap or a lane has moved the right way. Nothing that crashes, leaves the road or fails counts as done.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from chauffeur.bench.lampilot.scenes.feasible import GoalReferee
from chauffeur.concept import Observation, Outcome, Scenario
from chauffeur.concept.nouns import Metric
from chauffeur.driving.episode import drive_program
from chauffeur.driving.judge.goals import make_goal
from chauffeur.planners.onboard.dialect import DialectStep
from chauffeur.planners.onboard.link import Linked
from chauffeur.programs import Sandbox
from chauffeur.worlds.highway import HighwayWorld

HORIZON_S: Final = 20.0
"""Duration of driving a wish without a goal of LaMPilot's."""
GOAL_S: Final = 70.0
SPEED_OFF_MPS: Final = 1.2
SPEED_STEP_MPS: Final = 0.4
"""A change of speed that can be felt."""
GAP_STEP_M: Final = 1.0
BLOCKED_M: Final = 70.0
"""Behind somebody this near one drives as fast as they do."""


@dataclass(frozen=True, slots=True)
class JudgingVerdict:
    """Verdict on a program against its words, and the reason if it failed."""

    done: bool
    why: str = ""


def lampilot_goal(step: DialectStep) -> dict[str, Any] | None:
    """LaMPilot's `eval` mapping for a step; None where it has none."""
    if step.condition is not None or step.wait_s is not None:
        return None
    value = 0.0 if step.number is None else step.number.si
    match step.skill:
        case "drive_at":
            return {"type": "ACCEvalbySpeed", "speed": value}
        case "faster_by" | "slower_by":
            return {"type": "ACCEvalbySpeed", "rel_speed": value if step.skill == "faster_by" else -value}
        case "gap_of":
            return {"type": "ACCEvalbyDistance", "distance": value}
        case "closer_by" | "further_by":
            return {"type": "ACCEvalbyDistance", "rel_distance": value if step.skill == "further_by" else -value}
        case "lane_left" | "lane_right" | "lane_left_patiently" | "lane_right_patiently":
            return {"type": "LaneChangeEval", "direction": step.skill.split("_")[1]}
        case "overtake_left" | "overtake_right":
            return {"type": "OvertakeEval", "direction": step.skill.split("_")[1]}
        case "turn_left" | "turn_right" | "go_straight":
            way = {"turn_left": ("il1", "o1", 0), "turn_right": ("il3", "o3", 0), "go_straight": ("il2", "o2", 0)}
            return {"type": "IntersectionEval", "direction": list(way[step.skill])}
        case "pull_over":
            return {"type": "PullOverEval"}
        case _:
            return None


def judge(
    world: HighwayWorld,
    scenario: Scenario,
    steps: tuple[DialectStep, ...],
    source: str,
    linked: Linked,
    sandbox: Sandbox,
) -> JudgingVerdict:
    """Drive a program on its scene and see what came of it; the world is reset first.

    Raises:
        SandboxError: The sandbox failed; it says nothing about the program.
        ScenarioError: The scene cannot be set up.
    """
    start = world.reset(scenario)
    goal = lampilot_goal(steps[0]) if len(steps) == 1 else None
    if goal is not None:
        referee: Any = GoalReferee(world, make_goal(world.perception(), _with(scenario, goal)))
        episode = drive_program(world, source, referee, GOAL_S, record=False, library=linked.library, sandbox=sandbox)
        return JudgingVerdict(episode.success, "" if episode.success else f"{steps[0].skill}: {episode.outcome}")
    horizon = GOAL_S if any(step.skill.startswith(("turn", "go_", "overtake", "pull")) for step in steps) else HORIZON_S
    episode = drive_program(
        world, source, _Watcher(world), horizon * len(steps), record=False, library=linked.library, sandbox=sandbox
    )
    name = "+".join(step.skill for step in steps)
    if episode.causes.policy_failed:
        return JudgingVerdict(False, f"{name}: {episode.causes.detail[:60]}")
    if episode.outcome in ("collision", "off_road"):
        return JudgingVerdict(False, f"{name}: {episode.outcome}")
    if len(steps) == 1 and steps[0].condition is None:
        test = _EFFECTS.get(steps[0].skill)
        value = 0.0 if steps[0].number is None else steps[0].number.si
        if test is not None and not test(start, episode.final, value):
            return JudgingVerdict(False, f"{name}: no effect")
    return JudgingVerdict(True)


class _Watcher:
    """A referee that ends a trip only where the world does."""

    def __init__(self, world: HighwayWorld) -> None:
        self._road = world.perception()
        self._crashed = False

    def observe(self) -> None:
        self._crashed = self._crashed or self._road.instant().crashed

    @property
    def over(self) -> bool:
        return self._crashed

    @property
    def success(self) -> bool:
        return False

    def outcome(self) -> Outcome:
        return "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        return ()


def _with(scenario: Scenario, goal: dict[str, Any]) -> Scenario:
    from dataclasses import replace

    return replace(scenario, goal=goal)


Effect = Callable[[Observation, Observation, float], bool]


def _blocked(end: Observation) -> bool:
    return (
        end.front is not None
        and end.front.distance_m < BLOCKED_M
        and end.ego.speed_mps < end.front.speed_mps + 2.0 * SPEED_OFF_MPS
    )


def _faster(start: Observation, end: Observation, value: float) -> bool:
    del value
    return end.ego.speed_mps > start.ego.speed_mps + SPEED_STEP_MPS or _blocked(end)


def _slower(start: Observation, end: Observation, value: float) -> bool:
    del value
    return end.ego.speed_mps < start.ego.speed_mps - SPEED_STEP_MPS


def _not_faster(start: Observation, end: Observation, value: float) -> bool:
    del value
    return end.ego.speed_mps < start.ego.speed_mps + SPEED_OFF_MPS


def _not_slower(start: Observation, end: Observation, value: float) -> bool:
    del value
    return end.ego.speed_mps > start.ego.speed_mps - SPEED_OFF_MPS or _blocked(end)


def _held(start: Observation, end: Observation, value: float) -> bool:
    return _not_faster(start, end, value) and _not_slower(start, end, value)


def _at_most(start: Observation, end: Observation, value: float) -> bool:
    del start
    return end.ego.speed_mps <= value + SPEED_OFF_MPS


def _at_least(start: Observation, end: Observation, value: float) -> bool:
    del start
    return end.ego.speed_mps >= value - SPEED_OFF_MPS or _blocked(end)


def _times(start: Observation, end: Observation, value: float) -> bool:
    return abs(end.ego.speed_mps - value * start.ego.speed_mps) < SPEED_OFF_MPS or _blocked(end)


def _gap(observation: Observation) -> float | None:
    return None if observation.front is None else observation.front.distance_m


def _closer(start: Observation, end: Observation, value: float) -> bool:
    del value
    before, after = _gap(start), _gap(end)
    return before is not None and after is not None and after < before - GAP_STEP_M


def _further(start: Observation, end: Observation, value: float) -> bool:
    del value
    before, after = _gap(start), _gap(end)
    return before is None or after is None or after > before + GAP_STEP_M


def _gap_at_least(start: Observation, end: Observation, value: float) -> bool:
    del start
    gap = _gap(end)
    return gap is None or gap > 0.85 * value


def _gap_at_most(start: Observation, end: Observation, value: float) -> bool:
    del start
    gap = _gap(end)
    return gap is not None and gap < 1.2 * value


def _lane_moved(by: int) -> Effect:
    def test(start: Observation, end: Observation, value: float) -> bool:
        steps = by * (round(value) if value else 1)
        if start.ego.lane is None or end.ego.lane is None:
            return False
        return end.road[end.ego.lane].index - start.road[start.ego.lane].index == steps

    return test


def _other_lane(start: Observation, end: Observation, value: float) -> bool:
    del value
    if start.ego.lane is None or end.ego.lane is None:
        return False
    return start.road[start.ego.lane].index != end.road[end.ego.lane].index


def _same_lane(start: Observation, end: Observation, value: float) -> bool:
    return not _other_lane(start, end, value)


def _stopped(start: Observation, end: Observation, value: float) -> bool:
    del start, value
    return end.ego.speed_mps < 0.5


_EFFECTS: Final[dict[str, Effect]] = {
    **dict.fromkeys(("faster", "a_bit_faster", "much_faster"), _faster),
    **dict.fromkeys(("slower", "a_bit_slower", "much_slower"), _slower),
    **dict.fromkeys(("relax", "gently", "carefully", "economically"), _not_faster),
    **dict.fromkeys(("hurry", "sportily"), _not_slower),
    **dict.fromkeys(("closer", "a_bit_closer", "much_closer"), _closer),
    **dict.fromkeys(("further", "a_bit_further", "much_further"), _further),
    **dict.fromkeys(("hold_speed", "carry_on"), _held),
    **dict.fromkeys(("keep_lane", "follow", "no_overtaking", "let_in"), _same_lane),
    **dict.fromkeys(("change_lane", "leftmost_lane", "rightmost_lane", "middle_lane"), _other_lane),
    "at_most": _at_most,
    "at_least": _at_least,
    "speed_times": _times,
    "gap_at_least": _gap_at_least,
    "gap_at_most": _gap_at_most,
    "lanes_left": _lane_moved(-1),
    "lanes_right": _lane_moved(1),
    "stop_here": _stopped,
}
