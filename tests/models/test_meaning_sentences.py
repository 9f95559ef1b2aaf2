"""Sentences that the parser of meaning is trained on: labelled by writers, and wishes of the dialect said as acts."""

from __future__ import annotations

import numpy as np
import pytest

from chauffeur.concept import DataError
from chauffeur.language.meaning.symbols import END, MOST_SYMBOLS, parse, write
from chauffeur.models.meaning.banks import banks
from chauffeur.models.meaning.composer import Composed
from chauffeur.models.meaning.highway import HighwaySentences, sorted_rows
from chauffeur.models.meaning.labelled import act_of, labelled, together, varied, written
from chauffeur.models.meaning.noise import with_noise
from chauffeur.planners.meaning.dialect_acts import CONDITION_ACTS, SKILL_ACTS
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS


def _keeps_the_grammar(sentence: Composed) -> None:
    symbols = write(sentence.acts, sentence.address)
    assert len(symbols) < MOST_SYMBOLS
    assert parse([*symbols, END]) == (list(sentence.acts), sentence.address), sentence.text
    for act in sentence.acts:
        pointers = [*act.span, *(at for name in act.names for at in name)]
        pointers += [at for at in (act.value, act.event_value) if at is not None]
        assert all(0 <= at < len(sentence.words) for at in pointers), sentence.text


def test_every_labelled_line_can_be_written_and_read_back() -> None:
    assert len(written()) > 1000
    for sentence in written():
        _keeps_the_grammar(sentence)


@pytest.mark.parametrize(
    "line",
    [
        "[drop to 40|speed VALUE]",  # a number that is not marked
        "[drop to #40|speed direction:slower]",  # a mark without a number in the label
        "[follow dad|follow T K:car NAME]",
        "[turn left|turn side:left loud]",
        "<Dave> is here |U:remark",
    ],
)
def test_a_damaged_line_is_named(line: str) -> None:
    with pytest.raises(DataError):
        labelled(line)


def test_a_swapped_side_is_swapped_in_words_and_in_meaning() -> None:
    sentence = labelled("[turn left|turn side:left] behind [the car on the right|follow T K:car side:right]")
    rng = np.random.default_rng(0)
    seen = {(one.text, tuple(act.act.side for act in one.acts)) for one in (varied(sentence, rng) for _ in range(40))}
    assert seen == {
        ("turn left behind the car on the right", ("left", None)),
        ("turn right behind the car on the left", ("right", None)),
    }


def test_two_sentences_keep_their_pointers_together() -> None:
    first, second = labelled("[do #50|speed VALUE]"), labelled("[follow <Dave>|follow T K:car NAME] now")
    both = together(first, second)
    assert both is not None and both.text == "do 50. follow Dave now"
    assert [act.span for act in both.acts] == [(0, 1), (2, 3)]
    assert (both.acts[0].value, both.acts[1].names) == (1, ((3, 3),))
    assert together(labelled("[yes|yes]"), first) is None


def test_every_skill_and_condition_of_the_dialect_has_acts() -> None:
    assert SKILL_ACTS.keys() == SKILLS.keys()
    assert CONDITION_ACTS.keys() == CONDITIONS.keys()
    for skill, label in SKILL_ACTS.items():
        valued = [act_of(part)[1] for part in label.split(" + ")]
        assert any(valued) == (SKILLS[skill].takes is not None), skill


def test_wishes_on_motorways_keep_the_grammar() -> None:
    rng = np.random.default_rng(4)
    source = HighwaySentences(rng)
    for _ in range(400):
        _keeps_the_grammar(with_noise(source.sentence(), rng))
    assert len(sorted_rows()) > 8000


def test_sentences_are_the_same_for_the_same_seed() -> None:
    pytest.importorskip("torch", reason="PyTorch is not installed: pip install 'chauffeur-lab[models]'")
    from chauffeur.models.meaning.batches import SentenceSource

    texts = []
    for _ in range(2):
        source = SentenceSource(banks(), written(), np.random.default_rng(5))
        texts.append([source.draw().text for _ in range(30)])
    assert texts[0] == texts[1]
