"""The rewrite keeps every statement on its line and changes only what it must."""

from __future__ import annotations

import ast
import re

import pytest

from chauffeur.concept import Program
from chauffeur.programs import ProgramSyntaxError
from chauffeur.programs.lower import PRELUDE, needs_prelude
from chauffeur.programs.rewrite import MAX_SOURCE_CHARS, _prepared, parse, prepare


def _rewritten(statement: str) -> str:
    source = f"def main():\n    yield\n    {statement}\n"
    prepared = prepare(source)
    ast.parse(prepared.program)
    assert prepared.program.count("\n") == source.count("\n") + 4
    return prepared.program.split("\n", 2)[2].rsplit("\n\n", 1)[0].strip()


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("yield", "__tick__(3, (None))"),
        ("yield autopilot()", "__drive__(3)"),
        ("yield(autopilot(\n))", "__drive__(3\n)"),
        ("x = yield autopilot()", "x = __drive__(3)"),
        ("yield autopilot(), 1", "__tick__(3, ( autopilot(), 1))"),
        ("yield autopilot(1)", "__tick__(3, ( autopilot(1)))"),
        ("yield autopilot", "__tick__(3, ( autopilot))"),
        ("autopilot = 3; yield autopilot()", "autopilot = 3; __tick__(3, ( autopilot()))"),
        ("x = yield a", "x = __tick__(3, ( a))"),
        ("x = (yield)", "x = (__tick__(3, (None)))"),
        ("yield a, b", "__tick__(3, ( a, b))"),
        ("yield *a,", "__tick__(3, ( *a,))"),
        ("yield(a)", "__tick__(3, ((a)))"),
        ("yield [\n    a,\n]", "__tick__(3, ( [\n    a,\n]))"),
        ("yield \\\n    a", "__tick__(3, ( \\\n    a))"),
        ("if a: yield 1; yield 2", "if a: __tick__(3, ( 1)); __tick__(3, ( 2))"),
        ("f((yield 1))", "f((__tick__(3, ( 1))))"),
        ("'é'; yield 'yield'", "'é'; __tick__(3, ( 'yield'))"),
        ("yield (yield 1)", "__tick__(3, ( (__tick__(3, ( 1)))))"),
        ("x.sort(key=k)", "__sort__(x, key=k)"),
        ("x.sort()", "x.sort()"),
        ("x.sort(\n    key=k)", "__sort__(x, \n    key=k)"),
        ("x[0].sort(key=k)", "__sort__(x[0], key=k)"),
        ("y = any(f(x) for x in z)", "y = (__find__(lambda x: True if (f(x)) else None, (z)) is not None)"),
        ("y = all(x for x in z if c)", "y = (__find__(lambda x: True if (c) and not (x) else None, (z)) is None)"),
        ("y = next(x for x in z)", "y = __take__(__find__(lambda x: ((x),), (z)))"),
        ("y = next((x for x in z if c), 3)", "y = __take__(__find__(lambda x: ((x),) if (c) else None, (z)), (3))"),
        (
            "y = any(a for a, b in z)",
            "y = (__find__(lambda __row__: (lambda a, b: True if (a) else None)(*__row__), (z)) is not None)",
        ),
        (
            "y = any(\n    x\n    for x in z\n)",
            "y = (__find__(lambda x: True if (x) else None, (z)) is not None\n\n\n)",
        ),
        ("y = any([x for x in z])", "y = any([x for x in z])"),
    ],
)
def test_statements(statement: str, expected: str) -> None:
    assert _rewritten(statement) == expected


def test_delegation_becomes_a_call() -> None:
    source = "def h(a):\n    yield a\ndef main():\n    x = yield from h(1)\n    yield  from h(2)\n"
    assert "x = ( h(1))" in prepare(source).program
    assert "    ( h(2))" in prepare(source).program


