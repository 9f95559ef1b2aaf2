"""What of a style reaches the seat: the table's gains driven through the track, and how much of their score is driving.

    python benchmarks/gains_felt.py

The on-board VLM is taught one set of gains a style and weather (`data/vlm/gains.json`). Here each is driven without any
model between, as if words and weather had been read without a fault, and compared with fixed gains in the same scene.
The second table splits the lead in driving score into what the drive does and what alignments give for the gains
themselves. Simulated; CommonRoad's drift model; some minutes of one core; the extra is `chauffeur[motion]`.
"""

from __future__ import annotations

from statistics import fmean

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.motion.driving import MAX_S
from chauffeur.bench.motion.items import style_ranges, track_scenario
from chauffeur.bench.motion.scoring import MotionStatistics, command_alignment, driving_score, measured
from chauffeur.concept import ActionMatrix, Frame, Limits
from chauffeur.concept.weather import WEATHERS
from chauffeur.driving.episode import drive_policy
from chauffeur.models.vlm.gains import GainCase, taught_gains
from chauffeur.planners.prompts.motion import MODERATE
from chauffeur.planners.vlm.template import STYLES
from chauffeur.worlds.track import TrackWorld

SEED = 1
MANOEUVRES = {"acceleration": "lead", "lane_change": "lead", "left_turn": "no_lead"}
"""Manoeuvre, and what the table is told of the vehicle ahead."""


def driven(manoeuvre: str, weather: str, policy: ActionMatrix) -> tuple[MotionStatistics, tuple[Frame, ...]]:
    scenario = track_scenario(manoeuvre, weather, "std", SEED)
    world = TrackWorld()
    world.reset(scenario)
    episode = drive_policy(world, policy, None, MAX_S, Limits())
    return measured(episode.frames, world.dt_s), tuple(episode.frames)


def taught(style: str, weather: str, manoeuvre: str) -> ActionMatrix:
    values = taught_gains(GainCase(style, weather, "light", MANOEUVRES[manoeuvre], manoeuvre))
    return ActionMatrix(values[:3], values[3:])


def peak(frames: tuple[Frame, ...]) -> tuple[float, float]:
    """Largest size of acceleration across and along, m/s2."""
    egos = [frame.observation.ego for frame in frames]
    return max(abs(e.speed_mps * e.yaw_rate_radps) for e in egos), max(abs(e.acceleration_mps2) for e in egos)


def main() -> None:
    felt: list[tuple[str, ...]] = []
    for name, style, seen in (
        *((style, style, "sunny") for style in reversed(STYLES)),
        ("conservative, as in snow", "conservative", "snow"),
        ("fixed", "", "sunny"),
    ):
        cells: list[str] = []
        for manoeuvre in MANOEUVRES:
            policy = taught(style, seen, manoeuvre) if style else MODERATE
            cells += [f"{value:.2f}" for value in peak(driven(manoeuvre, "sunny", policy)[1])]
        felt.append((name, *cells))
    heads = [f"{one.replace('_', ' ')}: max {way}" for one in MANOEUVRES for way in ("across", "along")]
    print("Sunny road, m/s2\n")
    print(markdown(("gains", *heads), felt))
    split: list[tuple[str, ...]] = []
    for manoeuvre in MANOEUVRES:
        whole, drive_alone, fixed_score = [], [], []
        for weather in WEATHERS:
            base = driven(manoeuvre, weather, MODERATE)[0]
            scenario = None if weather == "sunny" else 100.0
            for style in STYLES:
                ranges, policy = style_ranges()[style], taught(style, weather, manoeuvre)
                own = driven(manoeuvre, weather, policy)[0]
                fixed = command_alignment(MODERATE, ranges)
                none = None if scenario is None else 0.0
                fixed_score.append(driving_score(manoeuvre, base, base, None, fixed, none))
                drive_alone.append(driving_score(manoeuvre, own, base, None, fixed, none))
                aligned = command_alignment(policy, ranges)
                whole.append(driving_score(manoeuvre, own, base, None, aligned, scenario))
        values = (fmean(fixed_score), fmean(whole) - fmean(fixed_score), fmean(drive_alone) - fmean(fixed_score))
        split.append((manoeuvre.replace("_", " "), *(f"{value:.1f}" for value in values)))
    print("\nDriving score, points: five weathers, three styles each\n")
    print(markdown(("manoeuvre", "fixed gains", "lead of the table's gains", "of which the drive"), split))


if __name__ == "__main__":
    main()
