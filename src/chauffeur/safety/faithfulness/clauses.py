"""From a text to clauses, each with what kind of statement it is: a plan, a wish, a condition, a state, a thought."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

from chauffeur.language.quantities import Quantity, mark_quantities
from chauffeur.language.tokens import tokens_of
from chauffeur.safety.faithfulness import lexicon as words

Mood = Literal["plan", "wish", "condition", "state", "reason", "thought"]
"""A plan is what the text says is done; a wish what somebody asked for; a condition what something waits for or depends
on; a state what is; a reason why; a thought what might be done, or is asked."""

_THINKING: Final = re.compile(r"</?think(?:ing)?>|[`*]")
_LISTED: Final = re.compile(r"(?:^|(?<=[\s.;:]))\(?(?:\d{1,2}[.)]|step \d{1,2}[:.)])\s", re.IGNORECASE)
_QUOTED: Final = re.compile(r"[\"“«]([^\"”»]{1,300})[\"”»]")
_SENTENCES: Final = re.compile(r"(?<=[.!?])\s+|\n+|;(?! then)|->|→")
_ABBREVIATIONS: Final = re.compile(r"\b(i\.e|e\.g|etc|approx|ca)\.", re.IGNORECASE)
_MINUTE: Final = re.compile(r"\b(half )?(?:a|one) minute\b", re.IGNORECASE)
_MOMENT: Final = re.compile(r"\bat (?:the|this) moment\b", re.IGNORECASE)
_AS_IT_IS: Final = re.compile(
    r"\b(?:just )?(?:as|the way) (?:it|they) (?:is|are)(?: now)?(?=\s*[,.;:!]|$)", re.IGNORECASE
)
_NOISE: Final = (
    re.compile(r"(?<!\d)\d+(?:\.\d+)?\s*m/s\s*(?:2|²|\^2)(?!\d)|m/s\s*(?:2|²|\^2)(?!\d)", re.IGNORECASE),
    re.compile(r"\bleft[ _-]to[ _-]right\b|\bright[ _-]to[ _-]left\b", re.IGNORECASE),
    re.compile(
        r"(?<!the )(?<!our )\bright (?:now|away|after|here|of way|before|behind)\b|\ball right\b", re.IGNORECASE
    ),
    re.compile(r"\bfrom (?:then|now|there) on\b|\bclear of\b", re.IGNORECASE),
    re.compile(r"\brecover_from_stop(?:\(\))?|\bautopilot\(\)", re.IGNORECASE),
)


@dataclass(frozen=True, slots=True)
class ExplainedClause:
    """A clause.

    Attributes:
        sentence: The sentence it stands in, as written.
        place: Number of that sentence.
        words: Its words in plain form; `#k` stands for a quantity.
        quantities: By k, of the whole sentence.
        mood: What kind of statement it is.
        opener: What it begins with: `if`, `before`, `then`, or empty.
        negated: Whether something in it is denied.
    """

    sentence: str
    place: int
    words: tuple[str, ...]
    quantities: tuple[Quantity, ...]
    mood: Mood
    opener: str = ""
    negated: bool = False

    def has(self, *sets: frozenset[str]) -> bool:
        """Whether a word of each set stands in it."""
        return all(not one.isdisjoint(self.words) for one in sets)

    def says(self, *phrases: str) -> bool:
        """Whether one of some phrases stands in it."""
        text = f" {' '.join(self.words)} "
        return any(f" {phrase} " in text for phrase in phrases)


@lru_cache(maxsize=32)
def clauses_of(text: str) -> tuple[ExplainedClause, ...]:
    """All clauses of a text, in order."""
    return tuple(_clauses(text))


def _clauses(text: str) -> Iterator[ExplainedClause]:
    text = _ABBREVIATIONS.sub(" ", _THINKING.sub(" ", text))
    text = _LISTED.sub("\nnext, ", text)
    for place, (sentence, quoted) in enumerate(_sentences(text)):
        cleaned = sentence
        for noise in _NOISE:
            cleaned = noise.sub(" ", cleaned)
        cleaned = _MOMENT.sub(" currently ", _AS_IT_IS.sub(" unchanged ", cleaned))
        cleaned = _MINUTE.sub(lambda found: "30 seconds" if found[1] else "60 seconds", cleaned)
        cleaned = re.sub(r"(?<=\w)\(|\)|_", " ", cleaned.replace("+", " plus "))
        cleaned = re.sub(r"\s\(|\s-+\s", " , ", cleaned)
        tokens, quantities = mark_quantities(tokens_of(cleaned))
        asking = "?" in tokens
        mood: Mood = "plan"
        for opener, part in _split(tokens):
            mood = "thought" if asking else "wish" if quoted else _mood(opener, part, mood)
            yield ExplainedClause(sentence, place, tuple(part), tuple(quantities), mood, opener, _negated(opener, part))


def _sentences(text: str) -> Iterator[tuple[str, bool]]:
    """Sentences as written, and whether each is what somebody else said."""
    end = 0
    for found in _QUOTED.finditer(text):
        yield from _plain_sentences(text[end : found.start()])
        yield found[1].strip(), True
        end = found.end()
    yield from _plain_sentences(text[end:])


def _plain_sentences(text: str) -> Iterator[tuple[str, bool]]:
    for sentence in _SENTENCES.split(text):
        if re.search(r"\w", sentence):
            yield sentence.strip(), False


_ALL_OPENERS: Final = {*words.CONDITIONS, *words.REASONS, *words.BREAKS}
_OPENERS: Final[dict[str, tuple[tuple[str, ...], ...]]] = {
    first: tuple(sorted((p for p in _ALL_OPENERS if p[0] == first), key=len, reverse=True))
    for first in {p[0] for p in _ALL_OPENERS}
}
"""Words that begin a clause, by the first of them, the longest first."""


def _split(tokens: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Clauses with what each begins with."""
    opener = ""
    part: list[str] = []
    index = 0
    while index < len(tokens):
        token = tokens[index]
        phrase = _opener(tokens, index)
        if token not in _POINTS and not phrase:
            if _main_clause_begins(opener, part, token):
                yield opener, part
                opener, part = "", []
            elif part and _leaves_out(tokens, index):
                yield opener, part
                opener, part = "and", []  # "we brake | without changing lanes": what is not done, of the same kind
            part.append(token)
            index += 1
            continue
        if part:
            yield opener, part
            part, opener = [], ""
        if token in _STRONG_POINTS:
            opener = token
        # "and then once": the word that says most about the clause is kept.
        if phrase and (opener not in _CONDITION_OPENERS or " ".join(phrase) in _CONDITION_OPENERS):
            opener = " ".join(phrase)
        index += max(1, len(phrase))
    if part:
        yield opener, part


