"""Acts and references in plain words."""

from __future__ import annotations

from chauffeur.concept.utterance import Act, Reference


def act_words(act: Act) -> str:
    """An act in plain words."""
    verb = "do that" if act.act == "refuse" else act.act.replace("_", " ")
    parts = [("do not " if act.negated else "") + verb]
    parts += [value for value in (act.side, act.to, act.direction) if value]
    if act.value is not None:
        parts.append(f"{act.value:g} {act.unit}".strip())
    if act.target is not None:
        parts.append(reference_words(act.target))
    if act.place is not None:
        where = "" if act.place.ref is None else f" {reference_words(act.place.ref)}"
        parts.append(f"{act.place.rel.replace('_', ' ')}{where}")
    if act.manner is not None:
        parts.append(f"({act.manner})")
    if act.when is not None:
        event = "" if act.when.event == "other" else f" {act.when.event}"
        of = "" if act.when.ref is None else f" {reference_words(act.when.ref)}"
        parts.append(f"— {act.when.type}{of}{event}")
    if act.purpose:
        parts.append("(as the purpose of the act before)")
    if act.why is not None:
        parts.append(f"({act.why})")
    return " ".join(parts)


def reference_words(reference: Reference) -> str:
    """A reference in plain words."""
    ordinal = {1: "first", 2: "second", 3: "third", -1: "last"}.get(reference.ordinal or 0, "")
    parts = ["that" if reference.deictic else "the", ordinal, reference.state or "", reference.colour or ""]
    parts += [reference.kind.replace("_", " "), f"“{reference.name}”" if reference.name else ""]
    parts += [f"on the {reference.side}" if reference.side else "", reference.where or ""]
    if reference.of is not None:
        parts.append(f"at/of {reference_words(reference.of)}")
    return " ".join(part for part in parts if part)
