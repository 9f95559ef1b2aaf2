"""Answers given before they are asked for: a program's questions of one period are mostly those of the last.

A call from the sandbox to its host costs some 25 microseconds, a look into a table inside the sandbox about two. So
with each new control period the host sends the answers to what the program asked in the period before, and small
functions inside the sandbox, named like the driving APIs, look there first. Whatever is not foreseen is asked of the
host as ever. The answers are the same either way, because nothing in the world moves within a period; those that depend
on the program's own wishes are forgotten as soon as it wishes something.

Which answers were used, and between which calls, is told to the host at the end of the period (`__used__`: a number of
an answer, or -1 for a call that reached the host), so that the record of calls is complete and in order. The list is
the program's word and only goes into that record.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable
from typing import Final

from chauffeur.programs.catalogue import APIS
from chauffeur.programs.nodes import all_nodes

TICK: Final = "__tick__"
"""What a yield turns into, and the host call behind it."""

DRIVE: Final = "__drive__"
"""What `yield autopilot()` turns into, and the host call behind it: `autopilot()`, then the yield."""

END: Final = "__end__"
"""The host call after the main function has returned."""

USED: Final = "__used__"

MAX_FORESEEN: Final = 200
"""Answers used in a period before the program has to ask the host again, which counts and stops it."""

OF_WISHES: Final = frozenset(
    {"is_safe_enter", "get_target_speed", "get_desired_time_headway", "detect_stop_sign_ahead"}
)
"""Questions whose answer depends on what the program has wished."""

FORESEEABLE: Final = frozenset(
    api.name for api in APIS.values() if api.effect == "read" and api.returns in {"number", "flag", "vehicle", "lane"}
)
"""Questions that may be answered beforehand. A list is not: the program could change it and ask again."""

_PERIOD = f"""
__facts__, __moods__, {USED} = {{}}, {{}}, []

def __foresee__(answers):
    {USED}.clear()
    __facts__.clear()
    __moods__.clear()
    if answers is not None:
        __facts__.update(answers[0])
        __moods__.update(answers[1])

def {TICK}(line, value=None):
    __foresee__({TICK[:-2]}_host__(line, value, {USED}))

def {DRIVE}(line):
    __foresee__({DRIVE[:-2]}_host__(line, {USED}))
"""

_READ = """
def {name}(*args, **options):
    if not options:
        try:
            found = {table}.get(("{name}", args))
        except TypeError:
            found = None
        if found is not None and len({used}) < {most}:
            {used}.append(found[0])
            return found[1]
    {used}.append(-1)
    return {hidden}(*args, **options)
"""

_ACT = """
def {name}(*args, **options):
    __moods__.clear()
    {used}.append(-1)
    return {hidden}(*args, **options)
"""


def hidden(name: str) -> str:
    """Name under which the sandbox reaches the host's own function."""
    return f"{name[:-2]}_host__" if name.endswith("__") else f"__{name}_host__"


def apis_named(trees: Iterable[ast.Module]) -> frozenset[str]:
    """Driving APIs whose name stands anywhere in the texts."""
    return frozenset(
        node.id for tree in trees for node in all_nodes(tree) if isinstance(node, ast.Name) and node.id in APIS
    )


def stand_ins(names: Iterable[str]) -> str:
    """Text to be read before a program: the functions that look into the foreseen answers first."""
    parts = [_PERIOD]
    for name in sorted(names):
        table = "__moods__" if name in OF_WISHES else "__facts__"
        form = _READ if name in FORESEEABLE else _ACT
        parts.append(form.format(name=name, table=table, used=USED, most=MAX_FORESEEN, hidden=hidden(name)))
    return "".join(parts)


def closing(main: str) -> str:
    """The last lines of a prepared program: run its main function, and say at the end which answers were used."""
    return f"{main}()\n{END}({USED})\n"
