"""The linear reader beside the networks: fitted until it converges, its regularisation chosen on writers never met."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

pytest.importorskip("sklearn")
pytest.importorskip("torch")

from chauffeur.models.vilad.baseline import linear_reader
from chauffeur.models.vilad.driving_recipe import DRIVING, drive_cases
from chauffeur.models.vilad.driving_words import BANK as DRIVES
from chauffeur.models.vilad.evaluation import solved
from chauffeur.models.vilad.parking_recipe import PARKING, cases
from chauffeur.models.vilad.parking_words import BANK as PARKS


@pytest.mark.parametrize("bank", [PARKS, DRIVES])
def test_writers_that_choose_are_not_those_that_fit(bank) -> None:
    shared = 0
    for section, kinds in {(one.section, one.kind) for one in bank.lines}:
        fit, tune, train = (set(bank.phrases(section, kinds, split)) for split in ("fit", "tune", "train"))
        assert fit | tune == train
        shared += len(fit & tune)
    assert shared < 10  # short phrases that two writers thought of


@pytest.mark.parametrize(
    ("task", "tests", "success", "understood"),
    [(PARKING, cases, (82.0, 55.0), (65.0, 40.0)), (DRIVING, drive_cases, (95.0, 85.0), (90.0, 70.0))],
    ids=["parking", "driving"],
)
def test_the_reader_is_trained_to_the_end(task, tests, success, understood) -> None:
    """A reader of 72 optimiser steps understood 30 % of what it had been trained on."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a fit that did not converge warns
        reader = linear_reader(task, 5, commands=1_500)
    for split, least, read in zip(("seen", "phrasing"), success, understood, strict=True):
        found = solved(reader, tests(split, 150, 9))
        assert found[0] >= least and found[1] >= read, (split, found)


def test_the_same_seed_gives_the_same_reader() -> None:
    readers = [linear_reader(PARKING, 5, commands=200) for _ in range(2)]
    texts = [PARKING.command(np.random.default_rng(seed)).text for seed in range(20)]
    assert readers[0].read(texts) == readers[1].read(texts) == [readers[0](text) for text in texts]
    assert readers[0].inverse_strength == readers[1].inverse_strength


def test_what_training_never_asks_for_is_constant() -> None:
    class Narrow:
        criteria = ("lift",)

        def command(self, rng, split="train"):
            return PARKING.command(rng, split)

    class Silent(Narrow):
        def command(self, rng, split="train"):
            one = PARKING.command(rng, split)
            return type(one)(one.text, {**one.asked, "lift": "none"})

    assert set(linear_reader(Narrow(), 1, commands=100)("Park near the lift.")) == {"lift"}
    assert linear_reader(Silent(), 1, commands=100)("Park near the lift.") == {"lift": "none"}
