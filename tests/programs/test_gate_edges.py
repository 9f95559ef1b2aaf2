"""What the gate says, word by word, of one program for each thing it looks at; models repair their programs by it."""

from __future__ import annotations

import pytest

from chauffeur.programs import check_source
from chauffeur.programs.findings import Finding

Said = list[tuple[int | None, str, str, str]]
END = "    yield autopilot()\n"
MAIN = f"def main():\n{END}"


def inside(body: str) -> str:
    return "def main():\n" + "".join(f"    {line}\n" for line in body.splitlines()) + END


# fmt: off
ONLY_MATH = "only math can be imported; the driving APIs are there without an import"
NO_REACH = "programs cannot reach files, the interpreter or other objects; use only the driving APIs"
HELPER = "write `yield from helper(...)`, or `yield autopilot()` inside a loop"
OTHER_NAME = "give your own function another name"
WRITE_ONE = "write one generator function without parameters"
EACH_PERIOD = "yield autopilot() once per control period, e.g. `while True: yield autopilot()`"
BASICS = "use only the driving APIs, your own functions and Python's basics"
NO_ATTRIBUTES = "vehicles and lanes have no attributes; use the driving APIs"
GET_THEM = "get them from get_ego_vehicle(), detect_front_vehicle_in() or get_lane_of()"
CALLED = "write `yield from f(...)`; the main function is called for you"
DIRECT = "`yield from` takes only a direct call of a generator function of this program or of the library"
AS_GENERATOR = "f is a generator function; it can only be called as `yield from f(...)`"
MAIN_AS_GENERATOR = "main is a generator function; it can only be called as `yield from main(...)`"
YIELD_IN_LOOP = "put `yield autopilot()` into the loop; nothing on the road changes until a yield"
MAIN_CALLED = "write `yield from main(...)`; the main function is called for you"
GO_HIDES = "this go hides the library's function of that name and only calls itself"
WAIT = "def wait():\n    yield autopilot()\n"
WAIT_HIDES = "this wait hides the library's function of that name and only calls itself"

IN_A_FUNCTION: dict[str, Said] = {
    "__x = 1": [(2, "reserved", "the name __x is reserved", "use another name")],
    "x = __y": [(2, "reserved", "the name __y is reserved", "use another name")],
    "__tick__(1)": [(2, "reserved", "the name __tick__ is reserved", "use another name")],
    "say(nobody)": [(2, "unknown-name", "nobody is not defined", BASICS)],
    "say(str(math.pi))": [(2, "unknown-name", "math is not defined", "write `import math` first")],
    "say(get_speed_limitt())": [
        (2, "unknown-name", "get_speed_limitt is not defined", "did you mean get_speed_limit?"),
    ],
    "x = (1)._y": [(2, "attribute", "the attribute _y is private", "use only the driving APIs")],
    "import math\nx = math.sine(1)": [(3, "attribute", "math has no sine", "did you mean sin?")],
    "import math as m\nx = m.sine(1)": [(3, "attribute", "math has no sine", "did you mean sin?")],
    "x = [1].frobnicate()": [(2, "attribute", "nothing here has an attribute frobnicate", NO_ATTRIBUTES)],
    "x = [1]\nx.append = 2": [(3, "attribute", "nothing here has an attribute append", NO_ATTRIBUTES)],
    "ego = get_ego_vehicle()\nx = ego.speed": [
        (3, "attribute", "nothing here has an attribute speed", "use get_speed_of(vehicle)"),
    ],
    "ego = get_ego_vehicle()\nego.get_speed_of()": [
        (3, "attribute", "nothing here has an attribute get_speed_of", "write get_speed_of(...)"),
    ],
    "import os": [(2, "import", "os cannot be imported", ONLY_MATH)],
    "import math, os": [(2, "import", "os cannot be imported", ONLY_MATH)],
    "from os import path": [(2, "import", "os cannot be imported", ONLY_MATH)],
    "from . import x": [(2, "import", "a relative module cannot be imported", ONLY_MATH)],
    "from math import sine": [(2, "import", "math has no sine", "did you mean sin?")],
    "from math import sin, sine": [(2, "import", "math has no sine", "did you mean sin?")],
    "import math.x": [(2, "import", "math.x cannot be imported", ONLY_MATH)],
    "x = 'veh:3'": [(2, "handle", "vehicles and lanes cannot be written down", GET_THEM)],
    "x = 'lane:a-b:0'": [(2, "handle", "vehicles and lanes cannot be written down", GET_THEM)],
    "x = b'1'": [(2, "not-allowed", "bytes values are not part of the language", "leave it out")],
    "x = 1j": [(2, "not-allowed", "complex values are not part of the language", "leave it out")],
    "yield from [autopilot()]": [(2, "yield-from", DIRECT, HELPER)],
    "yield from f()": [(2, "unknown-name", "f is not defined", BASICS), (2, "yield-from", DIRECT, HELPER)],
    "yield from len('a')": [(2, "yield-from", DIRECT, HELPER)],
    "get_speed_of = 1": [(2, "shadow", "get_speed_of is a driving API and cannot be redefined", "use another name")],
    "any = 1": [(2, "shadow", "any is a built-in function and cannot be redefined", "rename it")],
    "len = 1": [],
    "main()": [(2, "generator-use", MAIN_AS_GENERATOR, MAIN_CALLED)],
    "f = lambda: (yield autopilot())": [(2, "not-allowed", "a lambda cannot yield", "use a function")],
    "say(f'{(yield autopilot())}')": [
        (2, "not-allowed", "a yield cannot stand inside an f-string", "assign it to a name first"),
    ],
    "class A:\n    pass": [
        (2, "not-allowed", "classes are not part of the language", "use functions and plain variables"),
    ],
    "with 1:\n    pass": [
        (2, "not-allowed", "`with` is not part of the language", "there is nothing to open; leave it out"),
    ],
    "async def f():\n    pass": [
        (2, "not-allowed", "async functions are not part of the language", "use a plain generator function"),
    ],
    "del x": [(2, "not-allowed", "`del` is not part of the language", "assign None instead")],
    "match 1:\n    case 1:\n        pass": [
        (2, "not-allowed", "`match` is not part of the language", "use if and elif"),
        (3, "not-allowed", "MatchValue is not part of the language", "leave it out"),
    ],
    "global g\ng = 1": [],
    "assert True": [],
    "x: int = 3": [],
    "while True:\n    pass": [(2, "no-yield", "this loop never yields and may never end", YIELD_IN_LOOP)],
}
"""Body of a main function: findings (line, code, reason, remedy)."""

