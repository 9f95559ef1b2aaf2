"""Clauses of texts: where one begins, what kind of statement it is, and whether something in it is denied."""

from __future__ import annotations

import pytest
from faithfulness_programs import HIGHWAY

from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness import judge, read_facts
from chauffeur.safety.faithfulness.clauses import ExplainedClause, clauses_of


def short(clause: ExplainedClause) -> str:
    """What it begins with, if anything, its kind, whether it is denied, and its words."""
    opener = f"{clause.opener} / " if clause.opener else ""
    return f"{opener}{clause.mood}{' not' if clause.negated else ''}: {' '.join(clause.words)}"


def test_a_clause_knows_its_sentence_and_the_quantities_there() -> None:
    text = " We wait half a minute, and drive 20 m/s. We stop! “Wait a minute ” Then go (once)."
    one, two = Quantity(30.0, "time", "30 seconds"), Quantity(20.0, "speed", "20 m/s")
    first = "We wait half a minute, and drive 20 m/s."
    assert clauses_of(text) == (
        ExplainedClause(first, 0, ("we", "wait", "#0"), (one, two), "plan", ""),
        ExplainedClause(first, 0, ("drive", "#1"), (one, two), "plan", "and"),
        ExplainedClause("We stop!", 1, ("we", "stop"), (), "plan", ""),
        ExplainedClause("Wait a minute", 2, ("wait", "#0"), (Quantity(60.0, "time", "60 seconds"),), "wish", ""),
        ExplainedClause("Then go (once).", 3, ("go",), (), "plan", "then"),
    )


