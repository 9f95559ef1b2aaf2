"""Slips of fingers, tongues and speech recognizers, never ones that change what is meant.

Words that carry the meaning (numbers, units, sides, comparisons, negations, conditions) stay as they are, but for case,
for the apostrophe of a negation, and for a few misspellings that nobody reads as another word.
"""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from chauffeur.models.onboard.wordings import wordings

_NUMBERS = (
    "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen "
    "seventeen eighteen nineteen twenty thirty forty fifty sixty seventy eighty ninety hundred point half quarter "
    "quarters third couple dozen twice double times percent first second another"
)
_UNITS = (
    "mph kmh km/h kph kmph m/s mps mi/h k/h m s h sec secs seconds second ft feet foot yd yds yard yards meter "
    "meters metre metres kilometer kilometers kilometre kilometres km mi mile miles hour lengths length minute "
    "minutes per"
)
_MEANT = (
    "left right leftmost rightmost straight faster slower quicker slow slowly fast quick closer nearer further "
    "farther near close tighter wider longer shorter more less much lot bit little way far high higher lower "
    "increase decrease reduce raise up down over under above below by to at least most within between minimum "
    "maximum max min and then after before once when if until unless wait in out back off on of a an not don't no "
    "never nothing neither nor without stop same keep limit as than too so into with for from or but should till"
)
_PROTECTED = frozenset(f"{_NUMBERS} {_UNITS} {_MEANT}".split())

SAFE_SLIPS: dict[str, tuple[str, ...]] = {
    "left": ("leftt", "lefft", "lfet"),
    "right": ("rigth", "rihgt", "rightt"),
    "faster": ("fasterr", "fatser", "fastr"),
    "slower": ("slowwer", "slowerr", "sloewr"),
    "closer": ("closser", "clsoer", "closerr"),
    "further": ("furthur", "futher", "furhter"),
    "nearer": ("nearrer",),
    "straight": ("straigth", "strait", "streight"),
    "slowly": ("slowley", "slowlly"),
    "don't": ("dont", "don´t"),
    "limit": ("limmit",),
}
"""Misspellings of protected words that nobody takes for another one."""
_SLIPS = frozenset(slip for slips in SAFE_SLIPS.values() for slip in slips)