WHOLE: dict[tuple[str, str, str | None], Said] = {
    ("def f(n):\n    return n\n", "", None): [
        (1, "no-main", "f never yields, so the car would never be driven", EACH_PERIOD),
    ],
    ("", "", None): [(None, "no-main", "the program defines no function", WRITE_ONE)],
    ("x = 1\n", "", None): [(None, "no-main", "the program defines no function", WRITE_ONE)],
    ("def f(n):\n    yield autopilot()\n", "", None): [
        (1, "no-main", "the main function f needs arguments",
         "a main function takes none; get the ego with get_ego_vehicle()"),
    ],
    ("def f():\n    return 1\n", "", None): [
        (1, "no-main", "f never yields, so the car would never be driven", EACH_PERIOD),
    ],
    ("def f():\n    return 1\n\ndef g():\n    pass\n", "", None): [
        (4, "no-main", "g never yields, so the car would never be driven", EACH_PERIOD),
    ],
    ("def f(:\n", "", None): [(1, "syntax", "The program is not valid Python: invalid syntax.", "")],
    (MAIN, "def f(:", None): [(None, "library", "The library is not valid Python: invalid syntax.", "")],
    (MAIN, "x = 1\n", "main"): [
        (None, "library", "line 1 of the library: a library holds functions only", "move it into a function"),
    ],
    (MAIN, "def len(x):\n    return 1\n", "main"): [
        (None, "library", "line 1 of the library: len is a built-in function", "rename it"),
    ],
    (MAIN, "import math\ndef f():\n    return open('x')\n", "main"): [
        (None, "library", "line 3 of the library: open is not defined", NO_REACH),
    ],
    ("def f():\n    yield autopilot()\n\ndef main():\n    f = 1\n    yield from f()\n", "", "main"): [
        (5, "shadow", "f is also the name of a generator function", "use another name for one"),
    ],
    ("def f(f):\n    yield autopilot()\n\ndef main():\n    yield from f(1)\n    yield autopilot()\n", "", "main"): [
        (1, "shadow", "f is also the name of a generator function", "use another name for one"),
    ],
    ("def wait():\n    yield from wait(3)\n    yield autopilot()\n", "def wait(n):\n    yield autopilot()\n", "wait"): [
        (2, "shadow", WAIT_HIDES, OTHER_NAME),
    ],
    ("def wait():\n    yield from wait()\n\ndef main():\n    yield from wait()\n", WAIT, "main"): [
        (2, "shadow", WAIT_HIDES, OTHER_NAME),
    ],
    ("def wait():\n    def wait():\n        yield autopilot()\n    yield from wait()\n\n"
     "def main():\n    yield from wait()\n", WAIT, "main"): [
    ],
    ("def other():\n    return 1\n\ndef wait():\n    def wait():\n        yield autopilot()\n    yield from wait()\n\n"
     "def go():\n    yield from go()\n\ndef main():\n    yield from go()\n",
     f"{WAIT}\ndef go():\n    yield autopilot()\n", "main"): [
        (10, "shadow", GO_HIDES, OTHER_NAME),
    ],
    ("def f():\n    yield autopilot()\n\ndef main():\n    f()\n    yield autopilot()\n", "", "main"): [
        (5, "generator-use", AS_GENERATOR, CALLED),
    ],
    ("def f():\n    yield autopilot()\n\ndef main():\n    x = f\n    yield autopilot()\n", "", "main"): [
        (5, "generator-use", AS_GENERATOR, CALLED),
    ],
    ("set_target_speed(3)\n" + MAIN, "", "main"): [
        (1, "top-level", "set_target_speed is called outside a function, before the drive begins",
         "move it into the main function"),
    ],
    ("def f(v=get_speed_limit()):\n    return v\n" + MAIN, "", "main"): [
        (1, "top-level", "get_speed_limit is called outside a function, before the drive begins",
         "move it into the main function"),
    ],
    ("def f(*, v=get_speed_limit()):\n    return v\n" + MAIN, "", "main"): [
        (1, "top-level", "get_speed_limit is called outside a function, before the drive begins",
         "move it into the main function"),
    ],
    ("def f(*, v):\n    return v\n" + MAIN, "", "main"): [],
    ("@len\n" + MAIN, "", "main"): [(2, "not-allowed", "decorators are not part of the language", "leave them out")],
}
"""(Program, library, name of the main function): findings."""
# fmt: on


