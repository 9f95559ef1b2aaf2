"""German, Spanish, French and Chinese: the commonest acts are read whole or not at all; English stays English."""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path

import pytest

from chauffeur.concept import NOBODY, Limits
from chauffeur.driving.emergency import EMERGENCY_PLANNER
from chauffeur.driving.scenarios import find, suiting
from chauffeur.driving.session import Session, parse_wish
from chauffeur.language.emergency import read_emergency
from chauffeur.language.languages.reader import LANGUAGES, help_question, language_of, read_call, read_other
from chauffeur.planners.registry import make_planner

REAL = Path("/work/shared/data/commands")
NAMES = dict(zip(("de", "es", "fr", "zh"), LANGUAGES, strict=True))
SENTENCES = {
    "slower": "Slow down.",
    "faster": "Drive faster.",
    "turn.left": "Turn left at the next intersection.",
    "turn.right": "Turn right at the next intersection.",
    "lane.left": "Change to the left lane.",
    "lane.right": "Change to the right lane.",
    "overtake": "Overtake the vehicle ahead.",
    "gap": "Keep more distance to the vehicle ahead.",
    "pull_over": "Pull over.",
    "park": "Park the car.",
    "follow": "Follow the vehicle ahead.",
}


def commands(name: str) -> list[tuple[str, str, str]]:
    """(language, label, text) of a file of labelled commands."""
    lines = (Path(__file__).parent / f"languages_{name}.tsv").read_text(encoding="utf-8").splitlines()
    return [(one, label, text) for one, label, text in (line.split("\t") for line in lines if line[0] != "#")]


DEV, HELD_OUT = commands("dev"), commands("heldout")
CALLS = [one for one in (*DEV, *HELD_OUT) if one[1] in ("stop", "help")]


def sentence_of(label: str) -> str:
    act, _, value = label.partition(":")
    return f"Drive at {value} km/h." if value else SENTENCES[act]


@pytest.mark.parametrize(("language", "label", "text"), CALLS)
def test_a_call_reaches_the_emergency_answer(language: str, label: str, text: str) -> None:
    found = read_emergency(text)
    assert found is not None and found.alone
    assert found.kind == {"stop": "stop", "help": "ask"}[label]


@pytest.mark.parametrize(("language", "label", "text"), [one for one in DEV if one[1] not in ("stop", "help", "none")])
def test_a_command_is_read_as_the_english_sentence_of_its_act(language: str, label: str, text: str) -> None:
    found = read_other(text)
    assert found is not None
    assert (found.language, found.english) == (NAMES[language], sentence_of(label))
    assert read_emergency(text) is None


@pytest.mark.parametrize(("language", "label", "text"), HELD_OUT)
def test_what_the_table_has_not_is_never_another_act(language: str, label: str, text: str) -> None:
    found = read_other(text)
    if found is None or not found.english:
        return
    assert label not in ("help", "none")
    assert label == "stop" or found.english == sentence_of(label)


@pytest.mark.parametrize(
    ("text", "language"),
    [(text, NAMES[one]) for one, label, text in (*DEV, *HELD_OUT) if label == "none" and text != "N'accélère plus"]
    + [
        ("Nicht anhalten!", "german"),
        ("¡No pares nunca!", "spanish"),
        ("别停车", "chinese"),
        ("Turn left nicht", "german"),
        ("Don't links abbiegen, fahr rechts", "german"),
        ("change lanes, aber nicht jetzt", "german"),
        ("左转 please 不要", "chinese"),
    ],
)
def test_a_denial_or_a_condition_is_no_act_and_no_stop(text: str, language: str) -> None:
    found = read_other(text)
    assert found is not None and (found.language, found.english) == (language, "")
    assert read_call(text) is None


@pytest.mark.parametrize(
    "text",
    [
        "Biegst du links ab?",
        "Links?",
        "À droite ?",
        "Sie fahren schneller",
        "Fahr 5 km/h schneller",
        "Fahr fünfundfünfzig",
        "Roule à 50,5 km/h",
        "Ve a 50 millas por hora",
        "Bieg links ab und dann rechts",
        "开到每小时五十五公里",
    ],
)
def test_a_question_an_unknown_amount_and_a_second_act_are_not_read(text: str) -> None:
    found = read_other(text)
    assert found is None or not found.english


@pytest.mark.parametrize(
    "text",
    [
        "park",
        "stop",
        "double it",
        "300 km/h",
        "120!",
        "reduce by 20",
        "Slower, la la la.",
        "Overtake him, por favor.",
        "Bitte overtake this car.",
        "Más rápido, please, how you say, faster.",
        "Take me to San José",
        "Drive to the Rue de Rivoli",
        "Turn left on Königstraße, then park near Café de la Paix",
        "Take me to 北京路 please",
        "",
        "🙂",
    ],
)
def test_english_with_names_and_loan_words_stays_english(text: str) -> None:
    assert language_of(text) is None and read_other(text) is None and read_call(text) is None


@pytest.mark.skipif(not REAL.is_dir(), reason="the real commands are not on this machine")
def test_real_english_commands_are_taken_for_english() -> None:
    texts = [line for file in sorted(REAL.glob("*.txt")) for line in file.read_text(encoding="utf-8").splitlines()]
    for file in sorted(REAL.glob("*.jsonl")):
        texts += [json.loads(line)["text"] for line in file.read_text(encoding="utf-8").splitlines()]
    assert len(texts) > 4000
    assert [text for text in texts if read_other(text) is not None or read_call(text) is not None] == []


@pytest.mark.parametrize("text", ["日本語で話します、止まれ", "멈춰 주세요", "Na skrzyżowaniu w lewo."])
def test_other_languages_are_none_of_the_four(text: str) -> None:
    assert language_of(text) is None


def test_reading_is_linear() -> None:
    read_other("links"), read_call("links")  # the tables are compiled once
    begun = time.process_time()
    for word in ("links ", "da ist ein kind ", "stopp ", "停", "un poco ", "快"):
        read_other(word * 1000)
        read_call(word * 1000)
        read_other((word * 1000)[:200])
        read_call((word * 1000)[:200])
    assert time.process_time() - begun < 2.0


def drive(text: str, place: str):
    session = Session(planner=make_planner("onboard"), max_s=0.1)
    scenario = find(place)
    return asyncio.run(session.drive(parse_wish(text, NOBODY), scenario, scenario.seed, Limits())).trip


def test_the_plan_says_what_was_read_in_the_persons_language() -> None:
    trip = drive("Bitte an der nächsten Kreuzung links abbiegen.", "intersection")
    assert trip.plan.intent == "turn.left" and trip.plan.policy is not None
    assert trip.plan.thoughts.text.startswith("Ich lese: an der nächsten Kreuzung links abbiegen.")
    assert suiting("Bitte an der nächsten Kreuzung links abbiegen.").id == "intersection"


def test_what_is_not_read_is_told_in_the_persons_language_and_asks_no_planner() -> None:
    trip = drive("Ne tourne pas à gauche.", "intersection")
    assert trip.plan.policy is None and trip.plan.intent == "ask" and "en anglais" in trip.plan.refusal


def test_a_call_for_help_is_asked_in_the_persons_language() -> None:
    trip = drive("¡Socorro!", "overtake")
    assert trip.plan.planner == EMERGENCY_PLANNER
    assert trip.plan.refusal == help_question("spanish")