def test_words_and_phrases_of_a_clause() -> None:
    (clause,) = clauses_of("We slow down for the left lane.")
    speed, lane, car = frozenset({"slow", "fast"}), frozenset({"lane"}), frozenset({"car"})
    assert clause.has(speed)
    assert clause.has(lane, speed)
    assert not clause.has(car)
    assert not clause.has(lane, car)
    assert clause.says("slow down")
    assert clause.says("speed up", "left lane")
    assert clause.says("we")
    assert not clause.says("low down")
    assert not clause.says("down for the le")
    assert not clause.says("left car", "car")


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("<think>We go left.</think> *We* `stop`.", ["plan: we go left", "plan: we stop"]),
        (
            "1. We go left. 2) We stop. Step 3: We brake.",
            ["next / plan: we go left", "next / plan: we stop", "next / plan: we brake"],
        ),
        ("(1) We go left", ["next / plan: we go left"]),
        (
            'You said "go left" and «stop» and “brake”. We stop.',
            ["wish: you said", "wish: go left", "wish: stop", "wish: brake", "plan: we stop"],
        ),
        ("We go left; we stop; then we brake.", ["plan: we go left", "plan: we stop", "then / plan: we brake"]),
        (
            "We go left -> we stop → we brake\nWe speed up",
            ["plan: we go left", "plan: we stop", "plan: we brake", "plan: we speed up"],
        ),
        (
            "We go left, i.e. we stop, e.g. we brake, etc. We speed up.",
            ["plan: we go left", "plan: we stop", "plan: we brake", "plan: we speed up"],
        ),
        ("We go left! Do we? We do.", ["plan: we go left", "thought: do we", "plan: we do"]),
        ('"..." and "!"', []),
    ],
)
def test_sentences_are_told_apart(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("We wait half a minute, then one minute.", ["plan: we wait #0", "then / plan: #1"]),
        ("We brake at the moment of it.", ["state: we brake currently of it"]),
        ("We leave it just as it is now, we go left.", ["plan: we leave it unchanged", "plan: we go left"]),
        ("We brake with 2 m/s² to 3 m/s^2 and go left.", ["plan: we brake with to", "and / plan: go left"]),
        ("Left-to-right traffic comes.", ["state: traffic comes"]),
        ("Right now we stop, right after that all right.", ["plan: we stop", "plan: that"]),
        ("We stop from now on, clear of it.", ["plan: we stop", "plan: it"]),
        ("We recover_from_stop() with autopilot().", ["plan: we with"]),
        ("We call turn_left(now) and set_lane(left).", ["plan: we call turn left now", "and / plan: set lane left"]),
        ("We go left (we stop) - we brake.", ["plan: we go left", "plan: we stop", "plan: we brake"]),
        ("We go left (we stop)- we brake.", ["plan: we go left", "plan: we stop", "plan: we brake"]),
        ("We stop (- we brake).", ["plan: we stop", "plan: we brake"]),
        ("_Don't go left_ and _can't stop_.", ["plan not: do not go left", "and / plan not: can not stop"]),
        ("Speed +5 m/s.", ["plan: speed plus #0"]),
    ],
)
def test_what_is_written_in_another_way_is_read_alike(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        (
            "We go left, we stop: we brake. Why: we stop.",
            ["plan: we go left", "plan: we stop", ": / plan: we brake", "plan: why", ": / plan: we stop"],
        ),
        ("We go left and stop or brake.", ["plan: we go left", "and / plan: stop", "or / plan: brake"]),
        ("If and when the lane is free, we go left.", ["when / condition: the lane is free", "plan: we go left"]),
        ("If, and only if, it is free, we go left.", ["only if / condition: it is free", "plan: we go left"]),
        ("Once and then again free, we go left.", ["once / condition: again free", "plan: we go left"]),
        ("Then once it is free and then we go left.", ["once / condition: it is free", "and then / plan: we go left"]),
        ("And then, if free: go.", ["if / condition: free", ": / plan: go"]),
        (", we stop.", ["plan: we stop"]),
        ("After stopping we turn left.", ["after / condition: stopping", "plan: we turn left"]),
        ("Once past the truck we go left.", ["once / condition: past the truck we go left"]),
        ("When it is we go left.", ["when / condition: it is we go left"]),
        ("When that is reached I go left.", ["when / condition: that is reached", "plan: i go left"]),
        ("If the lane is where we go left.", ["if / condition: the lane is", "where / plan: we go left"]),
        ("If this is what we want, we go left.", ["if / condition: this is what we want", "plan: we go left"]),
        ("When all lanes are free we go left.", ["when / condition: all lanes are free", "plan: we go left"]),
        ("Once the truck has passed we go left.", ["once / condition: the truck has passed", "plan: we go left"]),
        ("When all have passed we go left.", ["when / condition: all have passed", "plan: we go left"]),
        ("Once the gap gets large we go left.", ["once / condition: the gap gets large", "plan: we go left"]),
        ("If there is a car you go left.", ["if / condition: there is a car you go left"]),
        ("Then there is room we take.", ["then / state: there is room we take"]),
        ("We slow down without changing lanes.", ["plan: we slow down", "and / plan not: without changing lanes"]),
        ("We go left without ever braking.", ["plan: we go left without ever braking"]),
        ("We stop turning without delay.", ["plan: we stop turning without delay"]),
        ("Without braking we go left.", ["plan not: without braking", "plan: we go left"]),
        ("Without hurry I go left.", ["plan not: without hurry", "plan: i go left"]),
        (
            "Without leaving the lane we are in, we stop.",
            ["state not: without leaving the lane we are in", "plan: we stop"],
        ),
        ("We stop without leaving what we have.", ["plan: we stop", "and / plan: without leaving what we have"]),
        ("We stop without", ["plan: we stop without"]),
    ],
)
def test_where_a_clause_begins(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("We go left and right.", ["plan: we go left and right"]),
        ("We go left or right.", ["plan: we go left or right"]),
        ("We turn in left direction and right direction.", ["plan: we turn in left direction and right direction"]),
        ("We look at both or left.", ["plan: we look at both or left"]),
        ("We change lane and speed.", ["plan: we change lane and speed"]),
        ("We change speed and headway.", ["plan: we change speed and headway"]),
        ("We change headway and lane.", ["plan: we change headway and lane"]),
        ("And left we go to the right", ["and / plan: left we go to the right"]),
        ("We go left and we stop.", ["plan: we go left", "and / plan: we stop"]),
        ("Keep the lane and the speed.", ["plan: keep the lane and the speed"]),
        ("Keep it or the lane.", ["plan: keep it or the lane"]),
        ("We keep it and speed as they are.", ["plan: we keep it and speed unchanged"]),
        ("We keep lane and go left.", ["plan: we keep lane", "and / plan: go left"]),
        (
            "We keep at the very left side there and the speed.",
            ["plan: we keep at the very left side there", "and / plan: the speed"],
        ),
        ("We keep it calm and at the same lane.", ["plan: we keep it calm", "and / plan: at the same lane"]),
        ("We change it and the speed.", ["plan: we change it", "and / plan: the speed"]),
        ("We go at such speed as we like.", ["plan: we go at such speed as we like"]),
        ("We stay in the lane as it is free.", ["plan: we stay in the lane as it is free"]),
        ("We go as fast as the road allows.", ["plan: we go as fast as the road allows"]),
        ("We stop as quickly as it is safe.", ["plan: we stop as quickly as it is safe"]),
        ("We go slow as the truck does.", ["plan: we go slow as the truck does"]),
        ("We go slowly as this is asked.", ["plan: we go slowly as this is asked"]),
        ("We follow as far as the road goes.", ["plan: we follow as far as the road goes"]),
        ("We brake as the truck brakes.", ["plan: we brake", "as the / reason: truck brakes"]),
        ("We take the lane to which it goes.", ["plan: we take the lane to which it goes"]),
        ("We take the lane in which it goes.", ["plan: we take the lane in which it goes"]),
        ("We take the lane of which it spoke.", ["plan: we take the lane of which it spoke"]),
        ("We take the lane on which it drives.", ["plan: we take the lane on which it drives"]),
        ("We brake, which is safe.", ["plan: we brake", "which / reason: is safe"]),
        ("We turn at the next intersection.", ["plan: we turn at the next intersection"]),
        ("We turn at the next crossing.", ["plan: we turn at the next crossing"]),
        ("We turn at the next junction.", ["plan: we turn at the next junction"]),
        ("We take the next lane.", ["plan: we take the next lane"]),
        ("We let the next car pass.", ["plan: we let the next car pass"]),
        ("We let the next vehicle pass.", ["plan: we let the next vehicle pass"]),
        ("We stop next to the truck.", ["plan: we stop next to the truck"]),
        ("We go left, next we brake.", ["plan: we go left", "next / plan: we brake"]),
        ("We make later checks.", ["plan: we make later checks"]),
        ("We stop at a later safe place.", ["plan: we stop at a later safe place"]),
        ("At a later moment we stop.", ["state: at a later moment we stop"]),
        ("We take the first lane.", ["plan: we take the first lane"]),
        ("We brake first, later we stop.", ["plan: we brake", "later / plan: we stop"]),
        ("We stop no later than at the sign.", ["plan: we stop no later than at the sign"]),
        ("We brake, not later than now.", ["plan: we brake", "plan: not later than now"]),
        ("We stop later than you.", ["plan: we stop", "later / wish: than you"]),
        ("We stop before.", ["plan: we stop before"]),
        ("We stop after", ["plan: we stop after"]),
        ("We brake before we stop.", ["plan: we brake", "before / plan: we stop"]),
    ],
)
def test_words_that_join_two_words_begin_no_clause(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("You want to go left.", ["wish: you want to go left"]),
        ("The passenger asks us to go left.", ["wish: the passenger asks us to go left"]),
        ("As you asked we go left.", ["plan: as you asked we go left"]),
        ("As you asked I go left.", ["plan: as you asked i go left"]),
        ("Like you we keep left.", ["plan: like you we keep left"]),
        ("As you asked us both we go left.", ["wish: as you asked us both we go left"]),
        ("You see we go left.", ["plan: you see we go left"]),
        ("I think you like it.", ["plan: i think you like it"]),
        ("We think you like it.", ["plan: we think you like it"]),
        ("With all that speed you get slow.", ["plan: with all that speed you get slow"]),
        ("With all that care you get slow.", ["plan: with all that care you get slow"]),
        ("The slow way the passenger likes.", ["wish: the slow way the passenger likes"]),
        ("With some care for what the passenger likes.", ["wish: with some care for what the passenger likes"]),
        ("With some care for what the passenger does.", ["plan: with some care for what the passenger does"]),
        ("With some care for the passenger we wanted this.", ["plan: with some care for the passenger we wanted this"]),
        ("With some care for the passenger I want this.", ["plan: with some care for the passenger i want this"]),
        ("On such a quiet road passengers like it.", ["wish: on such a quiet road passengers like it"]),
        ("On such a quiet road trucks like it.", ["plan: on such a quiet road trucks like it"]),
        ("Left was wanted.", ["wish: left was wanted"]),
        ("Left was wished.", ["wish: left was wished"]),
        ("Left is desired.", ["wish: left is desired"]),
        ("Left was asked for.", ["wish: left was asked for"]),
        ("Lanes are asked for.", ["wish: lanes are asked for"]),
        ("Lanes were asked for.", ["wish: lanes were asked for"]),
        ("Left as requested.", ["wish: left as requested"]),
        ("It has been requested.", ["wish: it has been requested"]),
        ("The requested lane.", ["plan: the requested lane"]),
        ("What is requested will be left.", ["plan: what is requested will be left"]),
        ("The task: go left.", ["wish: the task", ": / wish: go left"]),
        ("You want to stop, then go left.", ["wish: you want to stop", "then / wish: go left"]),
        ("You want to stop, then we go left.", ["wish: you want to stop", "then / plan: we go left"]),
        ("You want to stop, go left.", ["wish: you want to stop", "plan: go left"]),
        ("You want this: go left. Go right.", ["wish: you want this", ": / wish: go left", "plan: go right"]),
        ("You want to be slow and quiet.", ["wish: you want to be slow", "and / wish: quiet"]),
        ("You want it. And quiet.", ["wish: you want it", "and / plan: quiet"]),
    ],
)
def test_what_somebody_wishes(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("We could go left.", ["thought: we could go left"]),
        ("We might go left.", ["thought: we might go left"]),
        ("We would like to go left.", ["plan: we would like to go left"]),
        ("It would be better to go left.", ["plan: it would be better to go left"]),
        ("We would rather go left.", ["plan: we would rather go left"]),
        ("Rather than going left, we stop.", ["rather than / reason not: going left", "plan: we stop"]),
        (
            "If it is free and quiet, we go left.",
            ["if / condition: it is free", "and / condition: quiet", "plan: we go left"],
        ),
        (
            "If it is free or quiet, we go left.",
            ["if / condition: it is free", "or / condition: quiet", "plan: we go left"],
        ),
        (
            "If it is free and at the left it is clear, we go.",
            ["if / condition: it is free", "and / plan: at the left it is clear", "plan: we go"],
        ),
        (
            "If it is free and at the left side it is clear, we go.",
            ["if / condition: it is free", "and / condition: at the left side it is clear", "plan: we go"],
        ),
        ("If it is free, quiet.", ["if / condition: it is free", "plan: quiet"]),
        ("We could stop and quietly wait.", ["thought: we could stop", "and / thought: quietly wait"]),
        (
            "We stop because it is safe and quiet.",
            ["plan: we stop", "because / reason: it is safe", "and / reason: quiet"],
        ),
        ("If free and raise the speed.", ["if / condition: free", "and / plan: raise the speed"]),
        ("If free and lower the speed.", ["if / condition: free", "and / plan: lower the speed"]),
        ("If free and accelerate.", ["if / condition: free", "and / plan: accelerate"]),
        ("If free and brake.", ["if / condition: free", "and / plan: brake"]),
        ("If free and stop.", ["if / condition: free", "and / plan: stop"]),
        ("If free and keep left.", ["if / condition: free", "and / plan: keep left"]),
        ("If free and look left.", ["if / condition: free", "and / plan: look left"]),
        ("If free and move left.", ["if / condition: free", "and / plan: move left"]),
        ("If free, 20 m/s.", ["if / condition: free", "condition: #0"]),
        ("We do it, 20 m/s.", ["plan: we do it", "plan: #0"]),
        ("20 m/s.", ["plan: #0"]),
        ("There is a car and a truck.", ["state: there is a car", "and / state: a truck"]),
        ("There is a car and go left.", ["state: there is a car", "and / plan: go left"]),
        ("Without a left lane, we stop.", ["state not: without a left lane", "plan: we stop"]),
        ("Without an exit, we stop.", ["state: without an exit", "plan: we stop"]),
        ("Without any lane left, we stop.", ["state not: without any lane left", "plan: we stop"]),
        ("Without", ["plan: without"]),
    ],
)
def test_what_is_only_thought_of_or_depends_or_gives_a_reason(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("The autopilot goes left.", ["state: the autopilot goes left"]),
        ("Our autopilot goes left.", ["plan: our autopilot goes left"]),
        ("Yield autopilot goes left.", ["plan: yield autopilot goes left"]),
        ("Calmly drives the autopilot.", ["plan: calmly drives the autopilot"]),
        ("Calmly the autopilot drives left.", ["plan: calmly the autopilot drives left"]),
        ("The car ahead goes left.", ["state: the car ahead goes left"]),
        ("The sign is red.", ["state: the sign is red"]),
        ("The maximum is 20 m/s.", ["state: the maximum is #0"]),
        ("The limit is 20 m/s.", ["state: the limit is #0"]),
        ("The road goes left.", ["state: the road goes left"]),
        ("The lane is free.", ["state: the lane is free"]),
        ("The lanes are free.", ["state: the lanes are free"]),
        ("The gap is large.", ["state: the gap is large"]),
        ("The traffic is slow.", ["state: the traffic is slow"]),
        ("I see that a car is slow.", ["plan: i see that a car is slow"]),
        ("Now we see a car is slow.", ["plan: now we see a car is slow"]),
        ("For us the car is left.", ["plan: for us the car is left"]),
        ("At our left a car is slow.", ["plan: at our left a car is slow"]),
        ("At my left a car is slow.", ["plan: at my left a car is slow"]),
        ("To set the limit that is known.", ["plan: to set the limit that is known"]),
        ("It sets the limit that is known.", ["plan: it sets the limit that is known"]),
        ("There far ahead a car is slow.", ["state: there far ahead a car is slow"]),
        ("Just there far ahead a car is slow.", ["plan: just there far ahead a car is slow"]),
        ("The limit here for all them is 20 m/s.", ["state: the limit here for all them is #0"]),
        ("The limit here for all of them is 20 m/s.", ["plan: the limit here for all of them is #0"]),
        ("The truck left.", ["plan: the truck left"]),
        ("The car turns left.", ["plan: the car turns left"]),
        ("The car stops left.", ["plan: the car stops left"]),
        ("The car turns to what is left.", ["plan: the car turns to what is left"]),
        ("The car stops at what is left.", ["plan: the car stops at what is left"]),
        ("The car is moved left.", ["plan: the car is moved left"]),
        ("The car is driven left.", ["plan: the car is driven left"]),
        ("The big car is driven left.", ["state: the big car is driven left"]),
        ("The car is slowly moved left.", ["state: the car is slowly moved left"]),
        ("The car always is moved left.", ["state: the car always is moved left"]),
        ("The car", ["plan: the car"]),
        ("A car is moved left.", ["state: a car is moved left"]),
        ("A car turns left and is slow.", ["plan: a car turns left", "and / plan: is slow"]),
        ("Cars can go left.", ["state: cars can go left"]),
        ("Cars cross there.", ["state: cars cross there"]),
        ("Cars come there.", ["state: cars come there"]),
        ("Vehicles can go left.", ["state: vehicles can go left"]),
        ("A car can go left.", ["plan: a car can go left"]),
        ("The truck will take what is free.", ["plan: the truck will take what is free"]),
        ("The truck should take what is free.", ["plan: the truck should take what is free"]),
        ("The truck must take what is free.", ["plan: the truck must take what is free"]),
        ("The truck shall take what is free.", ["plan: the truck shall take what is free"]),
        ("Moving cars is easy.", ["plan: moving cars is easy"]),
    ],
)
def test_what_is_said_of_others(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("We tell you now.", ["state: we tell you now"]),
        ("This in short tells it to the passenger.", ["state: this in short tells it to the passenger"]),
        ("This will inform in short the passenger.", ["state: this will inform in short the passenger"]),
        ("It in short informs also the passenger.", ["state: it in short informs also the passenger"]),
        ("We tell them.", ["plan: we tell them"]),
        ("It is for all of it a passenger.", ["plan: it is for all of it a passenger"]),
        ("The left is blocked.", ["state: the left is blocked"]),
        ("The left is closed.", ["state: the left is closed"]),
        ("The left is occupied.", ["state: the left is occupied"]),
        ("The left is busy.", ["state: the left is busy"]),
        ("Left is impossible.", ["state: left is impossible"]),
        ("Both are blocked.", ["state: both are blocked"]),
        ("Left busy.", ["plan: left busy"]),
        ("It is left.", ["plan: it is left"]),
        ("There is left.", ["state: there is left"]),
        ("There are left ones.", ["state: there are left ones"]),
        ("There we go.", ["plan: there we go"]),
        ("It corresponds to left.", ["state: it corresponds to left"]),
        ("It equals left.", ["state: it equals left"]),
        ("It is equivalent to left.", ["state: it is equivalent to left"]),
        ("That is left.", ["state: that is left"]),
        ("This is left.", ["state: this is left"]),
        ("At 20 m/s that is left.", ["state: at #0 that is left"]),
        ("At 20 m/s this is left.", ["plan: at #0 this is left"]),
        ("To 20 m/s that is left.", ["plan: to #0 that is left"]),
        ("Currently going left.", ["state: currently going left"]),
        ("Presently going left.", ["state: presently going left"]),
        ("Going left at that moment.", ["state: going left at that moment"]),
        ("Going left in a moment.", ["plan: going left in a moment"]),
        ("Going left at that time.", ["plan: going left at that time"]),
        ("We are left now.", ["state: we are left now"]),
        ("I am left now.", ["state: i am left now"]),
        ("I am left.", ["plan: i am left"]),
        ("We do go left now.", ["state: we do go left now"]),
        ("We drive left now.", ["state: we drive left now"]),
        ("We approach left now.", ["state: we approach left now"]),
        ("We brake left now.", ["plan: we brake left now"]),
        ("Cars drive left now.", ["plan: cars drive left now"]),
        ("Now are we left.", ["plan: now are we left"]),
        ("Now drive.", ["plan: now drive"]),
        ("We are at left.", ["state: we are at left"]),
        ("I am at left.", ["plan: i am at left"]),
        ("We drive 20 m/s.", ["state: we drive #0"]),
        ("Then we drive 20 m/s.", ["then / plan: we drive #0"]),
        ("And then we drive 20 m/s.", ["and then / plan: we drive #0"]),
        ("We stop, after that we drive 20 m/s.", ["plan: we stop", "after that / plan: we drive #0"]),
        ("We stop, after which we drive 20 m/s.", ["plan: we stop", "after which / plan: we drive #0"]),
        ("We drive 20 m/s faster.", ["plan: we drive #0 faster"]),
        ("We drive 20 m/s slower.", ["plan: we drive #0 slower"]),
        ("Then we are at left.", ["then / state: we are at left"]),
    ],
)
def test_what_already_is(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


@pytest.mark.parametrize(
    ("text", "clauses"),
    [
        ("We do not go left.", ["plan not: we do not go left"]),
        ("We go left, not right.", ["plan: we go left", "plan not: not right"]),
        ("We never go left.", ["plan not: we never go left"]),
        ("We avoid braking.", ["plan not: we avoid braking"]),
        ("We check that nobody is left.", ["plan: we check that nobody is left"]),
        ("We check that none is left.", ["plan: we check that none is left"]),
        ("We check that no one is left.", ["plan: we check that no one is left"]),
        ("We check that it is not left.", ["plan not: we check that it is not left"]),
        ("Nobody goes left.", ["plan not: nobody goes left"]),
        ("No one goes left.", ["state not: no one goes left"]),
        ("We do not only go left.", ["plan: we do not only go left"]),
        ("We go no faster than 20 m/s.", ["plan: we go no faster than #0"]),
        ("No longer left.", ["plan: no longer left"]),
        ("We brake not hard.", ["plan: we brake not hard"]),
        ("We do not really only go.", ["plan not: we do not really only go"]),
        ("We stop not", ["plan not: we stop not"]),
        ("Unless braking, go left.", ["unless / condition not: braking", "plan: go left"]),
        ("Instead of braking, go left.", ["instead of / reason not: braking", "plan: go left"]),
        ("If not left, stop.", ["if / condition not: not left", "plan: stop"]),
        ("We go left without delay.", ["plan: we go left without delay"]),
        ("We slow down without any delay.", ["plan: we slow down without any delay"]),
        ("Drive on without stopping.", ["plan: drive on", "and / plan not: without stopping"]),
        ("It is calm without lanes.", ["plan not: it is calm without lanes"]),
    ],
)
def test_what_is_denied(text: str, clauses: list[str]) -> None:
    assert [short(clause) for clause in clauses_of(text)] == clauses


LEFT = "    set_target_lane(get_left_lane(ego))\n"
STOP = "    set_target_speed(0)\n"


@pytest.mark.parametrize(
    ("text", "deed"),
    [
        ("Without braking we go left.", LEFT),
        ("Without hurry I go left.", LEFT),
        ("Without any rush we go left.", LEFT),
        ("We go left no later than now.", LEFT),
        ("We stop no later than at the sign.", STOP),
    ],
)
def test_how_or_until_when_something_is_done_does_not_deny_it(text: str, deed: str) -> None:
    facts = read_facts(f"def drive():\n    ego = get_ego_vehicle()\n{deed}    yield autopilot()\n")
    assert judge(text, facts, HIGHWAY).mismatches == ()