_HEARD: dict[str, tuple[str, ...]] = {
    "brake": ("break",),
    "brakes": ("breaks",),
    "braking": ("breaking",),
    "lane": ("lain", "line", "laine"),
    "lanes": ("lains", "lines"),
    "gap": ("cap", "gab"),
    "there": ("their", "they're"),
    "their": ("there",),
    "they're": ("their", "there"),
    "you're": ("your",),
    "your": ("you're",),
    "it's": ("its",),
    "we're": ("were",),
    "let's": ("lets",),
    "that's": ("thats",),
    "can't": ("cant",),
    "i'd": ("id",),
    "i'm": ("im",),
    "ahead": ("a head",),
    "overtake": ("ovatake", "overtaik"),
    "overtaking": ("ovataking",),
    "intersection": ("inter section",),
    "junction": ("junktion", "juncture"),
    "shoulder": ("sholder", "shoulda"),
    "merge": ("murge", "merch"),
    "follow": ("fallow", "folow"),
    "behind": ("be hind",),
    "here": ("hear",),
    "please": ("pleas", "peas"),
    "road": ("rode",),
    "car": ("kar",),
    "cars": ("carz",),
    "speed": ("speet", "spead"),
    "accelerate": ("excelerate", "accelarate"),
    "vehicle": ("vehical", "vehicule"),
    "pace": ("paste", "pase"),
    "cruise": ("cruze", "crews"),
    "distance": ("distants", "distence"),
    "turn": ("tern",),
    "gas": ("gaz",),
    "would": ("wood",),
    "train": ("trane",),
    "flight": ("flite",),
    "late": ("layt",),
    "sick": ("sik",),
    "guy": ("gai",),
    "truck": ("truk",),
    "lorry": ("lory",),
    "pedal": ("peddle",),
    "steady": ("steddy",),
    "maintain": ("main tain", "maintane"),
    "hurry": ("hury",),
    "safe": ("saif",),
    "driver": ("drive her",),
}
_SHORT: tuple[tuple[str, str], ...] = (
    (r"\byou\b", "u"),
    (r"\bplease\b", "pls"),
    (r"\bplease\b", "plz"),
    (r"\bare you\b", "r u"),
    (r"\bgoing to\b", "gonna"),
    (r"\bwant to\b", "wanna"),
    (r"\bhave to\b", "gotta"),
    (r"\bI would\b", "I'd"),
    (r"\bI would like\b", "I'd like"),
    (r"\bwe are\b", "we're"),
    (r"\bit is\b", "it's"),
    (r"\bthat is\b", "that's"),
    (r"\bdo not\b", "don't"),
    (r"\bbecause\b", "cos"),
    (r"\bthanks\b", "thx"),
    (r"\bokay\b", "ok"),
    (r"\bgive me\b", "gimme"),
    (r"\bkind of\b", "kinda"),
    (r"\bwhat are you\b", "whatcha"),
    (r"\bthe (?=car|gap|road|speed|truck|junction|intersection)", ""),
    (r"\bgoing\b", "goin"),
    (r"\bdriving\b", "drivin"),
    (r"\bcould you\b", "cud you"),
    (r"\bthe\b", "da"),
    (r"\bsomething\b", "sth"),
)
_FULL: tuple[tuple[str, str], ...] = (
    (r"\b(I)'m\b", r"\1 am"),
    (r"\b(you|we|they)'re\b", r"\1 are"),
    (r"\b(it|that|there|he|she|what|where|who)'s (?!got\b|been\b|had\b|gone\b|\w+ed\b)", r"\1 is "),
    (r"\b(I|you|we|they)'ve\b", r"\1 have"),
    (r"\b(I|you|we|they|he|she|it|that)'ll\b", r"\1 will"),
    (r"\b(I|you|we)'d (?=like|love|rather|prefer|want|be)", r"\1 would "),
    (r"\bcan't\b(?! (?:you|we)\b)", "cannot"),
    (r"\bwon't\b(?! (?:you|it)\b)", "will not"),
    (
        r"\b(do|does|did|is|are|was|were|have|has|had|should|would|could|need)n't\b"
        r"(?! (?:you|we|it|they|there|he|she)\b)",
        r"\1 not",
    ),
    (r"\b(L|l)et's\b", r"\1et us"),
)
"""Contractions said in full: recognizers and careful people write so."""
_FILLERS = ("um", "uh", "er", "like", "you know", "uhm", "well", "ehm", "hmm", "let's see")
_KEYS = ("qwertyuiop", "asdfghjkl", "zxcvbnm")
_NEAR: dict[str, str] = {
    key: "".join(
        _KEYS[r][c]
        for r in (row - 1, row, row + 1)
        for c in (column - 1, column, column + 1)
        if 0 <= r < 3 and 0 <= c < len(_KEYS[r]) and _KEYS[r][c] != key
    )
    for row, keys in enumerate(_KEYS)
    for column, key in enumerate(keys)
}
_PAUSES = re.compile(
    rf"(?<!\bone)[,.!?;:]+(?=\s|$)|[,.!?;:]+(?=\s|$)(?!\s(?:\d|{_NUMBERS.replace(' ', '|')}))", re.IGNORECASE
)
"""Commas and stops, but not in "quick one, sixty": without it that is another number."""
_TOKEN = re.compile(r"^(\W*)(.*?)(\W*)$")


def said_in_full(text: str) -> str:
    """The sentence without contractions: "I'm late" becomes "I am late"; the wish is the same."""
    for pattern, by in _FULL:
        text = re.sub(pattern, by, text)
    return text


def noisy(text: str, rng: np.random.Generator, level: int) -> str:
    """The text as it may arrive.

    Args:
        text: A sentence.
        rng: Random draws.
        level: 0 leaves it as it is, 1 adds a slip or two, 2 several.
    """
    if level <= 0:
        return text
    words = text.split()
    heard = rng.random() < 0.5
    for _ in range(int(rng.integers(1, 3)) if level == 1 else int(rng.integers(2, 6))):
        draw = rng.random()
        if draw < 0.4:
            words = _misheard(words, rng) if heard else _mistyped(words, rng)
        elif draw < 0.52:
            words = _slipped(words, rng)
        elif draw < 0.7:
            words = _stammered(words, rng) if heard else _shortened(words, rng)
        elif draw < 0.85:
            words = _shortened(words, rng)
        else:
            words = _mistyped(words, rng)
    text = " ".join(words)
    # a recognizer writes neither commas nor capitals
    if rng.random() < (0.85 if heard else 0.35):
        text = _PAUSES.sub("", text)
    draw = rng.random()
    if draw < (0.85 if heard else 0.5):
        text = text.lower()
    elif draw > 0.97:
        text = text.upper()
    return re.sub(r"\s+", " ", text).strip() or text


def protected(word: str) -> bool:
    """Whether a word keeps its spelling, but for the safe slips; punctuation around it does not matter."""
    core = _core(word).lower().replace("’", "'")
    if any(c.isdigit() for c in core) or "n't" in core:
        return True
    return any(part in _PROTECTED or part in _SLIPS for part in (core, *core.split("-")))


