"""Chunks in, utterances out: the same whatever the chunks, and never more in memory than the longest utterance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loudness import Loudness

from chauffeur.speech.audio import SAMPLE_RATE_HZ, Samples
from chauffeur.speech.detector import FRAME
from chauffeur.speech.segments import FRAME_S, LONGEST_S, Segmenter, SpeechSegment


def frames(*runs: tuple[bool, int]) -> Samples:
    """Sound from runs of (voiced, frames); every sample is different from its neighbours."""
    rng = np.random.default_rng(len(runs))
    parts = [(6000 if voiced else 300) * rng.choice([-1, 1], size=count * FRAME) for voiced, count in runs]
    noise = rng.integers(-200, 200, size=sum(count for _, count in runs) * FRAME)
    return (np.concatenate([*parts, np.zeros(0)]) + noise).astype(np.int16)


def cut(sound: Samples, sizes: list[int]) -> list[bytes]:
    """The bytes of a sound in chunks of the given sizes, in turn."""
    raw, out, at = sound.astype("<i2").tobytes(), [], 0
    while at < len(raw):
        size = sizes[len(out) % len(sizes)]
        out.append(raw[at : at + size])
        at += size
    return out


def gather(segmenter: Segmenter, chunks: list[bytes]) -> list[SpeechSegment]:
    found = [utterance for chunk in chunks for utterance in segmenter.push(chunk)]
    return [*found, *segmenter.flush()]


runs = st.lists(st.tuples(st.booleans(), st.integers(1, 60)), max_size=8)


@settings(max_examples=60, deadline=None)
@given(runs, st.lists(st.integers(1, 9000), min_size=1, max_size=5))
def test_utterances_do_not_depend_on_the_chunks(parts: list[tuple[bool, int]], sizes: list[int]) -> None:
    sound = frames(*parts)
    whole = gather(Segmenter(Loudness()), [sound.tobytes()])
    pieces = gather(Segmenter(Loudness()), cut(sound, sizes))
    assert len(whole) == len(pieces)
    for one, other in zip(whole, pieces, strict=True):
        assert np.array_equal(one.samples, other.samples)
        assert (one.speech_s, one.wait_s, one.cut) == (other.speech_s, other.wait_s, other.cut)


@settings(max_examples=40, deadline=None)
@given(runs, st.integers(1, 4000))
def test_memory_is_bounded_and_utterances_are_pieces_of_the_stream_in_order(
    parts: list[tuple[bool, int]], size: int
) -> None:
    sound = frames(*parts)
    segmenter = Segmenter(Loudness(), longest_s=1.0)
    limit = segmenter.held_bytes + 2 * FRAME
    found: list[SpeechSegment] = []
    for chunk in cut(sound, [size]):
        found += segmenter.push(chunk)
        assert segmenter.held_bytes < limit
    found += segmenter.flush()
    raw, at = sound.tobytes(), 0
    for utterance in found:
        assert len(utterance.samples) <= SAMPLE_RATE_HZ
        at = raw.index(utterance.samples.tobytes(), at) + 1


def test_an_utterance_has_its_first_consonant_and_a_tail() -> None:
    found = gather(Segmenter(Loudness()), [frames((False, 30), (True, 20), (False, 40)).tobytes()])
    assert len(found) == 1
    assert len(found[0].samples) == (10 + 20 + 10) * FRAME
    assert found[0].speech_s == pytest.approx(20 * FRAME_S)
    assert found[0].wait_s == pytest.approx(22 * FRAME_S)
    assert not found[0].cut


def test_a_pause_for_breath_does_not_end_it_and_a_click_does_not_begin_one() -> None:
    speech = frames((True, 20), (False, 21), (True, 20), (False, 22), (True, 2), (False, 30))
    found = gather(Segmenter(Loudness()), [speech.tobytes()])
    assert [u.speech_s for u in found] == [pytest.approx(61 * FRAME_S)]


def test_a_cough_is_no_utterance() -> None:
    assert gather(Segmenter(Loudness()), [frames((True, 4), (False, 40)).tobytes()]) == []
    assert len(gather(Segmenter(Loudness()), [frames((True, 5), (False, 40)).tobytes()])) == 1


def test_who_goes_on_for_ever_is_cut_once_and_heard_again_after_a_silence() -> None:
    forever = int(2.5 * LONGEST_S / FRAME_S)
    sound = frames((True, forever), (False, 25), (True, 20), (False, 25))
    found = gather(Segmenter(Loudness()), [sound.tobytes()])
    assert [u.cut for u in found] == [True, False]
    assert len(found[0].samples) <= LONGEST_S * SAMPLE_RATE_HZ
    assert found[1].speech_s == pytest.approx(20 * FRAME_S)


def test_erasing_overwrites_the_sound() -> None:
    (utterance,) = gather(Segmenter(Loudness()), [frames((True, 20), (False, 30)).tobytes()])
    buffer = utterance.samples
    assert buffer.any()
    utterance.erase()
    assert not buffer.any() and len(utterance.samples) == 0


def test_resetting_leaves_nothing_of_what_was_said(loudness: Loudness) -> None:
    segmenter = Segmenter(loudness)
    segmenter.push(frames((True, 20)).tobytes() + b"\x11" * 301)
    assert segmenter.speaking
    segmenter.reset()
    assert not segmenter.speaking and not segmenter._kept.any() and not segmenter._rest
    assert loudness.frames == 0
    assert segmenter.flush() == []


def test_samples_and_bytes_are_the_same() -> None:
    sound = frames((True, 20), (False, 30))
    one, other = (gather(Segmenter(Loudness()), [chunk]) for chunk in (sound.tobytes(), sound))
    assert np.array_equal(one[0].samples, other[0].samples)
