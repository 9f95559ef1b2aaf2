"""How long it takes from the end of speech to a changed set-point, in a session as people have it.

    python benchmarks/talk_latency.py --planner onboard --planner talk2drive --utterances 30 --out FOLDER

Synthetic voices (espeak-ng, flite) with faint synthetic cabin noise are played into a session in real time, in pieces
as a microphone gives them: voice activity, speech engine, planner, checks, policy and control run as in a drive, each
in its process. Between two utterances a typed wish takes the speed up again. The clock starts when the last sample
above 3 % of the peak was played (the true end of the sound, not what voice activity took for it) and stops in the
control period whose target speed is another one.

Only slower and stop are driven without asking back. `--confirmed N` adds utterances that are asked back and answered
with a spoken yes: their clock starts at the end of the yes. What was not understood is counted, and played no second
time. Writes FOLDER/latency.json and prints the rows of benchmarks/RESULTS.md. The world is simulated.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.asr_process import AsrEngine
from chauffeur.driving.talk.messages import Conversation, HeardWords, Note, Said, Say, Scene, StageTimes
from chauffeur.driving.talk.session import Talk
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples, decode

SLOWER = (
    "slow down", "drive slower", "please slow down", "slow down a little", "you are driving too fast", "not so fast",
    "go slower please", "reduce your speed", "drive more slowly", "slow down a bit", "please go slower",
    "that is too fast", "take it slow", "we are going too fast", "please drive slower",
)  # fmt: skip
ASKED_BACK = ("speed up", "drive at seventy kilometers per hour", "go faster", "drive faster please")
VOICES = ("flite/slt", "flite/rms", "espeak/en-us", "espeak/en-gb")
CHUNK_S = 0.04
TICK_S = 0.01
AUDIBLE = 0.03


@dataclass(frozen=True)
class Shot:
    """One utterance."""

    text: str
    voice: str
    heard: str
    total_s: float | None
    from_vad_s: float | None
    stages: StageTimes | None
    asked_back: bool = False


def speak(text: str, voice: str) -> Samples:
    program, _, name = voice.partition("/")
    command = (
        ["espeak-ng", "--stdin", "--stdout", "-v", name]
        if program == "espeak"
        else ["flite", "-voice", name, "-o", "/dev/stdout", "-t", text]
    )
    done = subprocess.run(command, input=text.encode(), capture_output=True, timeout=30, check=True)
    return decode(done.stdout).samples


def in_cabin(speech: Samples, rng: np.random.Generator, after_s: float) -> tuple[Samples, int]:
    """The utterance with pauses and noise 30 dB below around it, and where its sound ends."""
    sound = speech.astype(np.float64) / max(1, int(np.abs(speech.astype(np.int32)).max()))
    lead = SAMPLE_RATE_HZ // 2
    end = lead + int(np.flatnonzero(np.abs(sound) > AUDIBLE)[-1]) + 1
    sound = np.concatenate([np.zeros(lead), 0.4 * sound, np.zeros(int(after_s * SAMPLE_RATE_HZ))])
    level = np.sqrt(np.mean(sound[np.abs(sound) > 0.01] ** 2)) * 10 ** (-30 / 20)
    return np.round((sound + level * rng.standard_normal(len(sound))) * 32767).astype(np.int16), end


class Bench:
    """A session, and what it said."""

    def __init__(self, settings: Settings) -> None:
        self.talk = Talk(settings, self.tell, engine=AsrEngine(favoured=True))
        self.conversations: dict[str, Conversation] = {}
        self.heard: list[HeardWords] = []
        self.scenes: list[tuple[float, Scene]] = []

    def tell(self, said: Said) -> None:
        match said:
            case Conversation():
                self.conversations[said.wish] = said
            case HeardWords():
                self.heard.append(said)
            case Scene():
                self.scenes.append((time.monotonic(), said))
            case Note(trouble=True):
                print("   trouble:", said.text)
            case _:
                pass

    def until(self, holds: Any, within_s: float) -> bool:
        end = time.monotonic() + within_s
        while not holds():
            if time.monotonic() > end or not self.talk.driving:
                return False
            self.talk.poll()
            time.sleep(TICK_S)
        return True

    def play(self, sound: Samples, sound_end: int) -> float:
        """Play in real time; returns when the end of the speech was there to be heard."""
        begun = time.monotonic()
        size = int(CHUNK_S * SAMPLE_RATE_HZ)
        for start in range(0, len(sound), size):
            due = begun + (start + size) / SAMPLE_RATE_HZ
            self.until(lambda due=due: time.monotonic() >= due, 5.0)
            self.talk.take(sound[start : start + size].astype("<i2").tobytes())
        return begun + sound_end / SAMPLE_RATE_HZ

    def newest(self) -> Conversation | None:
        return next(reversed(self.conversations.values()), None)

    def driven(self, before: int) -> bool:
        return len(self.conversations) > before and self.conversations[f"w{before + 1}"].stages.total_s is not None

    def speed_up(self) -> None:
        before = len(self.conversations)
        self.talk.take(Say("Drive at 90 km/h."))
        self.until(lambda: self.driven(before), 10.0)
        self.until(lambda: False, 0.7)

    def shoot(self, text: str, voice: str, rng: np.random.Generator, *, asked_back: bool) -> Shot:
        before, heard = len(self.conversations), len(self.heard)
        sound, end = in_cabin(speak(f"command {text}", voice), rng, 1.0)
        end_s = self.play(sound, end)
        if asked_back and self.until(lambda: self.talk.question, 3.0):
            sound, end = in_cabin(speak("yes", voice), rng, 1.0)
            end_s = self.play(sound, end)
        self.until(lambda: self.driven(before), 3.0)
        words = "; ".join(each.text or each.status for each in self.heard[heard:])
        found = self.conversations.get(f"w{before + 1}")
        if found is None or found.stages.total_s is None:
            return Shot(text, voice, words, None, None, None, asked_back)
        asked = found.stages
        assert asked.total_s is not None
        # The session counts from what voice activity took for the end; the true end is known here.
        changed_s = self.changed_at(found.wish)
        total_s = None if changed_s is None else changed_s - end_s
        return Shot(text, voice, words, total_s, asked.total_s, asked, asked_back)

    def changed_at(self, wish: str) -> float | None:
        """When the first scene was told whose target speed is that of the wish, and another than before."""
        before = None
        for at_s, scene in self.scenes[-200:]:
            if scene.wish == wish and before is not None and scene.target_mps != before:
                return at_s
            if scene.wish != wish:
                before = scene.target_mps
        return None


def run(planner: str, utterances: int, confirmed: int, voices: tuple[str, ...]) -> list[Shot]:
    place = find("left-lane")
    starts = tuple(Start(place, place.seed + number, most_s=75.0) for number in range(40))
    settings = Settings(starts, planner=planner)
    bench = Bench(settings)
    with bench.talk:
        rng = np.random.default_rng(7)
        bench.until(lambda: len(bench.scenes) > 20, 30.0)
        shots: list[Shot] = []
        for number in range(utterances + confirmed):
            bench.speed_up()
            asked_back = number >= utterances
            texts = ASKED_BACK if asked_back else SLOWER
            shot = bench.shoot(texts[number % len(texts)], voices[number % len(voices)], rng, asked_back=asked_back)
            print(
                f"  {number + 1:3} {planner:12} {shot.voice:13} {shot.text!r:40} -> {shot.heard!r:40} "
                f"{'-' if shot.total_s is None else f'{shot.total_s:.3f} s'} {_stages(shot.stages)}",
                flush=True,
            )
            shots.append(shot)
    return shots


def _stages(stages: StageTimes | None) -> str:
    if stages is None:
        return ""
    return " ".join(f"{name[:-2]} {value:.3f}" for name, value in asdict(stages).items() if value is not None)


def _share(values: list[float], share: float) -> float:
    return float(np.quantile(values, share))


def summary(planner: str, shots: list[Shot]) -> str:
    lines: list[str] = []
    for asked_back in (False, True):
        group = [shot for shot in shots if shot.asked_back == asked_back]
        timed = [shot for shot in group if shot.total_s is not None and shot.stages is not None]
        if not timed:
            continue
        totals = [shot.total_s for shot in timed if shot.total_s is not None]
        kind = "from the end of yes" if asked_back else "slower"
        lines.append(
            f"| {planner} | {kind} | {len(timed)} of {len(group)} | {1000 * statistics.median(totals):.0f} ms "
            f"| {1000 * _share(totals, 0.95):.0f} ms | {1000 * max(totals):.0f} ms |"
        )
        parts = {
            name: statistics.median([getattr(shot.stages, name) or 0.0 for shot in timed])
            for name in ("wait_s", "recognise_s", "plan_s", "check_s", "set_point_s")
        }
        whole = sum(parts.values())
        lines.append("    " + ", ".join(f"{n[:-2]} {1000 * v:.0f} ms ({v / whole:.0%})" for n, v in parts.items()))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", action="append", default=[])
    parser.add_argument("--utterances", type=int, default=30)
    parser.add_argument("--confirmed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    voices = tuple(v for v in VOICES if shutil.which("espeak-ng" if v.startswith("espeak") else "flite"))
    if not voices:
        raise SystemExit("Neither espeak-ng nor flite is installed.")
    options.out.mkdir(parents=True, exist_ok=True)
    found: dict[str, Any] = {"load_before": os.getloadavg(), "chunk_s": CHUNK_S}
    rows: list[str] = []
    for planner in options.planner or ["onboard", "talk2drive"]:
        shots = run(planner, options.utterances, options.confirmed, voices)
        found[planner] = [asdict(shot) for shot in shots]
        rows.append(summary(planner, shots))
    found["load_after"] = os.getloadavg()
    (options.out / "latency.json").write_text(json.dumps(found, indent=1))
    print("\n".join(rows))
    print("load", found["load_before"], found["load_after"])


if __name__ == "__main__":
    main()
