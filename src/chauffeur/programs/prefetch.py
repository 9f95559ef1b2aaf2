"""Answers given before they are asked for, and wishes told later: what a program says in one period in one message.

A call from the sandbox to its host costs some 25 microseconds and more, a look into a list inside the sandbox about
two. A program's questions of one period are mostly those of periods before. So each gets a number (its slot) when it is
first asked, and with each new control period the host sends a list of answers by slot; small functions inside the
sandbox, named like the driving APIs, look there first. Whatever is not foreseen is asked of the host as ever. The
answers are the same either way, because nothing in the world moves within a period; those that depend on the program's
own set-points are forgotten as soon as it sets something.

A wish for a speed or a headway has no answer, so it waits in `__pending__` until the period ends, or until something is
asked or done that may depend on it.

Which answers were used, and between which calls, is told to the host at the end of the period (`__used__`: the slot of
an answer, HOST for a call that reached the host, LATER for a wish that waited), so that the record of calls is complete
and in order. Both lists are the program's word: a wish in them is checked like any other, and the rest only goes into
that record.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import Final

from chauffeur.programs.catalogue import TOWN_APIS, apis_of
from chauffeur.programs.nodes import all_nodes

TICK: Final = "__tick__"
"""What a yield turns into, and the host call behind it."""

DRIVE: Final = "__drive__"
"""What `yield autopilot()` turns into, and the host call behind it: `autopilot()`, then the yield."""

END: Final = "__end__"
"""The host call after the main function has returned."""

WISH: Final = "__wish__"
"""The host call that tells the set-points that waited."""

USED: Final = "__used__"
PENDING: Final = "__pending__"
AT_FAULT: Final = f"[{USED}, {PENDING}]"
"""What is read from a program that has failed."""

HOST: Final = -1
LATER: Final = -2
NO_SLOT: Final = -3

MAX_SLOTS: Final = 128
"""Questions that are remembered; then the numbers begin anew."""

MAX_FORESEEN: Final = 200
"""Answers used in a period before the program has to ask the host again, which counts and stops it."""

MAX_PENDING: Final = 50
"""Wishes that wait in a period; more go to the host one by one, which counts and stops them."""

NOT_FORESEEN: Final = "?"
"""Stands where a slot has no answer; no answer of a driving API looks like it."""

CAN_WAIT: Final = frozenset({"set_target_speed", "set_desired_time_headway", "proceed"})
"""Wishes that take one number and do nothing but be remembered; nobody looks at what they answer."""

OF_WISHES: Final = frozenset(
    {"is_safe_enter", "get_target_speed", "get_desired_time_headway", "detect_stop_sign_ahead"}
)
"""Questions whose answer depends on what the program has wished."""

FORESEEABLE: Final = frozenset(
    api.name
    for api in TOWN_APIS.values()
    if api.effect == "read" and api.returns in {"number", "flag", "vehicle", "lane"}
)
"""Questions that may be answered beforehand. A list is not: the program could change it and ask again."""

_PERIOD = f"""
__slots__, __answers__, __wished__, {PENDING}, {USED} = {{}}, [], [], [], []

def __foresee__(answers):
    {USED}.clear()
    {PENDING}.clear()
    __wished__.clear()
    __answers__.clear()
    if answers is not None:
        __answers__.extend(answers)

def {TICK}(line, value=None):
    __foresee__({TICK[:-2]}_host__(line, value, {USED}, {PENDING}))

def {DRIVE}(line):
    __foresee__({DRIVE[:-2]}_host__(line, {USED}, {PENDING}))

def __flush__():
    {WISH}({PENDING})
    {PENDING}.clear()

def __new_slot__(question):
    if len(__slots__) >= {MAX_SLOTS}:
        __slots__.clear()
        __answers__.clear()
    slot = len(__slots__)
    __slots__[question] = slot
    return slot
"""

_READ = """
def {name}(*args, **options):
    slot = {no_slot}
    if not options:
        try:
            slot = __slots__.get(("{name}", args), {host})
        except TypeError:
            pass
        if 0 <= slot < len(__answers__){fresh}:
            found = __answers__[slot]
            if found != "{unknown}" and len({used}) < {most}:
                {used}.append(slot)
                return found
        elif slot == {host}:
            slot = __new_slot__(("{name}", args))
    {flush}{used}.append({host})
    return {hidden}(slot, *args, **options)
"""

_FLUSH = f"if {PENDING}:\n        __flush__()\n    "

_ACT = """
def {name}(*args, **options):
    __wished__.append(1){wait}
    {flush}{used}.append({host})
    return {hidden}(*args, **options)
"""

_WAIT = """
    if len(args) == 1 and not options and len({pending}) < {many}:
        number = args[0]
        if isinstance(number, float) and -1e9 < number < 1e9:
            {pending}.append(("{name}", number))
            {used}.append({later})
            return None"""


def hidden(name: str) -> str:
    """Name under which the sandbox reaches the host's own function."""
    return f"{name[:-2]}_host__" if name.endswith("__") else f"__{name}_host__"


def apis_named(trees: Iterable[ast.Module]) -> frozenset[str]:
    """Driving APIs whose name stands anywhere in the texts."""
    known = apis_of("town")
    return frozenset(
        node.id for tree in trees for node in all_nodes(tree) if isinstance(node, ast.Name) and node.id in known
    )


def stand_ins(names: Iterable[str]) -> str:
    """Text to be read before a program: the functions that look into the foreseen answers first."""
    parts = [_PERIOD]
    for name in sorted(names):
        words = {"name": name, "used": USED, "host": HOST, "hidden": hidden(name), "flush": _FLUSH}
        if name in FORESEEABLE:
            of_wishes = name in OF_WISHES
            words |= {"fresh": " and not __wished__" if of_wishes else "", "flush": _FLUSH if of_wishes else ""}
            parts.append(_READ.format(**words, no_slot=NO_SLOT, unknown=NOT_FORESEEN, most=MAX_FORESEEN))
        else:
            wait = _WAIT.format(name=name, used=USED, pending=PENDING, many=MAX_PENDING, later=LATER)
            parts.append(_ACT.format(**words, wait=wait if name in CAN_WAIT else ""))
    return "".join(parts)


def closing(main: str) -> str:
    """The last lines of a prepared program: run its main function, and say at the end which answers were used."""
    return f"{main}()\n{END}({USED}, {PENDING})\n"
