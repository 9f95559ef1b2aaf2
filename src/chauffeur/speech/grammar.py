"""The offline engine: pocketsphinx, held to a closed grammar, with a second opinion on every word.

A decoder that knows 200 words hears one of them in everything. So the sound is decoded twice: as a sentence of the
grammar, and as any sequence of phones. A word that was really said explains its frames about as well as free phones do;
a word that was not said explains them far worse. The worst word decides.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples, to_float, to_int16
from chauffeur.speech.base import HOTWORDS, Expect, Transcript
from chauffeur.speech.jsgf import SpeechGrammar, driving_grammar

SAFE_INTENTS: Final = frozenset({"slower", "stop"})
"""Rules of the grammar that are driven without asking back: misheard, they do no more than lose time."""

_PHONES: Final = "phones"
_PEAK: Final = 0.5
"""Level that sound is brought to; the acoustic model was trained on nothing quieter."""

_DITHER: Final = 3e-3
"""Standard deviation of noise added to it, 45 dB below: digital silence, which no cabin has, confuses the model. Three
times as much hides the fricatives: sixty is heard as fifty."""

_SHORTEST_S: Final = 0.2
_SCALE: Final = 1024.0
"""pocketsphinx gives scores with their last ten bits cut off (SENSCR_SHIFT)."""

_LEAST: Final = 1e-300
"""Scores are likelihoods as floats; below this they have underflowed."""

_LONG_FRAMES: Final = 15
"""Silence shorter than this (0.15 s) is not judged."""

_WEIGHTS: Final = (5.47, 2.22, 0.23, 1.57)
"""Confidence = 1 / (1 + exp(-(w0 + w1 mean + w2 worst + w3 silence))), fitted with
`benchmarks/speech_words.py --fit --most 60` on synthetic voices and sentences that no reported figure uses."""

_SURE: Final = 0.5
"""Confidence from which words are believed."""

_SURE_AHEAD: Final = 0.975
_SURE_SAFE: Final = 0.9
"""The same for words that were guessed while they were spoken (a check of given words passes more easily), and of these
for words that mean nothing but to go slower or to stop."""

_BEGUN: Final = 2
"""Words at the end of a guess that may be taken back; whether the rest was said is checked against the sound."""

_FIRST_PEAK: Final = 0.33
"""Level that the first moments of an utterance are brought to: it mostly becomes louder."""

_MOST_GAIN: Final = 30.0


class GrammarRecogniser:
    """Hears sentences of a closed grammar, in English, on this machine, and says so when it hears something else.

    Nothing it hears, except to go slower or to stop, is to be driven without asking back.
    """

    def __init__(self, grammar: SpeechGrammar | None = None, *, sure: float = _SURE) -> None:
        """Load the acoustic model that comes with pocketsphinx (0.5 s, 60 MB).

        Args:
            grammar: With public rules `open`, `command` and `evaluate`, and `wish` and `feedback` that choose between
                intents; the package's own if left out.
            sure: Confidence from which words are believed.

        Raises:
            MissingExtraError: pocketsphinx is not installed.
            DataError: A word of the grammar is not in its dictionary.
        """
        try:
            import pocketsphinx
        except ImportError as error:
            raise MissingExtraError("The offline speech engine needs pocketsphinx.", extra="speech") from error
        library: Any = pocketsphinx
        self.grammar = driving_grammar() if grammar is None else grammar
        """What it can hear."""
        self._sure = sure
        self._version = version("pocketsphinx")
        folder = Path(library.get_model_path("en-us"))

        def decoder(level: str) -> Any:
            config = library.Config(
                hmm=str(folder / "en-us"),
                dict=str(folder / "cmudict-en-us.dict"),
                lm=None,
                cmn=level,
                bestpath=False,  # a second search, through the lattice, takes as long again and changes little
                loglevel="FATAL",
            )
            return library.Decoder(config)

        self._decoder: Any = decoder("batch")  # the level of the whole utterance, not of what came before it
        unknown = sorted(word for word in self.grammar.words() if self._decoder.lookup_word(word) is None)
        if unknown:
            raise DataError(f"The pronouncing dictionary does not have {', '.join(unknown[:5])}.")
        for rule in self.grammar.public:
            self._decoder.add_fsg(rule, self._decoder.parse_jsgf(self.grammar.text, f"{self.grammar.name}.{rule}"))
        self._decoder.add_allphone_file(_PHONES, None)
        self._make_follower = lambda: decoder("live")
        self._follower: Any = None
        self._expect = ""
        self._gain = 0.0
        # One decoder, one utterance at a time.
        self._lock = threading.Lock()

    @property
    def name(self) -> str:
        """`grammar/pocketsphinx-` and its version."""
        return f"grammar/pocketsphinx-{self._version}"

    @property
    def remote(self) -> bool:
        """The sound stays on this machine."""
        return False

    def recognise(self, samples: Samples, expect: Expect = "open") -> Transcript:
        """Words of one utterance, if it is a sentence of the grammar.

        Args:
            samples: Mono at 16 kHz.
            expect: Public rule of the grammar that may be said.
        """
        if len(samples) < _SHORTEST_S * SAMPLE_RATE_HZ:
            return Transcript("", 0.0, reason="That was too short to be a word.")
        with self._lock:
            text, features = self._decode(samples, expect)
        if not text or not self.grammar.matches(expect, text):
            return Transcript("", 0.0, to_confirm=True, reason="That is no sentence this engine knows.")
        confidence = _confidence(features)
        if confidence < self._sure:
            return Transcript("", confidence, to_confirm=True, reason="That sounded like something else than driving.")
        return Transcript(text, confidence, to_confirm=confidence < _SURE_SAFE or not self.safe(text))

    # Following (base.FollowingRecogniser) ----------------------------------------------------------------------------

    def begin(self, expect: Expect) -> None:
        """An utterance begins; the one before is forgotten. The first time takes a moment: 30 MB more."""
        if self._follower is None:
            self._follower = self._make_follower()
            for rule in self.grammar.public:
                parsed = self._follower.parse_jsgf(self.grammar.text, f"{self.grammar.name}.{rule}")
                self._follower.add_fsg(rule, parsed)
        else:
            self._end_following()
        self._follower.reinit_feat()
        self._follower.activate_search(expect)
        self._follower.start_utt()
        self._expect, self._gain = expect, 0.0

    def follow(self, samples: Samples) -> None:
        """The next samples of it: some 10 % of their length in CPU time."""
        sound = to_float(samples)
        if self._gain == 0.0:
            peak = float(np.abs(sound).max(initial=0.0))
            self._gain = min(_MOST_GAIN, max(1.0, _FIRST_PEAK / max(peak, _LEAST)))
        sound *= self._gain
        sound += np.random.default_rng(0).standard_normal(len(sound), dtype=np.float32) * np.float32(_DITHER)
        self._follower.process_raw(to_int16(sound).view(np.uint8), full_utt=False)

    def guess(self) -> str:
        """Words that were said so far, if they make a whole sentence of the grammar; else empty."""
        best = self._follower.hyp()
        words = [] if best is None else str(best.hypstr).split()
        # On the way the best path often has a word begun that is not there in the end: "slow down a".
        whole = (" ".join(words[:end]) for end in range(len(words), max(0, len(words) - _BEGUN - 1), -1))
        return next((text for text in whole if self.grammar.matches(self._expect, text)), "")

    def check(self, samples: Samples, expect: Expect, text: str) -> Transcript:
        """Whether the whole utterance so far says exactly that sentence of the grammar."""
        with self._lock:
            sound = _levelled(samples)
            try:
                self._decoder.set_align_text(text)
                found, words = self._searched(sound)
                phones = self._search(_PHONES, sound)[1] if found else ()
            finally:
                sound.fill(0)
                self._forget()
        confidence = _confidence(_features(words, _per_frame(phones, len(samples))))
        safe = self.safe(text)
        if not found or confidence < (_SURE_SAFE if safe else _SURE_AHEAD) or not self.grammar.matches(expect, text):
            return Transcript("", confidence, to_confirm=True, reason="It is not certain yet what was said.")
        return Transcript(text, confidence, to_confirm=not safe)

    def _end_following(self) -> None:
        with contextlib.suppress(RuntimeError):  # there is none
            self._follower.end_utt()

    def features(self, samples: Samples, expect: Expect = "open") -> tuple[str, npt.NDArray[np.float64]]:
        """(best sentence or half sentence, what its confidence is computed from), whatever comes of it: for fitting."""
        with self._lock:
            return self._decode(samples, expect)

    def safe(self, text: str) -> bool:
        """Whether words mean nothing but to go slower or to stop."""
        first, _, rest = text.partition(" ")
        words = rest if first in HOTWORDS else text
        return any(self.grammar.matches(rule, words) for rule in self.grammar.members("wish") if rule in SAFE_INTENTS)

    def _decode(self, samples: Samples, expect: str) -> tuple[str, npt.NDArray[np.float64]]:
        sound = _levelled(samples)
        try:
            text, words = self._search(expect, sound)
            phones = self._search(_PHONES, sound)[1] if text else ()
        finally:
            sound.fill(0)
            self._forget()
        return text, _features(words, _per_frame(phones, len(samples)))

    def _search(self, search: str, sound: Samples) -> tuple[str, tuple[tuple[str, int, int, float], ...]]:
        """(sentence, segments as (word, first frame, frame after the last, likelihood)) of one pass."""
        self._decoder.activate_search(search)
        return self._searched(sound)

    def _searched(self, sound: Samples) -> tuple[str, tuple[tuple[str, int, int, float], ...]]:
        """The same, of the search that was set."""
        self._decoder.reinit_feat()  # else what was heard before changes what is heard now
        self._decoder.start_utt()
        self._decoder.process_raw(sound.view(np.uint8), full_utt=True)
        self._decoder.end_utt()
        best = self._decoder.hyp()
        if best is None:
            return "", ()
        segments: Iterable[Any] = self._decoder.seg()
        return str(best.hypstr), tuple((s.word, s.start_frame, s.end_frame + 1, s.ascore) for s in segments)

    def _forget(self) -> None:
        """An empty utterance, so that the decoder does not hold the features of the last one."""
        with contextlib.suppress(RuntimeError):
            self._decoder.end_utt()  # one that broke off
        self._decoder.start_utt()
        self._decoder.end_utt()


def _levelled(samples: Samples) -> Samples:
    """The sound at the level of the acoustic model, with a little noise, always the same for the same sound."""
    sound = to_float(samples)
    peak = float(np.abs(sound).max(initial=0.0))
    if peak > 0.0:
        sound *= _PEAK / peak
    sound += np.random.default_rng(0).standard_normal(len(sound), dtype=np.float32) * np.float32(_DITHER)
    return to_int16(sound)


def _per_frame(phones: Sequence[tuple[str, int, int, float]], samples: int) -> npt.NDArray[np.float64]:
    """Log-likelihood of each frame (10 ms) as the phone it sounds most like."""
    scores = np.zeros(samples * 100 // SAMPLE_RATE_HZ + 8)
    for _, start, end, likelihood in phones:
        scores[start:end] = _log(likelihood) / (end - start)
    return scores


def _log(likelihood: float) -> float:
    """Log-likelihood of a segment, in nats."""
    return math.log(max(likelihood, _LEAST)) * _SCALE


def _features(words: Sequence[tuple[str, int, int, float]], phones: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(mean over the words, worst word, worst silence): log-likelihood ratio to free phones, nats a frame."""
    said: list[tuple[int, float]] = []
    silence = 0.0
    for word, start, end, likelihood in words:
        ratio = (_log(likelihood) - float(phones[start:end].sum())) / (end - start)
        if not word.startswith(("<", "[", "+")):
            said.append((end - start, ratio))
        elif end - start >= _LONG_FRAMES:
            silence = min(silence, ratio)
    if not said:
        return np.array([-9.0, -9.0, silence])
    frames = sum(count for count, _ in said)
    mean = sum(count * ratio for count, ratio in said) / frames
    return np.array([mean, min(ratio for _, ratio in said), silence])


def _confidence(features: npt.NDArray[np.float64]) -> float:
    odds = _WEIGHTS[0] + float(np.dot(_WEIGHTS[1:], features))
    return 1.0 / (1.0 + math.exp(-max(-40.0, min(40.0, odds))))
