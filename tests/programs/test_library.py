"""Programs as helper functions: which are needed, and one that stands by itself drives as it did before."""

from __future__ import annotations

import pytest
from straight_road import StraightRoad

from chauffeur.programs import ProgramExecutor, ProgramSyntaxError, Sandbox, check_source
from chauffeur.programs.library import function_names, join, main_name, needed, standalone

HELPERS = (
    "def wait_a_bit():\n    yield autopilot()\n    yield autopilot()\n\n\ndef rest():\n    yield from wait_a_bit()\n"
)

PROGRAMS = {
    "plain": "def a():\n    for _ in range(2):\n        yield autopilot()\n    say('end')\n",
    "commented": "# first\n\n\ndef a():  # a\n    # inside\n    yield\n    say('end')\n",
    "spaced": "def   a  ( ):\n\tyield\n\tif True:\n\t\tsay('end')\n",
    "module": (
        "import math\n\nMOST = 2\n\ndef count(n):\n    global last\n    last = n\n    for _ in range(n):\n"
        "        yield autopilot()\n    return n\n\n"
        "def a():\n    '''Two\n  lines.'''\n    n = yield from count(math.floor(2.5))\n"
        "    say(f'{n} {last} {MOST}')\n    say('''x\n  y''')\n"
    ),
    "recursive": (
        "def a():\n    if get_target_speed() < 1:\n        yield\n        return\n    set_target_speed(0)\n"
        "    yield from a()\n    say('end')\n"
    ),
    "delegating": "def a():\n    say('on')\n    yield from rest()\n    say('end')\n",
    "parameter": "def a(steps=2):\n    for _ in range(steps):\n        yield autopilot()\n    say(str(steps))\n",
    "windows": "def a():\r\n    yield autopilot()\r\n    say('end')\r\n",
    "search": (
        "def a():\n    found = any(x > 1 for x in [1, 2])\n    yield\n"
        "    say(str(found) + str(max([1, 3], key=lambda x: -x)))\n"
    ),
}


def drive(sandbox: Sandbox, source: str, library: str = "") -> list[tuple[str, tuple[str, ...], float | None]]:
    with ProgramExecutor(sandbox=sandbox, library=library) as executor:
        executor.start(source, StraightRoad())
        ticks = [executor.tick() for _ in range(5)]
    assert all(tick.error is None for tick in ticks), ticks[-1].error
    return [(tick.state, tick.said, tick.setpoints.target_speed_mps) for tick in ticks]


@pytest.mark.parametrize("name", ["a", "other", "aV2"])
@pytest.mark.parametrize("case", PROGRAMS)
def test_a_program_that_stands_by_itself_drives_as_before(sandbox: Sandbox, case: str, name: str) -> None:
    source = PROGRAMS[case]
    before = drive(sandbox, source, needed(source, HELPERS))
    alone = standalone(source, name, HELPERS)
    assert main_name(alone) == name and function_names(alone) == (name,)
    assert check_source(alone).passed
    assert drive(sandbox, alone) == before
    assert standalone(alone, name) == alone, "once is enough"
    called = drive(sandbox, f"def caller():\n    yield from {name}()\n", alone)
    assert called == before


def test_only_what_is_called_travels() -> None:
    assert needed("def a():\n    yield\n", HELPERS) == ""
    assert function_names(needed("def a():\n    yield from wait_a_bit()\n", HELPERS)) == ("wait_a_bit",)
    assert function_names(needed("def a():\n    yield from rest()\n", HELPERS)) == ("wait_a_bit", "rest")
    own = "def rest():\n    yield\n\ndef a():\n    yield from rest()\n"
    assert needed(own, HELPERS) == ""
    assert needed("def (", HELPERS) == "" and needed("def a():\n    yield from rest()\n", "def (") == ""
    assert function_names("def (") == ()


def test_libraries_side_by_side_share_no_names(sandbox: Sandbox) -> None:
    one = (
        "STEPS = 1\ndef wait():\n    for _ in range(STEPS):\n        yield\n\n"
        "def a():\n    yield from wait()\n    say('one')\n"
    )
    two = one.replace("STEPS = 1", "STEPS = 2").replace("one", "two")
    library = join([standalone(one, "a"), standalone(two, "aV2")])
    told = drive(sandbox, "def main():\n    yield from a()\n    yield from aV2()\n    yield\n", library)
    assert [said for _, said, _ in told] == [(), ("one",), (), ("two",), ()]


def test_texts_that_are_no_programs_are_refused() -> None:
    for text in ("def (", "x = 1\n", "def a(x):\n    yield x\n"):
        with pytest.raises(ProgramSyntaxError):
            standalone(text, "a")
    with pytest.raises(ProgramSyntaxError):
        main_name("x = 1\n")


def test_a_library_is_judged_like_a_program() -> None:
    main = "def main():\n    yield from helper()\n"
    assert check_source(main, "def helper():\n    yield autopilot()\n").passed
    for bad in (
        "def helper():\n    import os\n    yield\n",
        "def helper():\n    while True:\n        pass\n    yield\n",
        "def helper():\n    open('/etc/passwd')\n    yield\n",
        "def helper():\n    yield\n\nset_target_speed(90)\n",
        "def helper():\n    yield\n\ndef min(a, b):\n    return 0\n",
        "def helper():\n    yield\n\ndef autopilot():\n    return 0\n",
        "from os import system\n\ndef helper():\n    yield\n",
        "def helper():\n    yield\n\nx = 1\n",
    ):
        report = check_source(main, bad)
        assert not report.passed and {finding.code for finding in report.errors} == {"library"}, bad


def test_a_function_that_hides_the_helper_it_means_to_call_is_refused() -> None:
    library = "def overtake():\n    yield autopilot()\n"
    report = check_source("def overtake():\n    say('now')\n    yield from overtake()\n", library)
    assert [finding.code for finding in report.errors] == ["shadow"] and report.errors[0].line == 3
    assert check_source("def overtake():\n    yield autopilot()\n", library).passed
    assert check_source("def overtake():\n    yield from overtake()\n    yield\n").passed, "recursion is Python's own"


def test_names_inside_a_helper_are_its_own() -> None:
    library = "def helper():\n    def inner():\n        yield\n    yield from inner()\n"
    assert not check_source("def main():\n    yield from inner()\n", library).passed
    assert check_source(
        "def main():\n    inner = 3\n    yield from helper()\n    say(str(inner))\n    yield\n", library
    ).passed
