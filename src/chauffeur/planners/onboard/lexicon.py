"""Words: how people shorten, decorate and idiomatically bend what they say to a car, and how to undo it.

`normalise` turns a sentence into plain lower-case words with a few fixed names for things (`shoulder`, `junction`,
`ahead`, `cruise`). Meaning is read by `cues`; nothing here decides what is wanted.
"""

from __future__ import annotations

import re
import unicodedata

_CONTRACTIONS = (
    (r"\bcan't\b|\bcannot\b|\bcant\b", "can not"),
    (r"\bwon't\b|\bwont\b", "will not"),
    (r"\bshan't\b", "shall not"),
    (r"\bain't\b|\baint\b", "is not"),
    (r"\blet's\b|\blets\b", "lets"),
    (r"\b(do|does|did|is|are|was|were|has|have|had|would|could|should|need|must|might)n't\b", r"\1 not"),
    (r"\b(do|does|did|is|are|was|would|could|should|need)nt\b", r"\1 not"),
    (r"\b(i)'?m\b", r"\1 am"),
    (r"\b(you|we|they)'re\b|\b(you)re\b", r"\1\2 are"),
    (r"\b(i|you|we|they)'ve\b", r"\1 have"),
    (r"\b(i|you|we|they|he|she|it|that)'(?:ll)\b", r"\1 will"),
    (r"\b(i|you|we|they|he|she|it)'d\b", r"\1 would"),
    (r"\b(it|that|he|she|there|what|who|where|how|here)'s\b", r"\1 is"),
    (r"\bgotta\b", "have to"),
    (r"\bgonna\b", "going to"),
    (r"\bwanna\b", "want to"),
    (r"\bgimme\b", "give me"),
    (r"\bkinda\b", "kind of"),
    (r"\bpls\b|\bplz\b", "please"),
    (r"\bokay\b", "ok"),
    (r"\b(\w+)in'(?=\s|$)", r"\1ing"),
    (r"'s\b|'", " "),
)
_GLUED_UNIT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)(?=[a-z%])")
_UNIT_FORMS = (
    (r"\bmiles\s*/\s*h(?:ou)?r?\b", "mph"),
    (r"\bm\s*/\s*s(?:ec)?\b", "m/s"),
    (r"\b(?:km|k)\s*/\s*h(?:r|our)?\b", "km/h"),
    (r"\bmet(?:er|re)s?\s*/\s*s(?:ec(?:ond)?)?\b", "m/s"),
    (r"\bkilomet(?:er|re)s?\s*/\s*h(?:our)?\b", "km/h"),
)
_TOKEN = re.compile(r"m/s|km/h|mi/h|\d+(?:\.\d+)?|[a-z]+|%|[.,;:!?]")