def _core(word: str) -> str:
    found = _TOKEN.match(word)
    return found[2] if found else word


@cache
def _vocabulary() -> frozenset[str]:
    """Words of the tables: a slip that makes one of them might mean something else."""
    found: set[str] = set()
    grammar = wordings()
    for section in grammar.sections():
        for template in grammar.templates(section):
            found.update(re.findall(r"[a-z']+", grammar.text(template).lower()))
    return frozenset(found) | {"last", "blow", "past", "cost", "step", "crash", "brush", "plow", "rive", "fats"}


def _open(words: list[str], least: int = 1) -> list[int]:
    return [i for i, word in enumerate(words) if len(_core(word)) >= least and not _kept(words, i)]


def _kept(words: list[str], i: int) -> bool:
    """Whether the word stays as it is; the car of "car lengths" is a unit too."""
    return protected(words[i]) or (i + 1 < len(words) and _core(words[i + 1]).lower() in ("length", "lengths"))


def _one(choices: list[int], rng: np.random.Generator) -> int:
    return choices[int(rng.integers(len(choices)))]


def _mistyped(words: list[str], rng: np.random.Generator) -> list[str]:
    """One wrong key, two swapped letters, a letter too few or too many."""
    where = _open(words, 4)
    if not where:
        return words
    i = _one(where, rng)
    found = _TOKEN.match(words[i])
    assert found is not None
    before, core, after = found.groups()
    k = int(rng.integers(1, len(core)))
    kind = int(rng.integers(4))
    letter = core[k].lower()
    if not letter.isalpha() or not letter.isascii():
        return words
    if kind == 0:
        near = _NEAR[letter]
        changed = core[:k] + near[int(rng.integers(len(near)))] + core[k + 1 :]
    elif kind == 1 and k + 1 < len(core) and core[k + 1].isalpha():
        changed = core[:k] + core[k + 1] + core[k] + core[k + 2 :]
    elif kind == 2:
        changed = core[:k] + core[k + 1 :]
    else:
        changed = core[:k] + core[k] + core[k:]
    if changed.lower() in _vocabulary() or protected(changed):
        return words
    return [*words[:i], before + changed + after, *words[i + 1 :]]


def _slipped(words: list[str], rng: np.random.Generator) -> list[str]:
    """A safe misspelling of a word that is otherwise protected."""
    where = [i for i, word in enumerate(words) if _core(word).lower() in SAFE_SLIPS]
    if not where:
        return words
    i = _one(where, rng)
    core = _core(words[i])
    slips = SAFE_SLIPS[core.lower()]
    return [*words[:i], words[i].replace(core, slips[int(rng.integers(len(slips)))]), *words[i + 1 :]]


def _misheard(words: list[str], rng: np.random.Generator) -> list[str]:
    where = [i for i, word in enumerate(words) if _core(word).lower() in _HEARD and not _kept(words, i)]
    if not where:
        return _stammered(words, rng)
    i = _one(where, rng)
    core = _core(words[i])
    options = _HEARD[core.lower()]
    heard = words[i].replace(core, options[int(rng.integers(len(options)))])
    return [*words[:i], *heard.split(), *words[i + 1 :]]


def _stammered(words: list[str], rng: np.random.Generator) -> list[str]:
    """A filler, a word said twice, or a false start. None of it stands beside a number or a negation."""
    kind = int(rng.integers(3))
    if kind == 0:
        where = [i for i in range(len(words)) if not _kept(words, i) and (i == 0 or not _kept(words, i - 1))]
        if not where:
            return words
        i = _one(where, rng)
        filler = _FILLERS[int(rng.integers(len(_FILLERS)))]
        return [*words[:i], filler + ("," if i == 0 and rng.random() < 0.5 else ""), *words[i:]]
    where = _open(words, 2 if kind == 1 else 4)
    if not where:
        return words
    i = _one(where, rng)
    core = _core(words[i])
    begun = core if kind == 1 else core[: int(rng.integers(2, 4))]
    # "s-" before a number's end would be a unit, "so-" a word of its own
    return words if protected(begun) else [*words[:i], begun + ("" if kind == 1 else "-"), *words[i:]]


def _shortened(words: list[str], rng: np.random.Generator) -> list[str]:
    text = " ".join(words)
    order = rng.permutation(len(_SHORT))
    for k in order:
        pattern, by = _SHORT[int(k)]
        if re.search(pattern, text):
            return re.sub(pattern, by, text, count=1).split()
    return words