_POINTS: Final = frozenset(",:.!?;")
_STRONG_POINTS: Final = frozenset(":;")


def _main_clause_begins(opener: str, part: Sequence[str], token: str) -> bool:
    """`When that is reached | I look`: a main clause that no comma parts from what comes before it."""
    if token not in ("i", "we") or not part:
        return False
    if part[0] == "without" and not opener:
        return part[-1] not in _LINKS  # "without braking | we turn", but "without leaving the lane we are in"
    if opener not in _CONDITION_OPENERS:
        return False
    if part[0].endswith("ing"):
        return True  # "after stopping | we turn"
    if len(part) < 3:
        return False
    return part[-1] not in _LINKS and not {"is", "are", "has", "have", "gets"}.isdisjoint(part)


def _leaves_out(tokens: Sequence[str], index: int) -> bool:
    """Whether what is not done begins at a place: `without changing lanes`."""
    return tokens[index] == "without" and any(word.endswith("ing") for word in tokens[index + 1 : index + 2])


_LINKS: Final = words.listed("that says say said than where which what as way moment speed lane how and")


def _opener(tokens: Sequence[str], index: int) -> tuple[str, ...]:
    """The words at a place that begin a clause; none where they only join two words."""
    phrase = next((p for p in _OPENERS.get(tokens[index], ()) if tuple(tokens[index : index + len(p)]) == p), ())
    following = tokens[index + len(phrase)] if index + len(phrase) < len(tokens) else ""
    before = tokens[index - 1] if index else ""
    match phrase:
        case ("and",) | ("or",):
            joins = {before, following} <= {"left", "right", "direction", "both", "lane", "speed", "headway"}
            kept = bool(words.KEEPS & set(tokens[max(0, index - 6) : index]))
            joins = joins or (kept and bool({"lane", *words.SPEEDS} & set(tokens[index + 1 : index + 4])))
        case ("as", _):
            joins = before in ("speed", "lane", "fast", "quickly", "slow", "slowly", "far")
        case ("which",):
            joins = before in ("to", "in", "of", "on")
        case ("next",):
            joins = following in ("intersection", "crossing", "junction", "lane", "car", "vehicle", "to")
        case ("later",) if following == "than":
            joins = before in ("no", "not")
        case ("later",) | ("first",):
            joins = following in ("checks", "safe", "moment", "lane")
        case ("before",) | ("after",):
            joins = following in ("", *_POINTS)
        case _:
            return phrase
    return () if joins else phrase


def _mood(opener: str, part: Sequence[str], before: Mood) -> Mood:
    """What kind of statement a clause is; one that goes on (`and`, `then`) is like the one before."""
    found = set(part)
    first = set(part[:4])
    if all(word.startswith("#") for word in part):
        return before
    if opener in _CONDITION_OPENERS:
        return "condition"
    if opener in _REASON_OPENERS:
        return "reason"
    if part[:2] in (["without", "a"], ["without", "an"], ["without", "any"]):
        return "state"  # "without a left lane": what is not there, not what is not done
    if found & words.COULD and not found & {"like", "better"} and "rather" not in found:
        return "thought"
    if _is_wish(part):
        return "wish"
    later = opener in words.LATER or opener in ("and then", "after that", "after which") or found & {"faster", "slower"}
    if _is_about_others(part) or (_is_state(part) and not (later and part[1:2] == ["drive"])):
        return "state"
    if opener in (":", "then") and before == "wish" and not found & words.OURSELVES:
        return "wish"
    goes_on = opener in ("and", "or") and not first & words.OURSELVES
    if goes_on and before in ("condition", "thought", "reason", "wish", "state") and not _begins_with_deed(part):
        return before
    return "plan"


