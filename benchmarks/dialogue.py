"""How well turns of conversations are read: what "the other one" or "a bit more" means after what was said before.

    python benchmarks/dialogue.py --dialogues FILE [--wrong]

FILE holds JSONL of `id`, `turns` (what a person says, in order) and `expect` (a label a turn: acts parted by `;`, each
a verb and fields as `side:left`, `T K:car colour:blue`, `P:behind K:car`, `W:once E:gone K:bus`, `value=50 unit=km/h`,
`name=audi`, `NOT`; `U:question` and the like where nothing is asked). Printed are the shares of turns that were read
right, as the opposite (other side, faster for slower, done for not done), asked about, or otherwise wrong, of first
turns and of later ones, and beside them those of a reader that hears every turn alone. Degree, manner, pointing
("that") and a direction that goes with a value are not compared.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.concept.dialogue import Dialogue
from chauffeur.concept.utterance import Act, Reference, Utterance, acts_from_json, acts_to_json
from chauffeur.language.meaning.reader import read, turn_of

Outcome = Literal["right", "opposite", "asked", "wrong"]
OUTCOMES: Final[tuple[Outcome, ...]] = ("right", "opposite", "asked", "wrong")
SURE: Final = 0.5
"""Below this, planners ask."""
_OF_ACTS: Final = ("side", "to", "direction", "measure", "degree", "aim", "style", "why", "manner")
_OPPOSITES: Final = (
    {"left", "right"},
    {"slower", "faster"},
    {"more", "less"},
    {"leftmost", "rightmost"},
    {"yes", "no"},
)
_SPOKEN: Final = {"behind_target": "behind target", "not_driving": "not driving"}
_LENIENT: Final = ("degree", "manner", "direction")


def label_of(text: str) -> tuple[tuple[Act, ...], str]:
    """The acts of a label, and for whom the words are."""
    rows: list[dict[str, Any]] = []
    address = "car"
    for part in filter(None, (one.strip() for one in text.split(";"))):
        verb, *tokens = part.split()
        if verb.startswith("U:"):
            address = verb[2:]
            continue
        row: dict[str, Any] = {"act": verb}
        held: dict[str, Any] = row
        amount: dict[str, Any] = row
        for token in tokens:
            name, sign, value = token.partition(":" if ":" in token else "=")
            value = _SPOKEN.get(value, value)
            match name:
                case "U":
                    address = value
                case "NOT" | "PURPOSE":
                    row[name.lower()] = True
                case "T":
                    held = row.setdefault("target", {})
                case "OF":
                    held = held.setdefault("of", {})
                case "P":
                    held = {}
                    row["place"] = {"rel": value, "ref": held}
                case "W":
                    held = {}
                    amount = {"type": value, "event": "other", "ref": held}
                    row["when"] = amount
                case "E":
                    amount["event"] = value
                case "K":
                    held["kind"] = value
                case "DEICTIC":
                    held["deictic"] = True
                case "NAME" | "VALUE" | "CVALUE":
                    pass
                case "value" | "unit":
                    amount[name] = float(value) if name == "value" else value
                case "ordinal":
                    held[name] = int(value)
                case _ if sign:
                    (row if held is row or (name in _OF_ACTS and name != "side") else held)[name] = value
                case _:
                    held["name"] = f"{held.get('name', '')} {token}".strip()
        for outer in ("place", "when"):
            if outer in row and "kind" not in row[outer].get("ref", {}):
                row[outer].pop("ref", None)
        rows.append(row)
    return acts_from_json(rows), address


def outcome_of(found: Utterance, expected: tuple[Act, ...], address: str, raw: tuple[Act, ...]) -> Outcome:
    """How a turn was read. A turn of dialogue that the label keeps as it is ("undo") may be read so."""
    meant = tuple(act for act in found.acts if act.act not in ("none",))
    if not expected:
        return "right" if not meant and (address == "car" or found.address != "car") else "wrong"
    if _same(meant, expected) or _same(raw, expected):
        return "right"
    if not meant or found.sure < SURE or any(act.act == "unclear" for act in meant):
        return "asked"
    return "opposite" if len(meant) == len(expected) and any(map(_opposed, meant, expected)) else "wrong"


def _same(acts: tuple[Act, ...], expected: tuple[Act, ...]) -> bool:
    return len(acts) == len(expected) and all(map(_agree, acts, expected))


def _agree(act: Act, expected: Act) -> bool:
    """Whether an act says what is expected."""
    said, wanted = _plain(act), _plain(expected)
    if "unit" not in wanted:
        said.pop("unit", None)
    if act.value is None and expected.value is None:
        said["direction"], wanted["direction"] = act.direction, expected.direction
    return said == wanted


def _plain(act: Act) -> dict[str, Any]:
    """An act without what is not compared."""
    (row,) = acts_to_json([act])
    pointed = json.loads(json.dumps(row), object_hook=lambda one: {k: one[k] for k in one if k != "deictic"})
    return {name: value for name, value in pointed.items() if name not in _LENIENT}


def _opposed(act: Act, expected: Act) -> bool:
    """Whether one does the contrary of the other."""
    pairs = [(act.side, expected.side), (act.direction, expected.direction), (act.to, expected.to)]
    pairs += [(_side(act.target), _side(expected.target)), (act.act, expected.act)]
    if act.act == expected.act and act.negated != expected.negated:
        return True
    return any({one, other} in _OPPOSITES for one, other in pairs)


def _side(reference: Reference | None) -> str | None:
    return None if reference is None else reference.side


def main() -> None:
    """Read the dialogues, and print how."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--dialogues", type=Path, required=True)
    parser.add_argument("--wrong", action="store_true", help="print the turns that were not read right")
    given = parser.parse_args()
    counts: dict[tuple[str, str], Counter[Outcome]] = {}
    for line in given.dialogues.read_text().splitlines():
        row: Mapping[str, Any] = json.loads(line)
        state = Dialogue()
        for k, (text, label) in enumerate(zip(row["turns"], row["expect"], strict=True)):
            expected, address = label_of(label)
            alone, found = read(text), turn_of(text, state.last).utterance
            state = state.after(found)
            place = "first turns" if k == 0 else "later turns"
            for reader, heard in (("with the turn before", found), ("alone", alone)):
                outcome = outcome_of(heard, expected, address, alone.acts)
                counts.setdefault((place, reader), Counter())[outcome] += 1
                if given.wrong and reader != "alone" and outcome != "right":
                    print(f"{row['id']}: {outcome}: “{text}” {acts_to_json(heard.acts)} for {label}")
    for (place, reader), found in sorted(counts.items()):
        total = sum(found.values())
        shares = ", ".join(f"{name} {found[name]} ({100.0 * found[name] / total:.0f} %)" for name in OUTCOMES)
        print(f"{place} ({total}), {reader}: {shares}")


if __name__ == "__main__":
    main()