REWRITES: tuple[tuple[str, str], ...] = (
    # things on the road, one name each
    (r"\b(?:speed|speeding) limits?\b|\bposted speed\b|\blegal (?:speed|limit|maximum)\b", "speedlimit"),
    (r"\bstop sign\b", "stopsign"),
    (r"\bspeed (?:bumps?|cameras?)\b|\bspeeding tickets?\b", "obstacle"),
    (r"\b(?:adaptive )?cruise control\b|\badaptive cruise\b|\bacc\b", "cruise"),
    (r"\b(?:t )?(?:intersections?|crossroads?|cross roads?|junctions?|crossings?|four way)\b", "junction"),
    (r"\b(?:traffic|red|green|stop) (?:lights?|signals?)\b|(?<=the )(?:next )?(?:lights?|signals?|corner|side street)\b", "junction"),
    (
        r"\b(?:emergency|breakdown|stopping|safety) (?:lane|bay|strip|area)\b|\bhard shoulder\b|\bshoulder lane\b"
        r"|\b(?:side|edge) of (?:the |this )?(?:road|highway|motorway|freeway)\b|\broad ?sides?\b"
        r"|\b(?:road )?verge\b|\blay ?by\b|\bcurb(?:side)?\b|\bkerb(?:side)?\b",
        "shoulder",
    ),
    (r"\bin front(?: of (?:us|me|you|our car|it))?\b|\bup ahead\b|\bahead of (?:us|me|you)\b", "ahead"),
    (r"\b(?:lead(?:ing)?|preceding|front) (?:vehicle|car|truck|one)\b", "vehicle ahead"),
    (r"\b(?:left|right) (?:hand )?(?:side )?(?:mirror|seat|door|window)s?\b", "gadget"),
    (r"\b(left|right) handed?\b", r"\1"),
    (r"\b(left|right)(?:wards?|ish)\b", r"\1"),
    (r"\bleft ?most\b|\bfurthest left\b|\bfar left\b", "edge left"),
    (r"\bright ?most\b|\bfurthest right\b|\bfar right\b", "edge right"),
    (r"\b(?:fast|passing|overtaking|quick) lane\b", "edge left lane"),
    (r"\b(?:slow|crawler) lane\b", "edge right lane"),
    (r"\bone lane (?:over )?to the (left|right)\b", r"\1 lane"),
    # "right" and "left" that are no sides
    (r"\b(?:that|you|it|this) (?:is|are) (?:all )?right\b(?! lane| turn| side)|\ball ?right\b|\bright of way\b", " "),
    (r"\bis (?:that|it|this) right\b", "question"),
    (r"(?:^|(?<=[,.!?] ))right ?(?=[,.!])", " "),
    (r"(?<=, )right ?(?=\?)", " "),
    (
        r"(?<!turn )(?<!go )(?<!bear )(?<!hang )(?<!lane )(?<!lanes )(?<!merge )(?<!move )(?<!keep )(?<!veer )(?<! a )"
        r"(?<!the )\bright (?=now|away|here|there|behind|ahead|after|before|on\b|next to|at the|in the|back|past|by|up)",
        " ",
    ),
    (r"\b(?:minutes?|hours?|time|fuel|gas|battery|charge|money|nothing|much) left\b(?! lane| turn| side)", " "),
    (r"\b(?:i|we|he|she|they|have|has|had|just) left (?=my|our|the|his|her|home|late|without|for|at|from|something)", " "),
    # politeness and rhetoric: a "not" in them negates nothing
    (r"\bwould you mind not\b|\bdo you mind not\b", "please not"),
    (r"\b(?:would|do) you mind\b|\bif you (?:do|would) not mind\b|\bi (?:would|do) not mind if\b|\bif i may\b", "please"),
    (r"\bwhy (?:not|do not (?:you|we)|can not (?:you|we)|are not (?:you|we)(?= (?:overtak|pass|chang|turn)))\b", "please"),
    (r"\bwhy do(?:es)? not\b", "please"),
    (r"\b(?:can|could|will|would|should|shall) not (?:you|we)\b|\b(?:can|could|will|would|should) (?:you|we) not just\b", "please"),
    (r"\bdo not (?:you|we) think (?:that )?\b|\bis not there (?:a|any) way to\b|\bis not it (?:time|better) to\b", "please"),
    (r"\bdo not (?:be (?:afraid|scared|shy) (?:to|of)|hesitate to|forget to|fail to|wait to)\b", "please"),
    (r"\bdo not (?:worry|mind|bother me|get me wrong)\b|\bno (?:problem|worries|doubt|kidding|joke|matter)\b", " "),
    (r"\bnot (?:only|bad|sure)\b|\bwhether or not\b|\bif not\b|\bcan not (?:wait|help)\b", " "),
    (r"\b(?:can not|could not|do not) (?:stand|bear|take|tolerate)\b", "complain"),
    (r"^no(?= [,.!])|(?<=[,.!?] )no(?= [,.!])|^no(?= (?:go|please|turn|speed|slow|drive))", " "),
    (r"\bno longer\b", "not"),
    (r"\bas (?:soon|quick(?:ly)?|fast|promptly) as (?:(?:you|we) (?:safely )?can|possible)(?= (?:turn|change|pull|over|stop|get))", "swift"),
    (r"\bas soon as (?:(?:you|we) can|possible|is possible)\b|\basap\b|\bat once\b|\bimmediately\b|\bright away\b", "swift"),
    (r"\b(?:when|if|once|as soon as|whenever|provided|as long as|only if|until)(?: it| that| this| you| the (?:road|lane|way|coast))?(?: is| are| feels?| looks?| becomes?)? (?:all )?(?:safe|clear|free|possible|ok)(?: to do so| to go)?\b", "whensafe"),
    (r"\bwhen (?:you|there) (?:can|get a chance|is (?:a )?(?:gap|space|room))(?: safely)?\b|\bsafely when\b", "whensafe"),
)  # fmt: skip
"""Applied in order to the token string; later rules and the cues see the replacement."""

_NUMBER_COMMA = re.compile(r"(?<=\d),(?=\d{3}\b)")
_REWRITES = tuple((re.compile(pattern), by) for pattern, by in REWRITES)
_CONTRACT = tuple((re.compile(pattern), by) for pattern, by in _CONTRACTIONS)
_UNITS = tuple((re.compile(pattern), by) for pattern, by in _UNIT_FORMS)