_CONDITION_OPENERS: Final = frozenset(" ".join(phrase) for phrase in words.CONDITIONS)
_REASON_OPENERS: Final = frozenset(" ".join(phrase) for phrase in words.REASONS)


def _begins_with_deed(part: Sequence[str]) -> bool:
    deeds = words.MOVES | words.UP | words.DOWN | words.RAISE | words.LOWER | words.STOPS | words.KEEPS | words.LOOKS
    return bool(part) and part[0] in deeds


def _is_wish(part: Sequence[str]) -> bool:
    start = part[:4]
    for index, word in enumerate(start):
        if word in ("i", "we"):
            return False
        if word in words.PERSONS:
            following = part[index + 1 : index + 4]
            return not {"i", "we"} & set(following)
    found = set(part)
    if found & words.PERSONS and found & (words.WISHING | {"like"}) and not found & {"i", "we"}:
        return True
    passive = bool(found & {"requested", "asked", "wanted", "wished", "desired"}) and bool(
        found & {"is", "was", "are", "were", "as", "has"}
    )
    return passive and not found & {"will"}


def _is_about_others(part: Sequence[str]) -> bool:
    """A statement about another vehicle, the road, or the limit."""
    if "autopilot" in part[:2] and part[0] not in words.OURSELVES | {"yield"}:
        return True
    for index, word in enumerate(part[:5]):
        if word in ("i", "we", "us", "our", "my", "set", "sets"):
            return False
        if word in words.VEHICLES or word in ("limit", "road", "lane", "lanes", "gap", "sign", "maximum"):
            following = part[index + 1 : index + 6]
            if part[max(0, index - 1)] == "the" and _is_done_by_us(following):
                return False
            others = _STATE_VERBS | {"can", "cross", "come"} if word in ("cars", "vehicles") else _STATE_VERBS
            verb = next((w for w in following if w in others), None)
            if verb is None:
                return False
            before = following[: following.index(verb)]
            return not {"will", "should", "must", "shall"} & set(before) and part[0] not in words.MOVES
    return False


_STATE_VERBS: Final = words.listed(
    "is are was drives travels goes does has exists hogs stands keeps runs comes means moves seems looks"
)


_MOVING: Final = words.listed("turns changes moves accelerates slows brakes merges switches overtakes")
_MOVED: Final = words.listed("moved brought stopped slowed driven")


def _is_done_by_us(following: Sequence[str]) -> bool:
    """Whether what follows `the car` tells what our own car does: `the car turns`, `the car is moved`."""
    passive = following[:1] == ["is"] and not _MOVED.isdisjoint(following[1:2])
    ours = words.STOPS | _MOVING
    return passive or (bool(following) and following[0] in ours)


def _is_state(part: Sequence[str]) -> bool:
    found = set(part)
    if found & {"tell", "tells", "inform", "informs"} and found & words.PERSONS:
        return True
    if found & {"is", "are"} and found & {"blocked", "closed", "occupied", "busy", "impossible"}:
        return True
    if part[:2] in (["there", "is"], ["there", "are"]) or found & {"corresponds", "equals", "equivalent"}:
        return True
    if part[:2] in (["that", "is"], ["this", "is"]) or (part[:1] == ["at"] and " ".join(part[2:4]) == "that is"):
        return True
    if found & {"currently", "presently"} or ("moment" in found and "at" in found):
        return True
    ours = bool(set(part[:2]) & {"we", "i"})
    if ours and part[1:2] in (["are"], ["am"], ["do"], ["drive"], ["approach"]) and (found & words.NOW):
        return True
    return ours and " ".join(part[1:3]) in _BEING


_BEING: Final = frozenset(
    {
        "are at",
        "are driving",
        "are travelling",
        "are in",
        "are #0",
        "are behind",
        "are below",
        "do #0",
        "do #1",
        "drive #0",
    }
)
"""What `we` are said to be doing already."""


_DEEDS: Final = words.MOVES | words.OVERTAKES | words.PASSES | words.STOPS | words.UP | words.DOWN | {"lane", "lanes"}


def _negated(opener: str, part: Sequence[str]) -> bool:
    if opener in ("rather than", "instead of", "unless"):
        return True
    hit = [index for index, word in enumerate(part) if word in words.NEGATIONS]
    if hit and part[hit[0]] == "without":
        # Where something is done before it, only how it is done comes after it: `without delay`.
        return words.MOVES.isdisjoint(part[: hit[0]]) and not _DEEDS.isdisjoint(part[hit[0] + 1 :])
    if not hit:
        return False
    if part[hit[0]] in ("nobody", "none", "no") and not words.LOOKS.isdisjoint(part[: hit[0]]):
        return False  # "check that nobody is beside us"
    following = part[hit[0] + 1 : hit[0] + 2]
    # "not only", "no faster than", "no longer", "no later than": nothing of what is done is denied.
    return following not in (["only"], ["faster"], ["longer"], ["later"], ["hard"])
