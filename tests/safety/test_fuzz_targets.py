"""The fuzzing targets of `benchmarks/fuzz` hold for some of their seeds and a few changed ones; no fuzzer is needed."""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from fuzz.target import BrokenError, bytes_of, expect, text_of
from fuzz.targets import MODULES, target

SEEDS, CHANGED = 6, 12


@pytest.mark.parametrize("name", MODULES)
def test_targets_hold_for_their_seeds_and_changes_of_them(name: str) -> None:
    fuzzed = target(name)
    assert fuzzed.name == name
    assert fuzzed.invariant.endswith(".")
    seeds = [*fuzzed.seeds()]
    assert len(seeds) == len({*seeds}) >= 5
    rng = random.Random(len(name))
    inputs = [rng.choice(seeds) for _ in range(SEEDS)]
    inputs += [fuzzed.changed(data, random.Random(number)) for number, data in enumerate(2 * inputs)]
    for data in inputs[: SEEDS + CHANGED]:
        assert fuzzed.examine(data)


@pytest.mark.parametrize("name", MODULES)
def test_the_same_seed_makes_the_same_change(name: str) -> None:
    fuzzed = target(name)
    one = next(iter(fuzzed.seeds()))
    assert fuzzed.changed(one, random.Random(3)) == fuzzed.changed(one, random.Random(3))
    assert len({fuzzed.changed(one, random.Random(number)) for number in range(20)}) > 10


def test_the_modules_that_guide_are_there() -> None:
    source = Path(__file__).resolve().parents[2] / "src"
    for name in MODULES:
        for read in target(name).reads:
            path = source.joinpath(*read.split("."))
            assert path.is_dir() or path.with_suffix(".py").is_file(), read


def test_any_bytes_are_a_text_and_any_text_is_bytes() -> None:
    for data in (b"", b"abc", b"\xff\xfe", "ü\ud800".encode("utf-8", "surrogatepass"), b"\xed\xa0"):
        assert isinstance(text_of(data), str)
    for text in ("", "ü", "\ud800", "\udcff", "\U0001f642"):
        assert text_of(bytes_of(text)) == text


def test_an_invariant_that_does_not_hold_is_told() -> None:
    expect(1, "never")
    with pytest.raises(BrokenError, match="it broke"):
        expect((), "it broke")
