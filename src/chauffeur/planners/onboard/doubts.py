"""When not to guess: empty, foreign, off-topic and unsupported wishes, and questions; each told in words that help."""

from __future__ import annotations

import re
import unicodedata

from chauffeur.planners.onboard.clauses import Clause
from chauffeur.planners.onboard.lexicon import plain, rewrite
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood

CAN_DO = (
    "I can drive faster or slower or at a speed you name, follow closer or further back, change lanes, overtake, turn "
    "or go straight at a junction, pull over, and drive in a hurry, relaxed, gently, carefully or economically."
)

_OFF_TOPIC = re.compile(
    r"\b(?:play|jazz|music|songs?|radio|podcast|playlist|volume|spotify|movie|video|jokes?|poem|story|sing|weather|forecast"
    r"|news|call|phone|dial|text message|e ?mail|message|window|windows|sunroof|air con\w*|conditioning|a/c|heater|heating"
    r"|temperature|degrees|warmer|colder|cooler|fan|seat|massage|mirrors?|wipers?|headlights?|high beams?|horn|honk|recipe"
    r"|pizza|burger|restaurant|book a|order|alarm|timer|remind|translate|president|capital of|meaning of life|python"
    r"|homework|stock|bitcoin|code|door|doors|trunk|hotel|write|who are you|your name|how old|fast food|breakfast)\b"
)
_DRIVING = re.compile(
    r"\b(?:lane|speed up|slow down|(?:go|drive|move) \w{0,6} ?(?:slow|slower|faster)|overtake|brak\w+|accelerate|turn (?:left|right)|pull over|stop the car"
    r"|distance|gap|drive|driving|shoulder|merge|tailgat\w+|mph)\b"
)
_UNSUPPORTED = (
    (re.compile(r"\b(?:u ?turn|turn (?:around|back)|make a u|go back home|go back(?= ?$))\b"), "I do not turn round on the road."),
    (re.compile(r"\b(?:reverse|back up|drive backwards?|in reverse)\b(?! (?:from|off))"), "I do not drive backwards here."),
    (
        re.compile(r"\b(?:take|bring|drive|get) (?:me|us) (?:\w+ )?(?:home|to (?!the (?:left|right|shoulder|side|other|edge|middle|next lane)|a (?:stop|halt|standstill)|\d|my (?:left|right))\w+)"
                   r"|\b(?:navigate|route|go|drive|head) (?:me )?(?:home|to (?:the )?(?:airport|station|office|work|school|mall|hospital|hotel|city|downtown|nearest))"
                   r"|\b(?:take|use) (?:the )?(?:next )?exit\b"),
        "I do not plan routes to places; I only know the road ahead.",
    ),
    (re.compile(r"\b(?:honk|flash (?:the |your )?lights|horn|blinkers?|hazard\w*)\b"), "I have no control over lights and horn."),
    (
        re.compile(r"\b(?:car|truck|vehicle|guy|one|driver|van|bus|idiot|person|bike)s? behind (?:us|me)?\b.*\b(?:close|closely|tailgating|pushing|bumper|near)\b"
                   r"|\b(?:being tailgated|tailgating us|tailgating me|on our (?:bumper|tail)|on my (?:bumper|tail)|behind us is (?:too |so )?(?:close|tailgating))\b"),
        "I cannot make the vehicle behind us keep its distance. Shall I change lanes or drive a bit faster?",
    ),
    (re.compile(r"\b(?:run|jump|ignore|skip|blow (?:through|past)|do not stop (?:at|for)) (?:the |that |a |this |every )?(?:red |stop )?(?:lights?|signs?|stop signs?|stopsign|signal)\b"),
     "I do not ignore stop signs and signals."),
    (re.compile(r"\b(?:crash|ram|hit|run over|run into|bump into|collide)\b (?:into )?(?:the|that|this|him|her|it|them|a)\b(?! (?:gas|brakes?|accelerator|road))"),
     "I do not drive into anything."),
    (re.compile(r"\b(?:on|into|in) the (?:oncoming|wrong|opposite) (?:lane|side|traffic)\b|\bwrong way\b"), "I do not drive against the traffic."),
    (re.compile(r"\bclose your eyes\b|\b(?:turn|switch) (?:off|yourself off|the engine off)\b|\bengine off\b|\bshut down\b"), "I keep driving the car while we are on the road."),
)  # fmt: skip
_EITHER = re.compile(
    r"\b(left|right|faster|slower|speed up|slow down|closer|further) or (?:to )?(?:the )?"
    r"(left|right|faster|slower|speed up|slow down|closer|further)\b(?! away| back)"
)
_FOREIGN = frozenset(
    """
    der die das und ist nicht bitte ich wir schneller langsamer fahr fahre fahren links rechts abstand spur halte auf
    le la les et est pas plus vite ralentis gauche droite tourne voie doucement depasse moins accelere vous nous je
    el los las es por favor mas rapido despacio izquierda derecha gira carril adelanta para acelera reduce velocidad
    il lo gli che non piu veloce rallenta sinistra destra gira corsia sorpassa per favore
    o os nao mais rapido devagar esquerda direita vire faixa ultrapasse
    de het een niet sneller langzamer alstublieft linksaf rechtsaf rijstrook harder ga naar
    szybciej wolniej lewo prawo prosze zwolnij skrec
    sakin daha hizli yavas sola saga don
    snabbare vanster hoger sakta kor fortere saktere
    """.split()
)
_ENGLISH_TOO = frozenset("die las les para reduce per don ga o el de la es is for on and in a i for auf lo il".split())
_STRONG_FOREIGN = frozenset(
    """
    schneller langsamer fahre fahren abstand bitte vite ralentis gauche droite tourne doucement accelere depasse rapido
    despacio izquierda derecha carril adelanta acelera velocidad veloce rallenta sinistra destra corsia sorpassa devagar
    esquerda direita ultrapasse sneller langzamer alstublieft linksaf rechtsaf rijstrook szybciej wolniej zwolnij skrec
    hizli yavas snabbare links rechts uberholen anhalten arretez freine frena frene gire doble
    """.split()
)
_QUESTION = re.compile(
    r"^(?:and |so |ok |hey |tell me )*(?:how (?:fast|far|close|long|much|many|old|do|does|is|are)|what (?:is|are the|speed|lane|time|was|does|do you)"
    r"|where|who|whose|which|when (?:are|is|do|does|will|did)|is (?:it|this|that|the|there|he|she)|are (?:we|you|they|there)|did|was|were|does"
    r"|do (?:we|i|they)|have we|has|am i|question)\b"
)
_REQUEST = re.compile(
    r"\b(?:is it possible|are you able|is there (?:a|any) (?:way|chance)|do you think|do we have to|do we need to|are you going to"
    r"|are not|is not|have you considered|how about|what about|what if|is it (?:ok|okay) (?:if|to)|do you mind)\b"
)


