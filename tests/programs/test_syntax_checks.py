"""The gate refuses what Python's compiler refuses, though its parser does not; found by fuzzing, kept by comparison."""

from __future__ import annotations

import pytest
from straight_road import StraightRoad

from chauffeur.programs import ProgramExecutor, check_source
from chauffeur.programs.findings import Finding

END = "def main():\n    yield autopilot()\n"

MISPLACED = {
    "def main():\n    [a] = *10\n    yield autopilot()\n": (2, "a starred expression cannot stand here"),
    "def main():\n    yield autopilot()\n    return *10\n": (3, "a starred expression cannot stand here"),
    "def main():\n    *a = [1, 2]\n    yield autopilot()\n": (2, "a starred expression cannot stand here"),
    "def main():\n    *a, *b = [1, 2]\n    yield autopilot()\n": (2, "a starred expression cannot stand here"),
    "def main():\n    [a, [*b, *c]] = 1, [2]\n    yield autopilot()\n": (2, "a starred expression cannot stand here"),
    "def main():\n    for *a in [[1]]:\n        yield autopilot()\n": (2, "a starred expression cannot stand here"),
    "def main():\n    break\n    yield autopilot()\n": (2, "`break` stands outside a loop"),
    "def main():\n    break\n    while True:\n        yield autopilot()\n": (2, "`break` stands outside a loop"),
    f"break\n{END}": (1, "`break` stands outside a loop"),
    "def main():\n    if 1:\n        continue\n    yield autopilot()\n": (3, "`continue` stands outside a loop"),
    "def main():\n    while True:\n        yield autopilot()\n    else:\n        break\n": (
        5, "`break` stands outside a loop"),
    "def main():\n    for _ in (1, 2):\n        def f():\n            break\n        yield autopilot()\n": (
        4, "`break` stands outside a loop"),
    f"return 3\n{END}": (1, "`return` stands outside a function"),
    f"yield 3\n{END}": (1, "`yield` stands outside a function"),
    f"x = (yield from main())\n{END}": (1, "`yield` stands outside a function"),
    f"def f(a=(yield)):\n    return a\n{END}": (1, "`yield` stands outside a function"),
    f"def f(a, a):\n    return a\n{END}": (
        1, "this is not valid Python: duplicate argument 'a' in function definition"),
    f"f = lambda a, a: a\n{END}": (1, "this is not valid Python: duplicate argument 'a' in function definition"),
    f"nonlocal x\n{END}": (1, "this is not valid Python: nonlocal declaration not allowed at module level"),
    "def main():\n    nonlocal x\n    yield autopilot()\n": (
        2, "this is not valid Python: no binding for nonlocal 'x' found"),
    "x = 1\ndef main():\n    y = x\n    global x\n    yield autopilot()\n": (
        4, "this is not valid Python: name 'x' is used prior to global declaration"),
    f"x = 1\ndef f(x):\n    global x\n    return x\n{END}": (
        3, "this is not valid Python: name 'x' is parameter and global"),
    "def main():\n    x = [(yield autopilot()) for y in (1, 2)]\n": (
        2, "this is not valid Python: 'yield' inside list comprehension"),
    "def main():\n    x = [1 for y in (z := (1, 2))]\n    yield autopilot()\n": (
        2, "this is not valid Python: assignment expression cannot be used in a comprehension iterable expression"),
    "def main():\n    set_target_speed(target_speed=1, target_speed=2)\n    yield autopilot()\n": (
        2, "target_speed is given twice"),
    "def main():\n    try:\n        pass\n    except:\n        pass\n    except ValueError:\n        pass\n"
    "    yield autopilot()\n": (4, "`except:` stands before another `except`"),
}  # fmt: skip

REMEDIES = {
    "outside a loop": "leave it out",
    "outside a function": "move it into the main function",
    "starred": "leave the star out",
    "given twice": "give it once",
    "before another": "put it last",
}


def python_takes(source: str) -> bool:
    """Whether CPython's compiler takes a text; nothing is run."""
    try:
        compile(source, "program", "exec")
    except SyntaxError:
        return False
    return True