def plain(text: str) -> str:
    """Lower case, straight quotes, no accents, contractions written out, hyphens and slashes opened."""
    text = unicodedata.normalize("NFKC", text).lower()
    text = text.replace("’", "'").replace("‘", "'").replace("`", "'").replace("…", " . ").replace("—", " , ")
    text = "".join(c for c in unicodedata.normalize("NFD", text) if not unicodedata.combining(c))
    text = _NUMBER_COMMA.sub("", text)
    for pattern, by in (*_CONTRACT, *_UNITS):
        text = pattern.sub(by, text)
    text = _GLUED_UNIT.sub(r"\1 ", text)
    return text.replace("-", " ").replace("–", " ")


def tokens_of(text: str) -> list[str]:
    """Words, numerals and punctuation of a plain text."""
    return _TOKEN.findall(plain(text))


def rewrite(line: str) -> str:
    """Token string with idioms undone and things called by one name."""
    for pattern, by in _REWRITES:
        line = pattern.sub(by, line)
    return re.sub(r"\s+", " ", line).strip()


FILLERS = frozenset(
    ["a", "an", "the", "this", "that", "these", "those", "it", "its", "i", "me", "my", "mine", "we", "us", "our", "you", "your", "he", "him", "his", "she", "her", "hers", "they", "them", "their", "who", "am", "is", "are", "was", "were", "be", "been", "being", "do", "does", "did", "have", "has", "had", "having", "will", "would", "shall", "should", "can", "could", "may", "might", "must", "to", "of", "in", "on", "at", "by", "with", "from", "for", "as", "into", "onto", "out", "off", "up", "over", "under", "about", "around", "than", "then", "so", "and", "or", "but", "because", "if", "when", "while", "once", "until", "after", "before", "unless", "whether", "just", "please", "kindly", "thanks", "thank", "hey", "hi", "hello", "ok", "well", "now", "here", "there", "again", "also", "too", "very", "really", "quite", "rather", "pretty", "much", "more", "most", "some", "any", "all", "one", "two", "other", "another", "bit", "little", "lot", "touch", "tad", "slightly", "somewhat", "way", "kind", "sort", "like", "feel", "feeling", "feels", "think", "believe", "guess", "hope", "want", "wish", "need", "needs", "like", "prefer", "lets", "let", "make", "get", "got", "getting", "go", "going", "gone", "drive", "driving", "driver", "car", "vehicle", "truck", "van", "bus", "lorry", "bike", "motorcycle", "suv", "guy", "one", "buddy", "dude", "man", "woman", "person", "thing", "road", "highway", "motorway", "freeway", "street", "way", "traffic", "speed", "velocity", "pace", "cruise", "lane", "lanes", "side", "gap", "distance", "space", "spacing", "room", "buffer", "headway", "behind", "ahead", "back", "front", "between", "next", "near", "along", "course", "path", "route", "direction", "journey", "trip", "ride", "current", "currently", "present", "same", "normal", "usual", "usually", "always", "still", "yet", "even", "maybe", "perhaps", "possible", "possibly", "able", "could", "today", "tonight", "morning", "right", "left", "straight", "swift", "whensafe", "shoulder", "junction", "edge", "toward", "towards", "further", "keep", "keeping", "hold", "holding", "maintain", "maintaining", "stay", "staying", "set", "setting", "adjust", "adjusting", "control", "regulate", "fix", "arrange", "establish", "change", "changing", "take", "taking", "give", "giving", "put", "turn", "turning", "move", "moving", "bring", "come", "coming", "use", "using", "utilizing", "utilising", "navigate", "navigating", "head", "follow", "following", "reach", "reaching", "stop", "stopped", "stopping", "no", "not", "never", "without", "complain", "what", "how", "why", "which", "where", "chauffeur", "autopilot", "mate", "sir", "madam", "darling", "honey", "dear", "actually", "honestly", "basically", "probably", "seems", "seem", "looks", "look", "bit", "everyone", "everybody", "anybody", "somebody", "someone", "something", "anything", "everything", "people", "others", "own", "leading", "lead", "i'd", "ahead", "us", "try", "trying", "start", "starting", "continue", "minute", "second", "time", "times", "moment", "only", "enough", "such", "that's"]
)
"""Words that carry no manoeuvre of their own; whatever is neither here nor in a cue counts as unknown."""
