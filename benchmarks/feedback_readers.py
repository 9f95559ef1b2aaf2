"""How well remarks on a drive are understood: the shipped reader beside what their acts say.

    python benchmarks/feedback_readers.py [--half test|tuning] [--remarks N]

Judged by the topic that a sentence of `data/personalization` was written for: its sign, whether it is praise, or what
had been wanted. `--remarks N` takes N sentences of `data/sorters/remarks.tsv` instead: both readers learned from them.
Only sums are printed: the test half is not to be looked at.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterator
from typing import Final

import numpy as np

from chauffeur.bench.personalization.sayings import feedback
from chauffeur.concept.utterance import Act, Direction, Style, Utterance
from chauffeur.language.meaning.reader import read
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.remarks import sort_remark
from chauffeur.models.sorting.sentences import sentences
from chauffeur.planners.talk2drive.habits import WANTED

WANTED_FOR: Final = {
    "too_fast": "speed-", "too_slow": "speed+", "too_close": "gap-", "too_far": "gap+", "harsh": "comfort-",
    "swerving": "comfort-", "close_call": "comfort-", "timid": "comfort+", "fine": "praise", "no_overtake": "pass",
    "passed": "stay", "not_right": "right", "waited": "go", "not_waited": "yield", "not_parked": "park",
}  # fmt: skip
"""What is to be understood, by topic; topics whose sentences have gaps in them are left out."""
OPPOSITE: Final = {"speed-": "speed+", "speed+": "speed-", "gap-": "gap+", "gap+": "gap-", "comfort-": "comfort+",
    "comfort+": "comfort-", "pass": "stay", "stay": "pass"}  # fmt: skip
_DIRECTIONS: Final[dict[Direction, str]] = {"faster": "speed+", "slower": "speed-", "more": "gap-", "less": "gap+"}
_STYLES: Final[dict[Style, str]] = {"gentle": "comfort-", "careful": "comfort-", "relaxed": "comfort-",
    "sporty": "comfort+"}  # fmt: skip
_DEEDS: Final = {"pass": "pass", "follow": "stay", "go": "go", "turn": "go", "straight": "go", "yield": "yield",
    "wait": "yield", "park": "park", "keep": "comfort-", "yes": "praise"}  # fmt: skip


def by_acts(said: Utterance) -> set[str]:
    """What the acts of a remark say that would have been right."""
    return {found for act in (*said.opinion, *said.acts) if (found := _of(act))}


def _of(act: Act) -> str:
    found = _DEEDS.get(act.act, "")
    if act.act in ("speed", "gap") and act.direction is not None:
        found = _DIRECTIONS.get(act.direction, "")
    elif act.style is not None:
        found = _STYLES.get(act.style, "")
    elif act.act == "lane" and act.side == "right":
        found = "right"
    return OPPOSITE.get(found, "") if act.negated else found


def shipped(text: str) -> set[str]:
    """The same by memory's reader, and by the sorter that habits ask."""
    meant, remark = interpret_feedback(text), sort_remark(text)
    signs = {"speed": meant.speed, "gap": meant.gap, "comfort": meant.comfort}
    found = {f"{topic}{'+' if sign > 0 else '-'}" for topic, sign in signs.items() if sign}
    if remark.share >= 0.4 and remark.kind in WANTED:
        found.add(WANTED[remark.kind].partition(".")[0])
    return found | ({"praise"} if meant.approval > 0 else set())


def _rows(half: str, remarks: int) -> Iterator[tuple[str, str]]:
    if remarks:
        rows = sentences("remarks")
        for at in np.random.default_rng(0).permutation(len(rows))[:remarks]:
            yield rows[int(at)].kind.partition("/")[0], rows[int(at)].text
    else:
        for (topic, _), texts in feedback()["test" if half == "test" else "tuning"].items():
            yield from ((topic, text) for text in texts)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--half", choices=("test", "tuning"), default="test")
    parser.add_argument("--remarks", type=int, default=0)
    arguments = parser.parse_args()
    sums: dict[str, Counter[str]] = {}
    for topic, text in _rows(arguments.half, arguments.remarks):
        if (wanted := WANTED_FOR.get(topic)) is None:
            continue
        for name, found in (("shipped", shipped(text)), ("acts", by_acts(read(text)))):
            for row in (topic, "all"):
                counts = sums.setdefault(row, Counter())
                counts[f"{name} right"] += wanted in found
                counts[f"{name} opposite"] += OPPOSITE.get(wanted) in found
        for row in (topic, "all"):
            sums[row]["n"] += 1
    columns = ("n", "shipped right", "acts right", "shipped opposite", "acts opposite")
    print(f"{'topic':12}", *(f"{column:>17}" for column in columns))
    for topic, counts in sorted(sums.items(), key=lambda row: row[0] == "all"):
        print(f"{topic:12}", *(f"{counts[column]:17}" for column in columns))


if __name__ == "__main__":
    main()
