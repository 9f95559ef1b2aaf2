"""One drive of the benchmark, in a worker process: plan, checks, drive, measures."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any, Final

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.rollout import plan_adapter
from chauffeur.bench.motion.scoring import SCORE_VERSION, measured
from chauffeur.concept import ActionMatrix, ChauffeurError, Limits, Plan, Scenario
from chauffeur.driving.episode import drive_policy
from chauffeur.driving.planning import checked
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.prompts.motion import MODERATE
from chauffeur.worlds.track import TrackWorld

DRIVE_VERSION: Final = "motion-drive-v1"
MAX_S: Final = 30.0


@dataclass(frozen=True, slots=True)
class MotionJob:
    """Gains to be driven in a scene."""

    key: str
    scenario: Scenario
    plan: Row

    @property
    def near(self) -> str:
        """See BenchJob: one scene's baseline is driven once a process."""
        return self.scenario.id

    def run(self) -> Row:
        row: Row = {"key": self.key, "infra_failed": False, "refused": False, "policy_failed": False, "detail": ""}
        plan: Plan = plan_adapter.validate_python(self.plan)
        try:
            found = checked(plan, TrackWorld().reset(self.scenario), Limits())
            if found.refusal:
                failed = found.unusable
                return row | {"refused": not failed, "policy_failed": failed, "detail": found.refusal}
            assert isinstance(plan.policy, ActionMatrix)
            return row | drive_gains(self.scenario, plan.policy) | {"baseline": baseline_of(frozen(self.scenario))}
        except ChauffeurError as error:
            return row | {"infra_failed": True, "detail": str(error)}

    def spoiled(self, detail: str) -> Row:
        return {"key": self.key, "infra_failed": True, "refused": False, "policy_failed": False, "detail": detail}


def job_key(scenario: Scenario, answer: Row) -> str:
    """Settings that decide a drive: scene, gains, versions."""
    parts = [DRIVE_VERSION, SCORE_VERSION, scenario_hash(scenario), answer["policy"], answer["refusal"]]
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]


def drive_gains(scenario: Scenario, policy: ActionMatrix) -> dict[str, Any]:
    """Outcome and measures of a drive. Raises ChauffeurError: it cannot be set up."""
    world = TrackWorld()
    world.reset(scenario)
    episode = drive_policy(world, policy, None, MAX_S, Limits())
    return {
        "outcome": episode.outcome,
        "duration_s": episode.duration_s,
        "end_speed_mps": episode.final.ego.speed_mps,
        "interventions": episode.interventions,
        "measured": asdict(measured(episode.frames, world.dt_s)),
    }


@lru_cache(maxsize=32)
def baseline_of(scenario: str) -> dict[str, Any]:
    """Measures of fixed gains in a scene."""
    return drive_gains(Scenario(**json.loads(scenario)), MODERATE)["measured"]


def frozen(scenario: Scenario) -> str:
    """A scenario as a text, which a cache can be asked by."""
    return json.dumps(asdict(scenario), sort_keys=True)
