"""The grammar of what the offline engine hears: read rightly, and understood by the planner it is for."""

from __future__ import annotations

import numpy as np
import pytest

from chauffeur.concept import DataError
from chauffeur.driving.scenarios import BUILT_IN, suiting
from chauffeur.language.tokens import tokens_of
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.speech.grammar import SAFE_INTENTS
from chauffeur.speech.jsgf import SpeechGrammar, driving_grammar

HEAD = "#JSGF V1.0;\ngrammar test;\n"


def test_options_groups_and_rules() -> None:
    grammar = SpeechGrammar(HEAD + "public <a> = please (go | drive [very] <how>) [now]; // said\n<how> = fast | slow;")
    for said in ("please go", "please drive fast", "please drive very slow now", "please  go now "):
        assert grammar.matches("a", said)
    for not_said in ("", "please", "go now", "please drive", "please go fast", "please gonow", "please go now now"):
        assert not grammar.matches("a", not_said)
    assert grammar.words() == {"please", "go", "drive", "very", "fast", "slow", "now"}
    assert grammar.public == ("a",) and grammar.members("how") == () and grammar.members("a") == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("grammar test; public <a> = b;", "does not begin with #JSGF"),
        ("#JSGF V1.0; public <a> = b;", "no grammar declaration"),
        (HEAD + "public <a> = (b | c;", "does not close a bracket"),
        (HEAD + "public <a> = b );", "does not close a bracket"),
        (HEAD + "public <a> = b | ;", "empty alternative"),
        (HEAD + "public <a> = [];", "empty alternative"),
        (HEAD + "public <a> = /10/ b;", "'/', which is not read"),
        (HEAD + "public <a> = b*;", "not read here"),
        (HEAD + "public <a> = <b>;", "no rule <b>"),
        (HEAD + "public <a> = b <a>;", "never ends"),
        (HEAD + "nonsense;", "cannot read"),
    ],
)
def test_what_is_not_read_is_refused_in_words(text: str, words: str) -> None:
    with pytest.raises(DataError, match=words):
        SpeechGrammar(text)


def test_a_drawn_sentence_belongs_to_its_rule_and_to_no_safe_one() -> None:
    grammar = driving_grammar()
    rng = np.random.default_rng(3)
    intents = grammar.members("wish")
    assert len(intents) >= 15 and set(intents) > SAFE_INTENTS
    for intent in intents:
        for _ in range(40):
            said = grammar.sample(intent, rng)
            assert grammar.matches(intent, said) and grammar.matches("wish", said)
            assert grammar.matches("open", f"command {said}") and grammar.matches("command", said)
            assert not grammar.matches("open", said)
            assert intent in SAFE_INTENTS or not any(grammar.matches(safe, said) for safe in SAFE_INTENTS), said


def test_the_planner_understands_what_the_grammar_hears() -> None:
    grammar = driving_grammar()
    rng = np.random.default_rng(4)
    elsewhere = ("street", "destination", "weather", "park")  # what planners of towns, lots and the test track read
    intents = [intent for intent in grammar.members("wish") if intent not in elsewhere]
    said = [grammar.sample(intent, rng) for intent in intents for _ in range(30)]
    missed = [one for one in said if not meanings_said(one)]
    assert len(missed) <= 0.03 * len(said), missed
    for _ in range(20):
        assert suiting(grammar.sample("destination", rng)).world == "town"
        assert suiting(grammar.sample("weather", rng)).world == "track"


def test_what_scenarios_are_listed_with_can_be_said() -> None:
    """The first sentences that a newcomer says to the car."""
    grammar = driving_grammar()
    said = {" ".join(token for token in tokens_of(one.wish) if token[0].isalnum()) for one in BUILT_IN}
    said = {text.replace("90 km/h", "ninety kilometers per hour") for text in said}
    unknown = sorted(text for text in said if not grammar.matches("command", text))
    assert unknown == []


def test_the_safe_intents_mean_slower_and_stop() -> None:
    grammar = driving_grammar()
    rng = np.random.default_rng(5)
    for _ in range(30):
        slower = meanings_said(grammar.sample("slower", rng))
        assert slower and all(step.manoeuvre == "speed" and step.change == -1 for step in slower), slower
        stop = meanings_said(grammar.sample("stop", rng))
        assert stop and {step.manoeuvre for step in stop} <= {"stop", "pull_over"}, stop