def doubt_before(text: str, max_chars: int) -> NotUnderstood | None:
    """Doubts that arise before any meaning is sought."""
    if not text.strip():
        return NotUnderstood("empty", f"I did not hear a wish. {CAN_DO}")
    if len(text) > max_chars:
        return NotUnderstood("too_long", "That was too long for me. Please tell me in a sentence what you want.")
    letters = [c for c in text if c.isalpha()]
    if not letters and not any(c.isdigit() for c in text):
        return NotUnderstood("symbols", f"I understand words only. {CAN_DO}")
    if _foreign(text, letters):
        return NotUnderstood("language", f"I understand English only. {CAN_DO}")
    words = plain(text)
    line = rewrite(re.sub(r"\s+", " ", re.sub(r"[^a-z/#0-9 .,;!?]", " ", words)))
    for pattern, why in _UNSUPPORTED:
        if pattern.search(words) or pattern.search(line):
            return NotUnderstood("unsupported", f"{why} {CAN_DO}")
    either = _EITHER.search(words)
    if either is not None:
        return NotUnderstood("ambiguous", f"{either[1].capitalize()} or {either[2]}: which one do you want?")
    if _OFF_TOPIC.search(words) and not _DRIVING.search(words):
        return NotUnderstood("off_topic", f"I only drive. {CAN_DO}")
    return None


def doubt_without_meaning(text: str, clauses: list[Clause]) -> NotUnderstood:
    """Words for a wish in which no manoeuvre was found."""
    if _QUESTION.match(plain(text)):
        return NotUnderstood("question", f"I take wishes, and cannot answer questions. {CAN_DO}")
    kinds = {e.cue.kind for clause in clauses for e in clause.evidence}
    if "verb" in kinds and "noun" not in kinds:
        return NotUnderstood("ambiguous", "More or less of what: speed, or the distance to the vehicle ahead?")
    if "noun" in kinds:
        return NotUnderstood("ambiguous", "What shall I do with it: more, less, or a number you name?")
    if any(clause.quantities for clause in clauses):
        return NotUnderstood("ambiguous", "A number of what: speed, or the distance to the vehicle ahead?")
    return NotUnderstood("unknown", f"I did not understand what you want me to drive. {CAN_DO}")


def is_question(text: str, found: list[Meaning]) -> bool:
    """Whether the wish asks about the drive instead of asking for something."""
    words = plain(text).strip()
    if not _QUESTION.match(words) or _REQUEST.search(words):
        return False
    # "What are you doing? Slow down!": a plain wish in a sentence of its own answers the question
    tail = re.split(r"[?!.,]", words, maxsplit=1)
    return len(tail) < 2 or not tail[1].strip() or len(found) < 2


def _foreign(text: str, letters: list[str]) -> bool:
    if not letters:
        return False
    latin = sum(1 for c in letters if "LATIN" in unicodedata.name(c, ""))
    if latin < 0.7 * len(letters):
        return True
    words = re.findall(r"[a-z]+", plain(text))
    strong = sum(1 for w in words if w in _STRONG_FOREIGN)
    foreign = sum(1 for w in words if w in _FOREIGN and w not in _ENGLISH_TOO)
    return strong > 0 or (foreign >= 2 and foreign >= 0.4 * len(words))