@pytest.mark.parametrize(("source", "found"), MISPLACED.items())
def test_what_the_compiler_refuses_is_refused(source: str, found: tuple[int, str]) -> None:
    assert not python_takes(source)
    report = check_source(source)
    assert not report.passed
    line, reason = found
    remedy = next((remedy for words, remedy in REMEDIES.items() if words in reason), "")
    assert Finding(line, "syntax", reason, remedy) in report.errors


TAKEN = [
    "a = *[1], 2",
    "a = [*(1, 2), *(3,)]\nb = {*a}",
    "a, *b = 1, 2\n(c, *d), *e = (1, 2), 3",
    "for a, *b in ((1, 2), (3, 4)):\n    say(str(max(*b, a)))",
    "for _ in (1, 2):\n    if _ > 1:\n        break\n    continue",
    "while True:\n    while True:\n        break\n    else:\n        break\n    yield autopilot()\n    break",
    "for _ in (1,):\n    try:\n        break\n    finally:\n        pass",
    "f = lambda a, b=1: a + b\nsay(str(f(1, b=2)))",
    "try:\n    pass\nexcept ValueError:\n    pass\nexcept:\n    pass",
    "def f(a):\n    return a\nsay(str(f(1)))",
    "def f(a):\n    def g():\n        nonlocal a\n        a = 2\n    g()\n    return a\nsay(str(f(1)))",
    "a = [b := 1, b]\nc = [(d := e) for e in (1, 2)]",
    "try:\n    pass\nexcept:\n    pass",
]


@pytest.mark.parametrize("body", TAKEN)
def test_what_the_compiler_takes_is_not_refused_and_runs(executor: ProgramExecutor, body: str) -> None:
    source = inside(body)
    assert python_takes(source) and check_source(source).passed
    executor.start(source, StraightRoad())
    assert executor.tick().error is None


def inside(body: str) -> str:
    lines = "".join(f"    {line}\n" for line in body.splitlines())
    return f"def main():\n{lines}    yield autopilot()\n"


FORMATS = [
    *("", "d", "5", "05", "x>5", "<", "^10", "=+5", "+d", " d", "-d", "z.1f", "#x", ",", "_", "_x", ",d", "08.3f"),
    *("n", "c", "e", "%", ".0%", ">>5", "é>5", "0>5", "<5n", "0", "-", "#", "{5}", ".{2}f", "{'x'}>{5}"),
]


@pytest.mark.parametrize("form", [*FORMATS, "a{2}", "a{2}6"])
def test_formats_that_can_be_are_not_refused(executor: ProgramExecutor, form: str) -> None:
    source = inside_say(form)
    assert check_source(source).findings == ()
    executor.start(source, StraightRoad())
    assert form not in FORMATS or executor.tick().error is None


@pytest.mark.parametrize(
    "form", ["05d6", "xx>5", "5d5", "+ d", "1 0", "e5", "!r", "d ", "..2f", "<<<5", "5,,d", "é" * 50]
)
def test_formats_that_cannot_be_are_refused(form: str) -> None:
    source = inside_say(form)
    assert check_source(source).errors == (
        Finding(2, "syntax", f"{form[:40]!r} is no format", "write e.g. f'{speed:.1f}'"),
    )


def inside_say(form: str) -> str:
    return f'def main():\n    say(f"{{1:{form}}}")\n    yield autopilot()\n'


def test_a_library_is_held_to_the_same() -> None:
    report = check_source("def main():\n    yield from go()\n", "def go():\n    break\n    yield autopilot()\n")
    assert [finding.reason for finding in report.errors] == ["line 2 of the library: `break` stands outside a loop"]


def test_many_faults_are_all_told() -> None:
    report = check_source("break\ncontinue\ndef f(a, a):\n    return a\n" + END)
    assert [finding.line for finding in report.errors] == [1, 2, 3]


def test_nothing_is_said_on_the_error_channel(recwarn: pytest.WarningsRecorder) -> None:
    check_source("def main():\n    x = '\\d' is '\\w'\n    yield autopilot()\n")
    assert not recwarn.list
