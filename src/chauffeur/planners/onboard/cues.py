"""Cues: which words speak for which manoeuvre. One table, read top to bottom; a match hides its words from later rows.

Kinds of evidence:
    act    asks for a change ("speed up", "closer"); negated it asks for no change.
    state  describes speed or gap ("fast", "close"); whether it is a wish or a complaint is decided by the clause.
    verb   a direction of change that needs a noun ("increase", "less").
    noun   the quantity meant ("speed", "gap").
    adj    a state that needs a noun ("the gap is too small").
    style  a way of driving, or a feeling that asks for one.
    side   left, right or straight with nothing else said.
    place  a junction.
    keep, resume  leave things as they are, or as they were.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from chauffeur.planners.onboard.meaning import Change, Manoeuvre, Side

Kind = Literal["act", "state", "verb", "noun", "adj", "style", "side", "place", "keep", "resume"]


@dataclass(frozen=True, slots=True)
class Cue:
    """A row of the table: pattern and what it is evidence for. `{side}` in a pattern captures left or right."""

    pattern: re.Pattern[str]
    kind: Kind
    manoeuvre: Manoeuvre
    change: Change = 0
    variant: str = ""
    loose: bool = False
    weight: float = 1.0
    side: Side | None = None


_NOUNS = (
    "car|cars|vehicle|vehicles|truck|van|bus|lorry|guy|bike|motorcycle|motorbike|suv|slowpoke|driver|one|person|idiot"
    "|snail|tractor|trailer|thing|sedan|taxi|cab|dude|rv|camper|semi|traffic|turtle|fellow|lady|wagon|pickup"
)
VEHICLE = (
    rf"(?:(?:the|that|this|a|those|these|our|my|your) (?:\w+ ){{0,3}}?(?:{_NOUNS})\b(?: ahead)?"
    r"|vehicle ahead|him|her|it|them|that|this|everyone|everybody|traffic|slowpokes?|others?)"
)
_SIDE = r"(?P<side>left|right)"
_SOME = r"(?:some|more|a (?:bit|little|lot|tad|touch)(?: of)?(?: more)?|plenty of|extra|much more|lots of)"
_ROOM = r"(?:space|room|distance|gap|air|buffer|clearance|headway|cushion|spacing)"
_MOVE = (
    r"(?:go|get|move|drive|navigate|swing|steer|zip|slip|scoot|squeeze|blow|zoom|speed|cruise|race|shoot|run|make|cut"
    r"|push|maneuver|manoeuvre|fly|slide|hop|nip|whip|dart|work|take|bring|jump|leap)(?:ing|s)?"
)

_ROWS: tuple[tuple[str, Kind, Manoeuvre, Change, str, float], ...] = (
    # letting others in or by
    (rf"\blet(?:ting)? {VEHICLE} (?:in|merge|into|through|go first|cut in|come in|join|pass|overtake|go (?:by|past)|by|past|get (?:in|ahead|past|by))\b", "act", "yield", 0, "", 1.5),
    (rf"\bmake (?:some |more )?(?:room|space|way) for {VEHICLE}|\byield(?: to {VEHICLE})?\b|\bgive way\b", "act", "yield", 0, "", 1.5),
    # overtaking
    (r"\b(?:overtak\w+|over take|leapfrog\w*|outrun|surpass\w*|bypass\w*)\b", "act", "overtake", 0, "", 2.0),
    (rf"\b{_MOVE} (?:us |me |it |your way |yourself )?(?:on )?(?:past|around|by|round|ahead of|ahead(?= the| that| this))\b(?! #| (?:an?|about|at least|around|half|double|now)\b)(?: {VEHICLE})?", "act", "overtake", 0, "", 1.5),
    (rf"\bpast {VEHICLE}|\bleav(?:e|ing) {VEHICLE} behind|\bget rid of {VEHICLE}|\blose (?:this|that|him|the) (?:guy|slowpoke|truck|car)", "act", "overtake", 0, "", 1.5),
    (rf"\b(?:get|move|be|pull|go) ahead(?: of)?(?= {VEHICLE}|$)", "act", "overtake", 0, "", 1.2),
    (r"\bpass(?:ing)?\b(?! me| us the| the salt)", "act", "overtake", 0, "", 1.2),
    (r"\b(?:stuck|trapped|sitting|crawling|dawdling) behind\b|\b(?:complain|tired of|sick of|fed up with) (?:follow\w+|be\w* behind|sit\w* behind|stay\w* behind)\b", "act", "overtake", 0, "hint", 0.9),
    (rf"\b(?:{_NOUNS})(?: ahead)?(?: (?:is|are|drives?|goes|seems?|going|driving|moving))+ (?:\w+ ){{0,3}}?(?:slow\w*|crawling|dawdling|a snail|creeping)\b", "act", "overtake", 0, "hint", 0.9),
    (r"\b(?:he|she|they) (?:is|are|drives?|goes)(?: (?:driving|going))? (?:\w+ ){0,3}?(?:slow\w*|crawling|dawdling)\b", "act", "overtake", 0, "hint", 0.9),
    (rf"\bslowpokes?\b (?:ahead|there)|\b(?:slow|crawling) (?:{_NOUNS}) ahead\b", "act", "overtake", 0, "hint", 0.9),
    # the shoulder
    (r"\b(?:leave|leaving|off|out of|from) the shoulder\b|\bback on(?:to)? the (?:road|highway|motorway)\b", "act", "lane", 0, "return", 1.5),
    (r"\bpull(?:ing|s)? (?:\w+ ){0,3}?over\b|\bpull(?:ing)? (?:off|aside|in)\b|\bpull (?:to|on to|onto|into) (?:the )?(?:side|shoulder)\b", "act", "pull_over", 0, "", 2.0),
    (r"\bshoulder\b", "act", "pull_over", 0, "", 1.5),
    (r"\b(?:drop|let|put) (?:me|us|him|her|them|my \w+) (?:off|out|here)\b|\bdropp?(?:ing)? (?:me|us)\b|\bget (?:me )?off (?:the |this )?(?:road|highway|motorway|freeway)\b|\b(?:want|need|like|have) to get out\b", "act", "pull_over", 0, "", 1.5),
    (r"\bpark(?:ing|ed)?\b|\bmove to the side\b|\b(?:stop|park|halt) (?:\w+ ){0,3}?(?:on|at|to) the side\b|\b(?:place|spot) to (?:stop|park)\b(?: on the side)?|\bget out of the car\b", "act", "pull_over", 0, "", 1.2),
    # straight on
    (r"\bnot (?:\w+ )?(?:deviate|stray|leave|depart|diverge|swerve|divert|veer)\w*(?: off)?(?: from)? (?:\w+ ){0,2}?(?:path|course|route|direction|way|heading)\b", "act", "turn", 0, "straight", 2.5),
    (r"\b(?:not|never|no|without|avoid|refrain from)(?: \w+){0,2}? (?:tak(?:e|ing) |mak(?:e|ing) )?(?:any |a )?(?:turn|turns|turning)\b(?! (?:\w+ ){0,3}(?:left|right)| it| up| down| on| off| around)", "act", "turn", 0, "straight", 2.0),
    (r"\b(?:keep|hold|maintain|stay(?:ing)?|follow)(?: on| to)? (?:your|the|this|our|my|same|present|current)(?: (?!left|right)\w+)? (?:course|path|route|heading|direction|trajectory)(?: straight)?\b|\bstay the course\b|\bstay on (?:course|track|path)\b", "act", "turn", 0, "straight", 0.8),
    (r"\b(?:go|get|drive|pass|proceed|continue|keep|head|carry|move|travel|run|cut)(?:ing)? (?:on |right |directly |clean )?(?:through|across|over) (?:the |this |that )?(?:\w+ )?junction\b|\bcross(?:ing)?(?: over)? (?:the |this )?(?:\w+ )?junction\b", "act", "turn", 0, "straight", 1.5),
    (r"\b(?:directly|dead) (?:ahead|forward)\b|\bahead only\b|\b(?:proceed|continue|go|keep going|head|carry on|move|drive|keep|keep moving|keep driving)(?: on)? (?:ahead|forwards?|onwards?)\b(?! of)", "act", "turn", 0, "straight", 1.0),
    # lanes and sides (patterns with a side)
    (r"\b(?:return|(?:go|come|move|get|merge|pull|steer|switch|change) back|back)(?: over)?(?: in| into| to)? (?:your|our|the|this|my) ?(?:own |original |previous |old |first |same |initial )?lane\b|\b(?:go|come|move|pull|merge) back in\b", "act", "lane", 0, "home", 1.2),
    (r"\b(?:get|move|come|pull) out of (?:this|the|our) lane\b|\bmerge(?: (?:in|into|with|onto))?(?: the)?(?: traffic| highway| motorway| road)?$", "act", "lane", 0, "", 1.0),
    (r"\bnot (?:\w+ )?(?:leave|leaving|depart|exit)(?: from)? (?:\w+ ){0,2}?lane\b", "act", "lane", 0, "hold", 1.5),
    (rf"#\d+ (?:over )?to (?:the |your )?{_SIDE}\b", "act", "lane", 0, "", 1.4),
    (rf"\b(?:edge )?{_SIDE} (?:hand )?(?:side )?lanes?\b(?: change)?", "act", "lane", 0, "", 1.5),
    (rf"\b{_SIDE} lane change\b|\blanes? (?:change |changing |over )?(?:to|toward|towards|on|onto|into)? ?(?:the |your |our )?{_SIDE.replace('side', 'side2')}\b", "act", "lane", 0, "", 1.5),
    (rf"\b(?:chang|switch|shift|swap)\w* lanes? (?:\w+ ){{0,3}}?{_SIDE}\b", "act", "lane", 0, "", 1.5),
    (rf"\bmerg(?:e|ing) (?:over |in |into |to |toward |towards |on )*(?:the |your )?{_SIDE}\b", "act", "lane", 0, "", 1.4),
    (rf"\b(?:all the way (?:over )?(?:to the )?|edge ){_SIDE}(?: side)?\b", "act", "lane", 0, "edge", 1.4),
    (rf"\bturn(?:ing|s)? (?:\w+ ){{0,3}}?{_SIDE}\b|\b{_SIDE.replace('side', 'side2')} turn\b", "act", "turn", 0, "", 1.5),
    (rf"\b(?:hang|make|tak(?:e|ing)|bang|hook|do|pull|need|want|making) (?:a |an |the |another |your |that |this )(?:hard |sharp |quick |slight |gentle |next |first |second |u )?{_SIDE}(?: turn| here| there)?\b", "act", "turn", 0, "", 1.4),
    (rf"\b(?:make|take|hang) {_SIDE}\b", "act", "turn", 0, "", 1.2),
    (rf"\b(?:mov|shift|slid|scoot|switch|drift|slip|hop|get|pull|go|goe|eas|nudg|com|jump|head|veer|steer|swing|bear|proceed|keep|stay|chang|squeez|step|stick|remain|swerv|cut|lean|work|guid|tak|bring)(?:e|es|ing|ting)? (?:it |us |me |over |across |back |one |#\d+ |further |more |slightly |yourself |the car |the vehicle |your way )*(?:to |toward |towards |on |into |in )?(?:the |your |our )?{_SIDE}(?: side)?\b", "act", "lane", 0, "loose", 1.1),
    (r"\bstraight (?:away)\b", "resume", "resume", 0, "", 0.1),
    (r"\bstraight\b(?: (?:ahead|on|through|forward|over|across))*", "act", "turn", 0, "straight", 1.5),
    (r"\b(?:chang|switch|swap|shift)\w* (?:\w+ )?lanes?\b|\blane change\b|\b(?:other|next|adjacent|neighbou?ring|another|different|faster|quicker|free|clear|emptier) lane\b|\b(?:move|get|scoot|shift|slide) over\b", "act", "lane", 0, "", 1.2),
    (r"\b(?:stay|keep|remain|stick|hold|continue)(?:ing)?(?: on| to| with)? (?:in )?(?:the |this |that |your |our |my |same |current |present |own )*lane\b|\blane keeping\b|\bkeep lane\b|\bno lane changes?\b", "act", "lane", 0, "hold", 1.5),
    (r"\b(?:middle|cent(?:er|re)) lane\b", "act", "lane", 0, "middle", 1.2),
    # pedals used harshly
    (r"\b(?:brak|accelerat)\w* (?:\w+ )?(?:so |too |that |this |very )(?:hard|harshly|abruptly|suddenly|late)\b|\b(?:hard|harsh|sudden) (?:braking|acceleration|stops)\b", "style", "style", 0, "comfort", 1.0),
    # speed: named targets
    (r"\bas fast as (?:is |it is |you are |we are )?(?:allowed|legal(?:ly)?(?: possible| allowed)?|permitted)\b", "act", "speed", 0, "limit", 1.5),
    (rf"\bas (?:fast|quick|slow) as {VEHICLE}|\bsame (?:speed|pace) as\b|\bmatch(?:ing)?\b(?: \w+){{0,4}}? (?:{_NOUNS}|speed|pace|flow)\b(?: of {VEHICLE})?|\bkeep(?:ing)? (?:up|pace) with\b|\b(?:with )?the flow(?: of traffic)?\b|\bflow of traffic\b|\b(?:at )?the (?:speed|pace) of {VEHICLE}|\blike every(?:one|body) else\b|\badapt to (?:the )?traffic\b", "act", "speed", 0, "match", 1.5),
    (r"\bas (?:fast|quick|quickly|speedy) as (?:you|we|it|the car|possible|she)(?: \w+)?\b|\bfloor it\b|\bflat out\b|\bfull (?:throttle|speed|power|gas)\b|\bpedal to the (?:metal|floor)\b|\b(?:top|max|maximum|highest|full) speed\b|\bmaximum velocity\b|\blet (?:her|it) rip\b|\bhammer down\b", "act", "speed", 1, "max", 1.5),
    (r"\bspeedlimit\b|\bthe limit\b", "act", "speed", 0, "limit", 1.1),
    # speed: changes
    (r"\bspeed(?:ing)? (?:it |us |things |the \w+ |her |this thing |your \w+ )?up\b(?! behind)|\b(?:accelerat(?:e|es|ing|ion)|faster|quicker|quicken|hasten|speedier|zippier)\b|\bpick(?:ing)? (?:it |up)(?:up )?(?: ?(?:the |some |your |a bit of |a little |more )?(?:speed|pace|tempo))?\b|\bput (?:your|the) foot down\b|\bmore (?:gas|throttle|power|pace)\b|\bget (?:a move on|moving)\b|\bstep it up\b|\bmake it snappy\b|\bkick it up\b|\bspeed up\b|\bmove along\b|\bgive it (?:some |more |a bit of )?(?:gas|welly|beans|juice)\b|\bgo quick\b", "act", "speed", 1, "", 1.2),
    (r"\bstep on (?:it|the gas)\b|\bgun it\b|\bpunch it\b|\bhit (?:it|the (?:gas|accelerator))\b|\bmove it(?= |$)(?! over| to| left| right| into)", "act", "speed", 1, "much", 1.2),
    (r"\bslow(?:ing|s)? (?:it |us |things |the \w+ |her |this thing |your \w+ |that |a (?:bit|little|touch) )?down\b|\b(?:slower|decelerat(?:e|es|ing|ion)|slacken|brak(?:e|es|ing)|slow up)\b|\b(?:back|eas(?:e|ing)|lift|let|lay|take (?:your |the )?foot|come) (?:up |off )(?:on |of )?(?:the )?(?:gas|throttle|accelerator|pedal|speed)\b|\beas(?:e|ing) (?:up|off)\b|\blet up\b|\b(?:off|less) (?:the )?(?:gas|throttle)\b|\btake it down\b|\bcool it\b|\bhold your horses\b|\bwhoa\b|\bthrottle (?:back|down)\b|\bdial (?:it|things) (?:back|down)\b|\btake (?:it|things) slow(?:ly|er)?\b|^slow(?: [.,!]|$)|\bturn it down\b", "act", "speed", -1, "", 1.2),
    # gaps: changes
    (rf"\b(?:give|leave|allow) (?:\w+ ){{0,6}}?less (?:\w+ )?{_ROOM}\b|\bclos(?:e|ing) (?:up |down )?(?:the|that|this|our) (?:\w+ )?{_ROOM}\b|\bclose(?:r|st)\b|\bnearer\b|\bclose (?:in|up)\b(?: on)?|\bclosing in\b|\bcatch(?:ing)? up\b|\btighten(?: (?:it )?up)?\b|\bmove up(?: on| behind)?\b|\btailgate\b|\bget (?:right |up )+behind\b|\bsnug\w*\b", "act", "gap", -1, "", 1.2),
    (rf"\b(?:giv|leav|allow)(?:e|ing)? (?:\w+ ){{0,7}}?{_ROOM}\b(?! (?:\w+ )?(?:less|smaller|shorter|tighter|narrower))|\bmak(?:e|ing) (?:some |more )(?:room|space)\b|\b(?:further|farther)\b(?: (?:back|away|behind|off|apart|from))?|\bback(?:ing)? (?:off|away)\b|\b(?:drop|fall|hang|pull|hold|stay|keep|ease|step|stand|slip|lay)(?:ping|ing)? (?:(?!so|too|that|this|far)\w+ ){{0,3}}?back\b(?! (?:on|in|into|to (?:the )?(?:left|right|lane)))|\bkeep (?:your|some|more|a|safe|good|proper|a safe|a good|a proper|a bit of) distance\b(?! (?:of|at|to)\b| #)|\b(?:keep|stay|get) (?:well |far )?away\b|\bdistance (?:yourself|us|ourselves)\b|\bopen(?:ing)? (?:up )?(?:the|a|some|that) (?:\w+ )?(?:gap|space|room|distance)\b|\bbreathing (?:room|space)\b|\bsafer? (?:following )?distance\b(?! of)|\bdistance from\b(?! #)|(?<!there is )(?<!have )\b{_SOME} {_ROOM}\b(?= please|$| [.,!]| behind| between| to| from| ahead)", "act", "gap", 1, "", 1.2),
    (rf"\bfollow(?:ing)? {VEHICLE}(?! (?:\w+ ){0,2}(?:close|tight))|\b(?:stay|remain|keep|stick|tuck in|sit|wait)(?:ing)? behind\b", "act", "follow", 0, "", 0.9),
    # halting
    (r"\b(?:stop|halt|freeze|standstill)(?:ping|ped|s)?\b|\bcome to (?:a )?(?:rest|stop|halt)\b|\bemergency (?:stop|brake|braking)\b|\bslam on the brakes\b|\bwait (?:here|at)\b|\bpull up\b|\bstopsign\b", "act", "stop", 0, "", 1.0),
    # feelings and ways of driving
    (r"\bnot (?:\w+ ){0,3}?(?:be late|miss)\b|\b(?:hurry|hurrying|hurried|rush(?:ing|ed)?|late|behind schedule|deadline|flight|meeting|appointment|interview|urgent(?:ly)?|emergency|hospital|labou?r|birth|impatient|chop chop|tick tock|in time|on time|be there (?:by|in|before))\b|\b(?:miss|catch) (?:a|my|the|our) (?:\w+ )?(?:flight|plane|train|bus|ferry|movie|show|start|game|kickoff|exam)\b|\b(?:no|not (?:much|enough|a lot of)|short (?:on|of)|running out of|little) time\b|\btime is (?:short|tight|running)|\bget (?:me|us) there\b|\bquickly\b", "style", "style", 0, "hurry", 0.9),
    (r"\b(?:take your time|(?:take|taking|go) (?:it )?easy|easy (?:does it|now|there|tiger)|easy|relax\w*|chill(?: out)?|calm(?:er|ly)?(?: down)?|leisurely|scenery|scenic|sightsee\w*|enjoy\w*|plenty of time|all the time in the world|all day|(?:lots|loads|enough) of time|ahead of schedule|early|mellow|unwind|laid back|unhurried)\b", "style", "style", 0, "relax", 0.9),
    (r"\b(?:not (?:\w+ ){0,2}?feel\w* (?:so |very |too |that )?(?:well|good|great|fine|right|hot)|not comfortable|car ?sick(?:ness)?|sick(?:ness)?|nause\w+|queasy|dizzy|stomach|vomit\w*|throw up|puke|unwell|headache|migraine|jerky|jerks?|jerking|lurch\w*|bumpy|rough(?:ly)?|harsh(?:ly)?|abrupt(?:ly)?|smooth(?:er|ly|ness|ing)?|gentl(?:e|er|y)|soft(?:er|ly)?|comfort\w*|uncomfortable|spill\w*|coffee|baby|sleep(?:ing|y)?|asleep|nap|pregnant|grand(?:ma|mother|pa)|elderly|hard on the brakes)\b", "style", "style", 0, "comfort", 0.9),
    (r"\b(?:not (?:\w+ ){0,2}?(?:safe|careful|carefully|safely)|scared|afraid|frighten\w*|scar(?:y|ing)|nervous|anxious|worried|terrif\w+|dangerous(?:ly)?|danger|risky|unsafe(?:ly)?|reckless(?:ly)?|slippery|rain(?:ing|y)?|wet|snow\w*|ice|icy|fog(?:gy)?|watch (?:out|it)|look out|heart attack|get us killed|kill us|maniac|crazy|insane|like a lunatic)\b", "style", "style", 0, "careful", 0.9),
    (r"\b(?:careful(?:ly)?|cautious(?:ly)?|safe(?:r|ly)?|defensive(?:ly)?|conservative(?:ly)?|timid(?:ly)?|hesitant(?:ly)?|prudent(?:ly)?|caution|like (?:a|my|an old) (?:grandma|granny|grandmother|lady))\b", "state", "style", -1, "careful", 0.9),
    (r"\b(?:sport(?:y|ier|s|ily)?(?: mode)?|aggressive(?:ly)?|assertive(?:ly)?|dynamic(?:ally)?|spirited|bold(?:er|ly)?|brave(?:r)?|confident(?:ly)?|wild(?:ly)?)\b", "state", "style", 1, "sporty", 0.9),
    (r"\b(?:boring|bored|have (?:some |more )?fun|more fun|excit\w+|thrill\w*)\b", "style", "style", 0, "sporty", 0.8),
    (r"\beco(?:nomical(?:ly)?|nomic| mode)?\b|\bsav(?:e|ing) (?:\w+ )?(?:fuel|gas|energy|battery|power|range|petrol)\b|\b(?:efficien\w+|extend the range|low on (?:fuel|gas|battery)|fuel economy|environment\w*)\b", "style", "style", 0, "eco", 0.9),
    # states of speed and gap
    (r"\b(?:fast|quick|speedy|rapid(?:ly)?|speeding|racing|flying|race car driver)\b", "state", "speed", 1, "", 1.0),
    (r"\b(?:slow(?:ly)?|sluggish(?:ly)?|crawl(?:ing)?|creep(?:ing)?|dawdl(?:e|ing)|snail(?: pace)?|turtle|tortoise|slowpoke|plodding|poky)\b", "state", "speed", -1, "", 1.0),
    (r"\b(?:close|closely|near|tight|tightly|tailgating|glued|hugging|kissing|crowding|bumper to bumper|breathing down|sniffing|cramped)\b|\b(?:on|up|riding|in) (?:\w+ ){0,2}(?:bumper|tail|heels|rear end|backside|trunk|exhaust)\b|\bon top of (?:him|her|them|that|this|the|it)\b|\bbumper\b", "state", "gap", -1, "", 1.0),
    (r"\b(?:far (?:back|behind|away|off|from)|far|distant|lagging|falling behind)\b(?! (?:more|less|faster|slower|too|better))", "state", "gap", 1, "", 1.0),
    # changes that need a noun
    (r"\b(?:increas\w+|rais(?:e|ing)|lift(?:ing)?(?! off)|hik(?:e|ing)|(?:step|scale) up|boost\w*|bump(?:ing)? (?:\w+ )?up|bump|ramp(?:ing)? (?:\w+ )?up|enhanc\w+|elevat\w+|grow|enlarg\w+|expand\w*|extend\w*|widen\w*|lengthen\w*|stretch\w*|add(?:ing)?|gain\w*|augment\w*|escalat\w+|heighten\w*|amplif\w+|magnif\w+|(?:turn|crank|push|bring|jack|nudge|dial|notch|take) (?:\w+ ){0,3}?up|(?:go|get) up|up(?= (?:the|your|our|my|it|to|by))|double|triple|grow\w*|broaden\w*|more|greater|bigger|larger|higher|longer|wider|additional|extra)\b", "verb", "speed", 1, "", 1.0),
    (r"\b(?:decreas\w+|reduc\w+|lower\w*|lessen\w*|cut(?:ting)?|drop(?:ping)?|diminish\w*|shrink\w*|shorten\w*|shorter|narrow\w*|trim\w*|subtract\w*|deduct\w*|slash\w*|(?:scale|tone) down|eas(?:e|ing)(?= (?:the |your |our )?speed)|(?:knock|pull|bring|throttle) (?:\w+ ){0,2}back|(?:take|knock|shave|scrub) (?:[\w#]+ )?off|(?:bring|dial|turn|push|take|wind|notch|go|get|come) (?:\w+ ){0,3}?down|down(?= (?:to|by))|scale back|minimi[sz]\w*|contract\w*|curtail\w*|moderat\w+|halv\w+|less|smaller|lower|tighter|fewer|compress\w*|drop|shed(?:ding)?)\b", "verb", "speed", -1, "", 1.0),
    (r"\b(?:speed|velocity|pace|cruise|cruising|tempo|speedometer)\b", "noun", "speed", 0, "", 0.6),
    (rf"\b(?:following |time |safety )*(?:{_ROOM}s?|separation|interval|margin|distance)\b", "noun", "gap", 0, "", 0.6),
    (r"\b(?:big|large|huge|wide|long|great|high|generous|excessive|enormous)\b", "adj", "speed", 1, "", 0.8),
    (r"\b(?:small|tiny|short|low|insufficient|thin|scant)\b", "adj", "speed", -1, "", 0.8),
    (r"\bfollow(?:ing)?\b", "noun", "gap", 0, "", 0.3),
    (rf"\b{_SIDE}\b", "side", "turn", 0, "", 0.6),
    (r"\bjunction\b", "place", "turn", 0, "", 0.1),
    # leaving things
    (r"\b(?:resume|carry on|as you were|back to normal|normal driving|drive normal(?:ly)?|never ?mind|cancel(?: that| it)?|forget (?:it|that|about it)|undo(?: that)?|lets (?:go|roll|drive)|start (?:driving|moving)|drive on|as before|move on|go ahead|keep (?:going|driving|moving|rolling)|go on|continue|proceed|forget what i said|scratch that)\b|^go$|^drive$", "resume", "resume", 0, "", 0.7),
    (r"\bkeep (?:it |things |everything )?(?:there|like (?:this|that)|this way|as (?:it )?is|steady|constant|the same|exactly)\b|\b(?:stay|drive|just) (?:like (?:this|that)|as you are|put)\b|\b(?:this|that|it) is (?:\w+ )?(?:fine|good|perfect|great|nice|ok|lovely)\b|\b(?:leave it|do nothing|change nothing|nothing|hold steady|perfect|no changes?|keep it up|steady)\b|\bnot change (?:a thing|anything)\b", "keep", "keep", 0, "", 0.7),
)  # fmt: skip


def _cue(row: tuple[str, Kind, Manoeuvre, Change, str, float]) -> Cue:
    pattern, kind, manoeuvre, change, variant, weight = row
    loose = variant == "loose"
    straight = variant == "straight"
    return Cue(
        re.compile(pattern),
        kind,
        manoeuvre,
        change,
        "" if loose or straight else variant,
        loose,
        weight,
        "straight" if straight else None,
    )


CUES: tuple[Cue, ...] = tuple(_cue(row) for row in _ROWS)