def test_library_ticks_report_the_line_of_the_text_that_is_shown() -> None:
    program = Program("def main():\n    yield from wait(3)\n    yield\n", library="def wait(n):\n    yield n\n")
    prepared = prepare(program.source, program.library)
    shown = program.text.splitlines()
    tick = re.search(r"__tick__\((\d+), \( n\)\)", prepared.helpers)
    assert tick is not None
    assert shown[int(tick[1]) - 1] == "    yield n"
    assert "    ( wait(3))" in prepared.program


def test_a_program_with_a_parenthesised_sort_still_parses() -> None:
    prepared = prepare("def main():\n    (x).sort(key=k)\n    (x.y[0] or z).sort(\n        key=k)\n    yield\n")
    ast.parse(prepared.program)


@pytest.mark.parametrize(
    "body",
    [
        "x = 1.5 + 20 - .5 + 5. + 0 + 0.0 + 1e5 + 1_000 + 0x10 + 3j  # 7 times 8.5\n    y = z[1:20] + z[0]",
        'say(f"{speed:.2f} m/s of 30, {x[3]:5.1f} {12.5 + x}")\n    say("at 90817 or 25.0")',
        "x = any(v > 3.5 for v in cars if v < 80)\n    cars.sort(key=lambda v: v * 2)\n    y = next((c for c in a), 4)",
        "x = [1.0, 1.0, 2, 1]\n    if 1.5 < x[2]: y = 5",
        "v2 = v1 + 2\n    say('it is 5.5.5 or 3.a')\n    x = 1if y else 2",
    ],
)
def test_a_program_with_other_numbers_is_rewritten_as_if_alone(body: str) -> None:
    text = f"def main():\n    {body}\n    yield autopilot()\n    yield 3.5\n"
    assert prepare(text) == _prepared(text, "")


@pytest.mark.parametrize("number", ["007", "90817263", "908172630001.5", "1.5.5"])
def test_odd_numbers_are_what_they_are_without_the_memory(number: str) -> None:
    text = f"def main():\n    x = {number}\n    yield\n"
    try:
        alone: object = _prepared(text, "")
    except ProgramSyntaxError as error:
        alone = str(error)
    try:
        found: object = prepare(text)
    except ProgramSyntaxError as error:
        found = str(error)
    assert found == alone


def test_main_and_its_line() -> None:
    prepared = prepare("import math\n\ndef a():\n    yield\n\ndef b():\n    yield\n\ndef c(x):\n    yield x\n")
    assert (prepared.main, prepared.main_line) == ("b", 6)
    assert prepared.program.endswith("__tick__(0, None)\nb()\n__end__(__used__, __pending__)\n")
    assert PRELUDE not in prepared.helpers
    assert prepared.stood_in == frozenset()


def test_prelude_is_python_and_comes_only_when_needed() -> None:
    ast.parse(PRELUDE)
    assert not needs_prelude(ast.parse("x = sorted([1]); y = max(1, 2)"))
    for text in ("max(x, key=f)", "x.sort(key=f)", "map(f, x)", "any(x)", "sorted(x, **o)"):
        assert needs_prelude(ast.parse(text))


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("x" * (MAX_SOURCE_CHARS + 1), "characters"),
        ("def main(:", "not valid Python"),
        ("x = " + "(" * 300, "not valid Python"),
        ("x = " + "-" * 15_000 + "1", "nested too deeply"),
        ("x = " + "[" * 60 + "]" * 60, "nested too deeply"),
        ("x = [" + "1," * 6000 + "]", "too long"),
        ("x = '\x00'", "not valid Python"),
        ("x = '\ud800'", "not valid Python"),
    ],
)
def test_size_limits(source: str, words: str) -> None:
    with pytest.raises(ProgramSyntaxError, match=words):
        parse(source)


def test_a_text_without_a_main_function() -> None:
    with pytest.raises(ProgramSyntaxError, match="no main function"):
        prepare("def main(ego):\n    yield\n")