@pytest.mark.parametrize(
    ("source", "library", "main", "said"),
    [
        *((inside(body), "", "main", said) for body, said in IN_A_FUNCTION.items()),
        *((*key, said) for key, said in WHOLE.items()),
    ],
)
def test_what_the_gate_says(source: str, library: str, main: str | None, said: Said) -> None:
    report = check_source(source, library)
    assert [(one.line, one.code, one.reason, one.remedy) for one in report.findings] == said
    assert report.main == main
    assert report.passed is not bool(said)
    assert all(one.severity == "error" for one in report.findings)


def test_twenty_findings_are_enough() -> None:
    report = check_source(inside("\n".join(f"x{i} = nobody{i}" for i in range(30))))
    assert [one.line for one in report.findings] == list(range(2, 22))


def test_beyond_two_hundred_findings_nothing_is_collected_or_looked_up() -> None:
    lines = [f"x = get_speed_limi{i}" for i in range(250)]
    report = check_source(inside("\n".join(["__a = 1", *lines])))
    assert len(report.findings) == 20
    assert all(one.remedy for one in report.findings)
    for shallow, found in ((199, True), (200, False)):
        # Deep in its line and so looked at last; it would be the first to be shown.
        text = inside("\n".join(["x = [[[[[nobody]]]]]", *(f"x = (1)._y{i}" for i in range(shallow))]))
        assert ("unknown-name" in [one.code for one in check_source(text).findings]) is found


@pytest.mark.parametrize(
    "name", ["open", "exec", "eval", "compile", "input", "globals", "locals", "getattr", "setattr", "vars"]
)
def test_what_reaches_out_is_named_as_such(name: str) -> None:
    (found,) = check_source(inside(f"{name}()")).findings
    assert found == Finding(2, "unknown-name", f"{name} is not defined", NO_REACH)


LONG = "a" * 80


