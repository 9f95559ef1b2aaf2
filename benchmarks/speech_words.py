"""What speech engines make of driving sentences in synthetic voices and synthetic cabin noise.

    python benchmarks/speech_words.py --out FOLDER [--engine grammar] [--most 200] [--noise none,20,10,5]
    python benchmarks/speech_words.py --out FOLDER --engine whisper --model FOLDER
    python benchmarks/speech_words.py --out FOLDER --each --voices espeak/en-us,espeak/en-gb,espeak/en-us+f3 --most 48
    python benchmarks/speech_words.py --out FOLDER --again
    python benchmarks/speech_words.py --fit

Every voice is a synthesiser's (espeak-ng, flite) and every noise is computed: the figures compare engines and settings;
they do not say how well people are understood. A sentence is cut out, heard and judged as in the car: voice activity,
hotword, engine. `known` sentences are drawn from the closed grammar (so its figures are those of a closed vocabulary),
`free` ones are wishes in other words, `elsewhere` ones are not for driving. A sentence that was not understood counts
as all of its words missing. `carried out` counts sentences after which the on-board planner, on a highway, plans what
it plans for the words that were said: what was misheard without consequence counts; wishes it declines are left out.
Writes FOLDER/words.md and FOLDER/words.jsonl; `--again` makes the tables of a FOLDER anew.
`--each` says every sentence of the grammar in every voice at every speed, with a button held, and nothing else.
`--fit` prints the weights of the grammar engine's confidence, from voices and sentences that no figure uses.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import platform
import signal
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rapidfuzz.distance import Levenshtein

from chauffeur.concept import Context, Instruction, PlanRequest, Policy, Situation, SystemMessage
from chauffeur.concept.nouns import Lead
from chauffeur.planners.registry import make_planner
from chauffeur.speech import Recogniser, Recording, hear_recording, open_recogniser
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples
from chauffeur.speech.base import Heard
from chauffeur.speech.detector import SileroDetector
from chauffeur.speech.grammar import GrammarRecogniser
from chauffeur.speech.jsgf import driving_grammar
from chauffeur.speech.segments import Segmenter

TESTS = Path(__file__).resolve().parents[1] / "tests" / "speech"
sys.path.insert(0, str(TESTS))
import voices  # noqa: E402 - the tests' synthetic voices

VOICES = (
    "espeak/en-us",
    "espeak/en-us+f3",
    "espeak/en-gb",
    "espeak/en-gb-scotland",
    "flite/rms",
    "flite/slt",
    "flite/awb",
)
FIT_VOICES = ("espeak/en-us+m3", "espeak/en-gb-x-rp+f2", "espeak/en-us+f5", "flite/kal16")
SPEEDS = (0.9, 1.0, 1.15)
FIT_SPEEDS = (0.9, 1.1, 1.3)
EACH_SPEEDS = (0.85, 1.1, 1.35)
"""136, 176 (espeak-ng's own) and 216 words a minute."""
NOISES = ("none", "20", "10", "5")


@dataclass(frozen=True)
class Said:
    """One sentence in one voice."""

    kind: str
    text: str
    hotword: str
    button: bool
    voice: str
    speed: float
    noise: str

    @property
    def spoken(self) -> str:
        """With its hotword, unless a button is held."""
        return self.text if self.button or not self.hotword else f"{self.hotword} {self.text}"


@dataclass(frozen=True)
class Row:
    """What became of it."""

    said: Said
    status: str
    text: str
    errors: int
    words: int
    to_confirm: bool
    confidence: float | None
    sound_s: float
    recognise_s: float
    after_speech_s: float

    @property
    def exact(self) -> bool:
        return self.status == "heard" and self.errors == 0

    @property
    def wrong(self) -> bool:
        """Something else was understood than was said, or anything of what was not for the car."""
        return self.status == "heard" and (self.errors > 0 or self.said.kind == "elsewhere")


def stored_row(line: str) -> Row:
    """A row of words.jsonl."""
    stored = json.loads(line)
    return Row(**{**stored, "said": Said(**stored["said"])})


def sections() -> dict[str, list[str]]:
    """Sentences of the test folder by kind."""
    found: dict[str, list[str]] = {}
    section: list[str] = []
    for line in (TESTS / "sentences.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            section = found.setdefault(line.strip("[]"), [])
        elif line and not line.startswith(";"):
            section.append(line)
    return found


def known(count: int, seed: int) -> list[tuple[str, str]]:
    """(hotword, sentence) drawn from the grammar: every intent as often, every sentence once, one opinion in eight."""
    grammar, rng = driving_grammar(), np.random.default_rng(seed)
    found: dict[str, str] = {}
    intents = [*grammar.members("wish")]
    while len(found) < count:
        opinion = len(found) % 8 == 7
        intent = "feedback" if opinion else intents[len(found) % len(intents)]
        for _ in range(50):
            text = grammar.sample(intent, rng)
            if text not in found:
                found[text] = "evaluate" if opinion else "command"
                break
        else:
            intents.remove(intent)
    return [(hotword, text) for text, hotword in found.items()]


def sayings(most: int, noises: Sequence[str], names: tuple[str, ...], seed: int, suffix: str = "") -> list[Said]:
    """Everything that is said, in random order: `known` in every noise, the rest in the first one, where words are
    clearest. Voices and speeds are drawn, the same for every noise. `suffix` names the sentences for fitting."""
    texts = sections()
    plan = [("known", text, word, False) for word, text in known(most, seed)]
    plan += [] if suffix else [("free", text, "command", False) for text in texts["free"]]
    # Behind the hotword, without it, and with the button held by mistake.
    ways = (("command", False), ("", False), ("command", True))
    plan += [("elsewhere", text, *way) for text in texts[f"elsewhere{suffix}"] for way in ways]
    rng = np.random.default_rng(seed)
    speeds = FIT_SPEEDS if suffix else SPEEDS
    picks = [(names[int(rng.integers(len(names)))], speeds[int(rng.integers(len(speeds)))]) for _ in plan]
    found = [
        Said(*one, *pick, noise)
        for noise in noises
        for one, pick in zip(plan, picks, strict=True)
        if one[0] == "known" or noise == noises[0]
    ]
    return [found[int(k)] for k in rng.permutation(len(found))]


def each(most: int, names: tuple[str, ...], seed: int) -> list[Said]:
    """Every sentence in every voice at every speed, no noise, the button held that goes with it."""
    plan = [
        Said("known", text, hotword, True, voice, speed, "none")
        for hotword, text in known(most, seed)
        for voice in names
        for speed in EACH_SPEEDS
    ]
    return [plan[int(k)] for k in np.random.default_rng(seed).permutation(len(plan))]


_spoken: dict[tuple[str, str, float], Samples] = {}


def sound_of(said: Said, index: int) -> Samples:
    """Its sound, with noise of its own."""
    key = (said.spoken, said.voice, said.speed)
    if key not in _spoken:
        _spoken[key] = voices.speak(*key)
    rng = np.random.default_rng((7, index))
    return voices.in_cabin(_spoken[key], rng, None if said.noise == "none" else float(said.noise))


def judge(said: Said, heard: list[Heard], sound_s: float) -> Row:
    """Compare what was said with what was heard; of several utterances the one that would be driven counts."""
    best = next((one for one in heard if one.status == "heard"), heard[0] if heard else None)
    words = said.text.replace("'", " ").split()
    got = best.text.lower().replace("'", " ") if best is not None else ""
    got_words = "".join(c if c.isalnum() else " " for c in got).split()
    return Row(
        said,
        best.status if best is not None else "nothing",
        " ".join(got_words),
        Levenshtein.distance(words, got_words),
        len(words),
        best.to_confirm if best is not None else False,
        best.confidence if best is not None else None,
        sound_s,
        best.timing.recognise_s if best is not None else 0.0,
        best.timing.after_speech_s if best is not None else 0.0,
    )


def run(recogniser: Recogniser, plan: list[Said], clock: Callable[[], float]) -> list[Row]:
    """Hear everything, or, until Ctrl-C, a random part of it."""
    detector = SileroDetector()
    rows: list[Row] = []
    try:
        for index, said in enumerate(plan):
            sound = sound_of(said, index)
            button = (said.hotword or "command") if said.button else None
            seconds = len(sound) / SAMPLE_RATE_HZ
            heard = hear_recording(Recording(sound), recogniser, detector, button=button, clock=clock)
            rows.append(judge(said, heard, seconds))
            if index % 20 == 19:
                print(f"{index + 1}/{len(plan)}", file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print(f"Stopped after {len(rows)} of {len(plan)}; the order is random.", file=sys.stderr)
    return rows


def noise_only(recogniser: Recogniser, minutes: float) -> list[tuple[str, float, int, int]]:
    """(kind, minutes, utterances, driven) of sound in which nobody speaks to the car, with the microphone open."""
    rng, detector = np.random.default_rng(11), SileroDetector()
    length = int(minutes * 60 * SAMPLE_RATE_HZ)
    texts = sections()["elsewhere"]
    babble = np.zeros(length, np.float32)
    for k in range(3):  # three people at a time, none of them to the car
        at = 0
        while at < length:
            part = voices.speak(texts[int(rng.integers(len(texts)))], VOICES[(k * 2) % len(VOICES)]).astype(np.float32)
            part = part[: length - at]
            babble[at : at + len(part)] += part / 32768
            at += len(part) + int(rng.integers(8000))
    steps = np.repeat(rng.choice([220.0, 277.2, 329.6, 440.0, 554.4], size=length // 4000 + 1), 4000)[:length]
    music = np.sin(np.cumsum(2 * np.pi * steps / SAMPLE_RATE_HZ)) + 0.5 * np.sin(
        np.cumsum(np.pi * steps / SAMPLE_RATE_HZ)
    )
    found: list[tuple[str, float, int, int]] = []
    for kind, sound in (
        ("cabin noise", voices.cabin_noise(length, rng) * 0.1),
        ("white noise", rng.standard_normal(length) * 0.1),
        ("tones like music", music * 0.2),
        ("babble of three", babble * 0.3),
    ):
        clipped = (np.clip(sound, -1, 1) * 32767).astype(np.int16)
        for button in (None, "command"):
            heard: list[Heard] = []
            piece = 10 * SAMPLE_RATE_HZ
            for start in range(0, length, piece):
                part = Recording(clipped[start : start + piece].copy())
                heard += hear_recording(part, recogniser, detector, button=button)
            name = f"{kind}, button held" if button else kind
            spoken = sum(one.status != "nothing" for one in heard)
            found.append((name, minutes, spoken, sum(one.status == "heard" for one in heard)))
    return found


def _share(part: int, whole: int) -> str:
    return f"{part}/{whole} ({100 * part / whole:.1f} %)" if whole else "-"


class Understanding:
    """What a planner makes of words on a highway with somebody ahead."""

    def __init__(self) -> None:
        front = Lead(7, 45.0, 24.0)
        self._context = Context("", Situation("highway", 25.0, 31.3, 3, 1, False, front, None))
        self._planner = make_planner("onboard")
        self._plans: dict[str, tuple[str, Policy | None]] = {}

    def carried_out(self, row: Row) -> bool:
        """Whether what was heard leads to what the words would have."""
        if row.status != "heard" or not row.text:
            return False
        said, heard = self._plan(row.said.text), self._plan(row.text)
        return said[1] is not None and said == heard

    def _plan(self, words: str) -> tuple[str, Policy | None]:
        if words not in self._plans:
            request = PlanRequest(Instruction(words), self._context, SystemMessage(""))
            plan = asyncio.run(self._planner.plan(request))
            self._plans[words] = plan.intent, plan.policy
        return self._plans[words]

    def share(self, rows: list[Row]) -> str:
        """Of wishes of the grammar, the share that is carried out; opinions and talk are no wishes."""
        wishes = [row for row in rows if row.said.kind == "known" and row.said.hotword == "command"]
        able = [row for row in wishes if self._plan(row.said.text)[1] is not None]
        return _share(sum(self.carried_out(row) for row in able), len(able))


def _line(name: str, rows: list[Row], understanding: Understanding) -> str:
    errors, words = sum(row.errors for row in rows), sum(row.words for row in rows)
    took = np.array([row.recognise_s for row in rows if row.recognise_s > 0] or [0.0])
    factor = np.array([row.recognise_s / row.sound_s for row in rows if row.recognise_s > 0] or [0.0])
    wrong = [row for row in rows if row.wrong]
    return (
        f"| {name} | {len(rows)} | {100 * errors / words:.1f} % | {_share(sum(row.exact for row in rows), len(rows))} "
        f"| {_share(sum(row.status != 'heard' for row in rows), len(rows))} | {_share(len(wrong), len(rows))} "
        f"| {sum(not row.to_confirm for row in wrong)} | {understanding.share(rows)} "
        f"| {np.median(took):.3f} / {np.percentile(took, 95):.3f} | {np.median(factor):.3f} |"
    )


def report(name: str, rows: list[Row], noises: list[tuple[str, float, int, int]]) -> str:
    """The tables."""
    head = (
        "| {} | sentences | word errors | exact | not understood | heard wrongly | of these unasked "
        "| carried out | engine s, half / 95 % | real-time factor |"
    )
    rule = "|---|---|---|---|---|---|---|---|---|---|"
    understanding = Understanding()
    out = [f"# {name}", "", f"Synthetic voices and synthetic noise. Python {platform.python_version()}.", ""]
    ways = {
        "kind and noise": lambda row: f"{row.said.kind}, {_noise(row.said.noise)}",
        "voice (known sentences, no noise and 20 dB)": lambda row: row.said.voice if _mild(row) else "",
        "speed (known sentences, no noise and 20 dB)": lambda row: f"{row.said.speed:g}" if _mild(row) else "",
        "voice at words a minute, button held": lambda row: (
            f"{row.said.voice}, {round(160 * row.said.speed)}" if row.said.button and row.said.kind == "known" else ""
        ),
        "way of saying what is not for driving": lambda row: _way(row.said) if row.said.kind == "elsewhere" else "",
    }
    for title, way in ways.items():
        groups: dict[str, list[Row]] = defaultdict(list)
        for row in rows:
            groups[way(row)].append(row)
        if not any(groups):
            continue
        out += [
            head.format(title),
            rule,
            *(_line(key, group, understanding) for key, group in sorted(groups.items()) if key),
            "",
        ]
    if noises:
        out += ["| nobody speaks to the car | minutes | utterances | driven |", "|---|---|---|---|"]
        out += [f"| {kind} | {minutes:g} | {spoken} | {driven} |" for kind, minutes, spoken, driven in noises]
    return "\n".join(out) + "\n"


def _noise(noise: str) -> str:
    return "no noise" if noise == "none" else f"{noise} dB"


def _mild(row: Row) -> bool:
    return row.said.kind == "known" and row.said.noise in ("none", "20")


def _way(said: Said) -> str:
    return "button held" if said.button else "behind the hotword" if said.hotword else "without hotword"


def features_of(most: int) -> tuple[np.ndarray, np.ndarray]:
    """(features (n, 3), whether the sentence is what was said) of every sentence that the grammar takes."""
    engine = GrammarRecogniser()
    rows: list[np.ndarray] = []
    right: list[bool] = []
    for index, said in enumerate(sayings(most, ("none", "20", "10"), FIT_VOICES, 99, "_fit")):
        segmenter = Segmenter(SileroDetector())
        sound = sound_of(said, index)
        expect = "command" if said.button else "open"
        for utterance in [*segmenter.push(sound), *segmenter.flush()]:
            text, features = engine.features(utterance.samples, expect)
            if text and engine.grammar.matches(expect, text):
                rows.append(features)
                right.append(said.kind == "known" and text == said.spoken)
    return np.array(rows), np.array(right, float)


def fit(features: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Logistic regression of `right` on the features. Being wrong costs three times what asking again does."""
    x = np.column_stack([np.ones(len(features)), features])
    cost = np.where(right > 0, 1.0, 3.0)
    w = np.zeros(x.shape[1])
    for _ in range(100):
        p = 1 / (1 + np.exp(-np.clip(x @ w, -40, 40)))
        hessian = (x * (cost * p * (1 - p))[:, None]).T @ x + 1e-2 * np.eye(len(w))
        w += np.linalg.solve(hessian, x.T @ (cost * (right - p)) - 1e-2 * w)
    sure = x @ w > 0
    print(f"{len(right)} sentences decoded, {int(right.sum())} as said; weights {np.round(w, 2).tolist()}")
    print(f"believed {int(sure.sum())}, of these wrong {int((sure & (right == 0)).sum())}")
    print(f"right and not believed {int((~sure & (right == 1)).sum())}")
    return w


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--engine", default="grammar")
    parser.add_argument("--model", default="")
    parser.add_argument("--base-url")
    parser.add_argument("--most", type=int, default=200)
    parser.add_argument("--voices", default=",".join(VOICES))
    parser.add_argument("--each", action="store_true", help="every sentence in every voice at three speeds")
    parser.add_argument("--noise", default=",".join(NOISES))
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cpu", action="store_true", help="durations in CPU time: on a busy machine")
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--again", action="store_true", help="tables of what FOLDER holds; nothing is heard")
    given = parser.parse_args()
    if given.fit:
        fit(*features_of(given.most))
        return
    if given.out is None:
        parser.error("--out FOLDER is needed")
    if given.again:
        rows = [stored_row(line) for line in (given.out / "words.jsonl").read_text(encoding="utf-8").splitlines()]
        print(report(f"{given.engine}, stored", rows, []))
        return
    given.out.mkdir(parents=True, exist_ok=True)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell takes away from background jobs
    names = tuple(voice for voice in given.voices.split(",") if voices.installed(voice))
    if not names:
        parser.error("no synthesiser here: apt install espeak-ng flite")
    recogniser = open_recogniser(given.engine, model=given.model, base_url=given.base_url)
    started = time.perf_counter()
    clock = time.process_time if given.cpu else time.perf_counter
    plan = each(given.most, names, given.seed)
    if not given.each:
        plan = sayings(given.most, given.noise.split(","), names, given.seed)
    rows = run(recogniser, plan, clock)
    noises = noise_only(recogniser, given.minutes) if given.minutes > 0 and not given.each else []
    text = report(f"{recogniser.name}{', CPU time' if given.cpu else ''}", rows, noises)
    (given.out / "words.md").write_text(text, encoding="utf-8")
    with (given.out / "words.jsonl").open("w", encoding="utf-8") as file:
        file.writelines(json.dumps(asdict(row)) + "\n" for row in rows)
    print(text)
    print(f"{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
