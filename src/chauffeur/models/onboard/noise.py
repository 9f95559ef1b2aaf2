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


_MORE = r"(?=faster|slower|closer|further|farther|quicker|nearer|more|less)"
_CHANGED = r"(?=(?:the|our|your) (?:speed|pace|tempo)\b)"
_SPACED = r"(?=(?:the|our|your) (?:gap|distance|following distance|spacing)\b)"
_ENDS = r"(?=[,.?!]|$| please| now| by | a bit| a little| a touch| a tad| a lot| slightly)"
_ALIKE: tuple[tuple[str, str], ...] = (
    (r"(?<!pick-up )(?<!pickup )(?:truck|lorry)", "truck|lorry|HGV|juggernaut|artic|semi"),
    (r"(?:car|vehicle)(?!'s|[ -]?(?:park|length|sick|seat|wash|ride|chase|transporter|keys))", "car|vehicle|motor"
     "|automobile"),
    (r"(?:cars|vehicles)", "cars|vehicles|motors|automobiles"),
    (r"(?<=the )(?:car|vehicle|guy|one) (?:ahead|in front)(?! of)", "lead car|chap ahead|fellow in front|lad in front"
     "|car up front"),
    (r"(?<!why )(?:could|can|would|will) you", "could you|can you|would you|will you|might you|could ya|can ya"),
    (r"(?<!you )please", "please|please please|pretty please|if you'd be so kind"),
    (r"I(?:'d like| want| would like|'d love) (?=you to|us to|to )", "I'd like |I want |I need |I'd love "
     "|I'd prefer |I wish "),
    (r"I(?:'d like| want| would like) (?=more|less|some|a )", "I'd like |I could do with |I'd go for |let me have "
     "|I fancy "),
    (r"(?:maybe|perhaps|possibly)", "maybe|perhaps|possibly|might be|p'raps"),
    (r"(?<!not )(?:a bit|a tad|a smidge|a wee bit|slightly|a touch)(?! of)", "a bit|a tad|a smidge|a wee bit"
     "|slightly|a mite"
     "|a speck|a whit|a crumb|a tiny amount|ever so little|a sliver"),
    (rf"(?<!not )(?:a lot|loads|heaps|a great deal|a whole lot) {_MORE}", "a lot |loads |heaps |stacks |bags "
     "|a good deal "),
    (rf"(?<!so )(?<!too )(?<!not )(?<!how )(?<!very )(?<!that )(?<!this )(?<!it )(?:much|way|far) {_MORE}", "much |way "
     "|far |hugely "
     "|vastly |an awful lot |massively |oceans "),
    (r"(?:faster|quicker)(?= *[,.?!]|$| please| than)", "faster|quicker|speedier|more quickly|more rapidly|swifter"
     "|at more speed"),
    (r"slower(?= *[,.?!]|$| please| than)", "slower|more slowly|less fast|less quickly|at less speed|slowlier"),
    (r"(?:closer|nearer)(?= *[,.?!]|$| please| to )", "closer|nearer"),
    (r"(?:further|farther) (?:back|away|behind)", "further back|farther back|further behind|farther away|more distant"),
    (r"(?<!the )(?<!our )(?<!your )(?<!this )(?<!that )(?<!more )(?<!some )(?<!of )speed up" + _ENDS,
     "speed up|go faster|accelerate|pick up speed|gain speed|get quicker|raise the pace|quicken"),
    (r"slow down" + _ENDS, "slow down|go slower|drive slower|reduce speed|lose speed|decelerate|lower the pace"
     "|slacken"),
    (r"(?:overtake|get past|go past) (?=the|him|her|them|that|this|whoever)", "overtake |pass |get past |go past "
     "|get by "
     "|outstrip |get in front of "),
    (r"pull over(?=[,.?!]|$| please| here| now| and)", "pull over|pull in|draw in|pull up at the side"
     "|stop at the side"),
    (r"(?<=the )gap (?=to|between|ahead|in front)", "gap |distance |spacing |separation |interval |headway "),
    (r"(?:junction|intersection|crossroads)", "junction|intersection|crossroads|crossway"),
    (r"(?<=the )(?:hard shoulder|verge|roadside)", "hard shoulder|verge|roadside|side strip|hard strip|berm"),
    (r"in a hurry", "in a hurry|in a rush|pressed for time|pushed for time|short of time|in haste"),
    (r"no (?:hurry|rush)", "no hurry|no rush|no haste|no urgency"),
    (r"(?:I'm|I am) late", "I'm late|I'm running late|I'm behind time|I'm overdue|I'm tardy"),
    (r"(?:we're|we are) late", "we're late|we're running late|we're behind time|we're overdue|we're tardy"),
    (r"(?<=m )(?:scared|frightened|afraid|terrified|nervous)", "scared|frightened|afraid|terrified|nervous|petrified"
     "|fearful|uneasy|freaking out|shaken"),
    (r"(?:kids|children)", "kids|children|youngsters|nippers|bairns|little ones|kiddies"),
    (r"(?:baby|newborn)", "baby|newborn|infant|bairn|bambino"),
    (r"my (?:mum|mother|mom)", "my mum|my mother|my mom|my mama|my old lady"),
    (r"(?:grandma|granny|gran|nan)", "grandma|granny|gran|nan|nana|grandmother|oma"),
    (r"my wife", "my wife|the wife|the missus|my better half|my spouse"),
    (r"(?:carsick|travel sick|nauseous|queasy)", "carsick|travel sick|nauseous|queasy|bilious|seasick|squeamish"),
    (r"(?:meeting|appointment)", "meeting|appointment|conference|briefing|rendezvous"),
    (r"my (?:flight|plane)", "my flight|my plane|my jet|my connection|my departure"),
    (r"(?:coffee|tea|latte|cocoa)", "coffee|tea|latte|cocoa|cappuccino|espresso|hot chocolate"),
    (r"(?:really|very|awfully|terribly)(?= (?:slow|fast|close|far|late|nervous|tired|scared|rough))", "really|very"
     "|awfully"
     "|terribly|dreadfully|frightfully|extremely|proper|mighty|dead"),
    (r"(?:icy|slippery|slick)", "icy|slippery|slick|glassy|frozen|greasy"),
    (r"(?:foggy|misty)", "foggy|misty|hazy|murky"),
    (r"I (?:think|reckon|guess|believe|suppose)", "I think|I reckon|I guess|I believe|I suppose|I figure|I'd say"),
    (r"(?:right now|straight away|immediately|at once)", "right now|straight away|immediately|at once|this instant"
     "|forthwith"),
    (r"keep (?=(?:a|the|this|that) (?:gap|distance|speed|pace)\b)", "keep |maintain |hold |preserve |retain "),
    (rf"(?:reduce|lower|decrease|cut|drop) {_CHANGED}", "reduce |lower |decrease |cut |drop |diminish |curb |trim "),
    (rf"(?:increase|raise|boost|lift) {_CHANGED}", "increase |raise |boost |lift |step up |jack up |heighten "),
    (rf"(?:reduce|decrease|shorten|close|shrink) {_SPACED}", "reduce |decrease |shorten |shrink |tighten |narrow "),
    (rf"(?:increase|widen|open|extend) {_SPACED}", "increase |widen |extend |enlarge |stretch |lengthen |expand "),
    (r"(?:change|switch|move|shift) (?=(?:in)?to the (?:left|right|other|middle) lane)", "change |switch |move "
     "|shift |cross "
     "|hop |scoot |transfer "),
    (r"turn (?=(?:left|right) (?:at|here|there))", "turn |swing |go |steer |head "),
    (r"go straight (?=on|ahead|over|through|at)", "go straight |keep straight |drive straight |head straight "
     "|carry straight "),
    (r"(?:annoying|irritating)", "annoying|irritating|maddening|infuriating|vexing"),
    (r"my (?:neck|back|spine)", "my neck|my back|my spine|my lumbago|my shoulders|my vertebrae"),
    (r"(?:petrol|gas|fuel)(?= (?:is|bill|gauge|prices|station|tank))", "petrol|gas|fuel|diesel|gasoline"),
    (r"(?:enormous|huge|massive)", "enormous|huge|massive|gigantic|colossal|humongous"),
)  # fmt: skip
"""Words, and others that a passenger may say for them: none changes a side, a direction, an amount or a denial."""
_REWORDED = tuple(
    (re.compile(rf"\b{find}(?<=\S)(?!\w)|\b{find}(?<=\s)", re.IGNORECASE), by.split("|")) for find, by in _ALIKE
)
MOST_REWORDED = 3


def reworded(text: str, rng: np.random.Generator) -> str:
    """The sentence with up to three words, or turns of phrase, exchanged for others of the same meaning."""
    done = 0
    for place in rng.permutation(len(_REWORDED)):
        pattern, options = _REWORDED[int(place)]
        found = pattern.search(text)
        if found is None:
            continue
        others = [option for option in options if option.strip().lower() != found[0].strip().lower()]
        new = others[int(rng.integers(len(others)))]
        if found[0][0].isupper():
            new = new[0].upper() + new[1:]
        text = text[: found.start()] + new + text[found.end() :]
        done += 1
        if done == MOST_REWORDED:
            break
    return text


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
