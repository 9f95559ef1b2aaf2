"""Algorithms 1 and 2: properties for any logits, and the fast decoder against the plain one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.concept import ConfigError, DataError
from chauffeur.planners.vilad.template import (
    MASK,
    ActionSlot,
    ActionTemplate,
)
from chauffeur.planners.vilad.unmasking import (
    PAPER,
    Unmasking,
    accepted,
    distribution,
    unmask,
    unmask_many,
    unmasking,
)

WORDS = ("left", "right", "on")
PIECES = st.lists(
    st.one_of(
        st.sampled_from((";", "to", ".")),
        st.lists(st.sampled_from(WORDS), min_size=1, max_size=3, unique=True).map(tuple),
        st.none(),
    ),
    min_size=1,
    max_size=12,
)


def template_of(pieces: list[Any]) -> ActionTemplate:
    return ActionTemplate(
        tuple(
            piece if isinstance(piece, str) else ActionSlot(str(at), piece or (), pointer=piece is None)
            for at, piece in enumerate(pieces)
        )
    )


templates = PIECES.map(template_of)
hows = st.builds(
    Unmasking,
    steps=st.integers(1, 9),
    tau=st.floats(0.05, 3.0),
    base=st.sampled_from(("all", "maskable")),
)


def network(template: ActionTemplate, candidates: int, seed: int, scale: float) -> Any:
    """Any logits whatever: other ones for each sequence, the same for the same one."""

    def predict(row: Any) -> Any:
        rng = np.random.default_rng([seed, *(int(token) for token in row)])
        return (scale * rng.standard_normal((template.length, template.size + candidates))).astype(np.float32)

    return predict


@settings(max_examples=150, deadline=None)
@given(templates, hows, st.integers(1, 4), st.integers(0, 2**20), st.sampled_from((0.0, 1.0, 20.0)))
def test_unmasking_ends_keeps_what_is_fixed_and_never_revisits(
    template: ActionTemplate, how: Unmasking, candidates: int, seed: int, scale: float
) -> None:
    predict = network(template, candidates, seed, scale)
    allowed = template.allowed(candidates)
    before = template.canvas
    steps = list(unmasking(predict, template.canvas, allowed, how))
    assert len(steps) <= how.steps
    for step in steps:
        decided = before != MASK
        assert np.array_equal(step.row[decided], before[decided])
        assert step.fixed
        assert set(step.fixed) == set(np.flatnonzero((before == MASK) & (step.row != MASK)).tolist())
        # What is more certain than tau stays; of the rest only what the schedule asks for.
        sure = {int(i) for i in np.flatnonzero(~decided & (step.confidence > how.tau))}
        assert sure <= set(step.fixed)
        least = how.scheduled(template.length, int(template.maskable.sum()))
        assert len(step.fixed) <= max(1, len(sure), least)
        before = step.row
    template.validate(before, candidates)
    assert np.array_equal(before[~template.maskable], template.canvas[~template.maskable])
    again = unmask(predict, template.canvas, allowed, how)
    assert np.array_equal(again.row, before)
    assert again.passes == len(steps)
    assert (again.order[template.maskable] >= 1).all()
    assert not again.order[~template.maskable].any()


@settings(max_examples=60, deadline=None)
@given(templates, hows, st.lists(st.integers(0, 2**20), min_size=1, max_size=4))
def test_a_batch_is_decided_token_for_token_as_one_by_one(
    template: ActionTemplate, how: Unmasking, seeds: list[int]
) -> None:
    networks = [network(template, 3, seed, 2.0) for seed in seeds]
    many = len(seeds)
    found = unmask_many(
        lambda rows, which: np.stack([networks[b](row) for row, b in zip(rows, which, strict=True)]),
        np.repeat(template.canvas[None], many, axis=0),
        np.repeat(template.allowed(3)[None], many, axis=0),
        how,
    )
    for predict, fast in zip(networks, found, strict=True):
        plain = unmask(predict, template.canvas, template.allowed(3), how)
        assert np.array_equal(fast.row, plain.row)
        assert np.array_equal(fast.order, plain.order)
        assert np.allclose(fast.confidence, plain.confidence)
        assert fast.passes == plain.passes


def test_the_papers_schedule_counts_all_tokens() -> None:
    # 28 tokens of which 14 are actions, 8 steps: 4 a step as printed, 2 when only actions count.
    assert PAPER.scheduled(28, 14) == 4
    assert Unmasking(steps=8, base="maskable").scheduled(28, 14) == 2


@pytest.mark.parametrize(("tau", "scheduled", "kept"), [(0.5, 1, [0, 2, 3]), (1.0, 1, [0]), (1.0, 2, [0, 2])])
def test_what_is_surer_than_the_bound_or_scheduled_is_accepted(tau: float, scheduled: int, kept: list[int]) -> None:
    confidence = np.array([0.99, 0.2, 0.9, 0.6])
    assert accepted(np.ones(4, np.bool_), confidence, Unmasking(tau=tau), scheduled).tolist() == kept


def test_a_template_knows_its_decisions() -> None:
    template = ActionTemplate(("go", ActionSlot("way", WORDS), "to", ActionSlot("spot", pointer=True)))
    row = template.encode({"way": "right", "spot": 2})
    assert template.decode(row) == {"way": "right", "spot": 2}
    assert template.text(row) == "go right to #2"
    assert template.text(template.canvas) == "go [M] to [M]"
    with pytest.raises(DataError, match="no candidate"):
        template.validate(row, candidates=2)
    with pytest.raises(DataError, match="still masked"):
        template.decode(template.canvas)
    with pytest.raises(DataError, match="fixed"):
        template.validate([template.ids["to"], *row[1:]])
    with pytest.raises(DataError, match="cannot hold"):
        template.validate([row[0], template.ids["go"], *row[2:]])
    with pytest.raises(DataError, match="tokens"):
        template.validate(row[:-1])
    with pytest.raises(DataError, match="left, right, on"):
        template.encode({"way": "back", "spot": 0})
    with pytest.raises(DataError, match="two slots"):
        ActionTemplate((ActionSlot("a", WORDS), ActionSlot("a", WORDS)))
    with pytest.raises(ConfigError, match="at least one step"):
        Unmasking(steps=0)


def test_shares() -> None:
    shares = distribution(np.array([[0.0, np.log(3.0)], [-1e9, 0.0]], np.float64))
    assert np.allclose(shares, [[0.25, 0.75], [0.0, 1.0]])