@pytest.mark.parametrize(
    ("body", "shown"),
    [
        (f"say({LONG})", f"{LONG[:60]} is not defined"),
        (f"import {LONG}", f"{LONG[:40]} cannot be imported"),
        (f"from math import {LONG}", f"math has no {LONG[:40]}"),
        (f"import math\nx = math.{LONG}", f"math has no {LONG[:40]}"),
        (f"x = [1].{LONG}()", f"nothing here has an attribute {LONG[:40]}"),
        (f"x = (1)._{LONG}", f"the attribute _{LONG[:39]} is private"),
        (f"__{LONG} = 1", f"the name __{LONG[:38]} is reserved"),
        (f"x = __{LONG}", f"the name __{LONG[:38]} is reserved"),
        (f"def __{LONG}():\n    pass", f"the name __{LONG[:38]} is reserved"),
        (f"f = lambda __{LONG}: 1", f"the name __{LONG[:38]} is reserved"),
        (f"set_target_speed({LONG}=1, {LONG}=2)", f"{LONG[:40]} is given twice"),
    ],
)
def test_long_names_are_cut(body: str, shown: str) -> None:
    assert shown in [one.reason for one in check_source(inside(body)).findings]


def test_findings_of_one_line_and_kind_are_told_once_and_in_order() -> None:
    report = check_source(inside("x = nobody + nobody\ny = 'veh:1' + somebody"))
    assert [(one.line, one.code, one.reason.split()[0]) for one in report.findings][:3] == [
        (2, "unknown-name", "nobody"),
        (3, "handle", "vehicles"),
        (3, "unknown-name", "somebody"),
    ]


@pytest.mark.parametrize(
    "body",
    [
        "import math\nx = math.sqrt(2)",
        "import math as m\nx = m.pi",
        "from math import sin, pi\nx = sin(pi)",
        "import math, math as m\nx = math.e + m.e",
        "x = [1]\nx.append(2)\nx.sort()",
        "x = 'vehicle: 1' + 'lanes'",
        "x, y = 1.5, True",
        "f = lambda v: v\nx = f(1)",
        "def len(x):\n    return 1\nx = len([])",
        "_x = 1\nx = _x",
        "x = ...\ny = None",
    ],
)
def test_what_the_gate_has_nothing_to_say_of(body: str) -> None:
    assert check_source(inside(body)).findings == ()


def test_one_finding_does_not_drive_out_another() -> None:
    report = check_source(
        inside("x = nobody\ny = get_lane_of(get_ego_vehicle()) - 1\nz = get_speed_of(get_lane_of(x))")
    )
    assert [(one.line, one.code) for one in report.findings] == [(2, "unknown-name"), (3, "handle"), (4, "argument")]
    report = check_source(inside("x = nobody\ny = get_ego_vehicle()\nz = y < y"))
    assert [(one.line, one.code) for one in report.findings] == [(2, "unknown-name"), (4, "handle")]


def test_a_warning_does_not_refuse() -> None:
    report = check_source(
        inside("front = detect_front_vehicle_in(get_lane_of(get_ego_vehicle()))\nx = get_speed_of(front)")
    )
    assert report.passed == (not [one for one in report.findings if one.severity == "error"])
    warned = Finding(3, "a", "b", "c", "warning")
    assert (str(warned), str(Finding(None, "a", "b", ""))) == ("line 3: b; c", "b")


def test_the_order_of_line_ends_does_not_matter() -> None:
    source = inside("x = nobody")
    for ends in ("\r\n", "\r"):
        assert check_source(source.replace("\n", ends)).findings == check_source(source).findings
    library = "def go():\n    x = nobody\n    yield autopilot()\n"
    caller = "def main():\n    yield from go()\n"
    for ends in ("\r\n", "\r"):
        assert check_source(caller, library.replace("\n", ends)).findings == check_source(caller, library).findings


def test_libraries_may_hold_functions_and_imports_only() -> None:
    caller = "def main():\n    yield from go()\n"
    good = "import math\nfrom math import pi\n\ndef go():\n    x = math.e + pi\n    yield autopilot()\n"
    assert check_source(caller, good).passed
    bad = check_source(caller, good + "go()\nx = 1\n")
    assert [one.reason for one in bad.errors][:2] == [
        "line 7 of the library: a library holds functions only",
        "line 8 of the library: a library holds functions only",
    ]


def test_what_a_library_imports_is_known_to_the_program() -> None:
    library = "from math import pi\n\ndef go():\n    yield autopilot()\n"
    assert check_source("def main():\n    x = pi\n    yield from go()\n", library).passed
    assert not check_source("def main():\n    x = e\n    yield from go()\n", library).passed
