"""The static gate: what it refuses, in which line, and in words a model can act on."""

from __future__ import annotations

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chauffeur.programs import APIS, GateReport, check_source


def _main(body: str) -> str:
    lines = "\n".join(f"    {line}" for line in body.split("\n"))
    return f"def main():\n    ego = get_ego_vehicle()\n{lines}\n    yield autopilot()\n"


REFUSED: dict[str, tuple[str, str, int, str]] = {
    # name: (body or program, code, line, words in the finding)
    "unknown api": ("fly()", "unknown-name", 3, "use only the driving APIs"),
    "invented lane change": ("change_lane_left(ego)", "unknown-name", 3, "set_target_lane(lane)"),
    "invented brake": ("emergency_brake()", "unknown-name", 3, "set_target_speed"),
    "near miss": ("get_speed(ego)", "unknown-name", 3, "did you mean get_speed_of?"),
    "typo of own name": ("target = 3\nset_target_speed(targt)", "unknown-name", 4, "did you mean target?"),
    "sleep": ("sleep(1)", "unknown-name", 3, "yield autopilot()"),
    "too many arguments": ("get_speed_of(ego, ego)", "call", 3, "at most 1 (veh), but is given 2"),
    "no arguments": ("get_ego_vehicle(1)", "call", 3, "takes no arguments"),
    "missing argument": ("set_target_speed()", "call", 3, "needs 'target_speed'"),
    "unknown keyword": ("set_target_speed(kmh=90)", "call", 3, "has no parameter 'kmh'"),
    "given twice": ("get_speed_of(ego, veh=ego)", "call", 3, "twice"),
    "starred call": ("get_speed_of(*[ego])", "call", 3, "one by one"),
    "kilometres per hour": ("set_target_speed(250)", "range", 3, "250 km/h is 69.4 m/s"),
    "computed range": ("set_target_speed(2 * 60 + 5)", "range", 3, "outside 0 to 70"),
    "negative speed": ("set_target_speed(-5)", "range", 3, "cannot be negative"),
    "gap as headway": ("set_desired_time_headway(25)", "range", 3, "divide a gap in metres by the speed"),
    "negative distance": ("detect_front_vehicle_in(get_lane_of(ego), -10)", "range", 3, "cannot be negative"),
    "braking of a meteorite": ("is_safe_enter(get_left_lane(ego), safe_decel=50)", "range", 3, "outside 0 to 15"),
    "text as speed": ("set_target_speed('fast')", "argument", 3, "needs a number in m/s"),
    "flag as speed": ("set_target_speed(True)", "argument", 3, "needs a number"),
    "none as vehicle": ("get_speed_of(None)", "argument", 3, "not None"),
    "number as vehicle": ("get_speed_of(0)", "argument", 3, "needs a vehicle"),
    "tuple as lane": ("set_target_lane(('a', 'b', 0))", "argument", 3, "needs a lane"),
    "lane as vehicle": ("get_speed_of(get_lane_of(ego))", "argument", 3, "is given a lane"),
    "vehicle as lane": ("set_target_lane(ego)", "argument", 3, "is given a vehicle"),
    "vehicle's lane": ("x = ego.lane_index", "attribute", 3, "use get_lane_of(vehicle)"),
    "setting an attribute": ("ego.speed = 3", "attribute", 3, "get_speed_of"),
    "indexing a lane": ("lane = get_lane_of(ego)\nx = lane[2]", "handle", 4, "cannot be indexed"),
    "arithmetic on a lane": ("x = get_lane_of(ego) - 1", "handle", 3, "get_left_lane"),
    "comparing vehicles": ("x = ego < ego", "handle", 3, "has no order"),
    "identity": ("front = detect_front_vehicle_in(get_lane_of(ego))\nx = front is ego", "is", 4, "use == or !="),
    "match": ("match 3:\n    case _:\n        pass", "not-allowed", 3, "use if and elif"),
    "decorator": ("@say\ndef f():\n    pass", "not-allowed", 4, "decorators"),
    "polling loop": ("safe = False\nwhile not safe:\n    safe = is_safe_enter(None)", "no-yield", 4, "never yields"),
    "unreachable yield": ("while True:\n    continue\n    yield", "no-yield", 3, "can never be reached"),
    "long count": ("for i in range(1000000):\n    x = i", "no-yield", 3, "1000000 passes"),
    "kept generator": ("g = (i for i in [1])", "lazy", 3, "write a list"),
    "loop over generator": ("for i in (i for i in [1]):\n    pass", "lazy", 3, "write a list"),
    "kept map": ("m = map(str, [1])", "lazy", 3, "list(map(...))"),
    "kept zip": ("z = zip([1], [2])", "lazy", 3, "list(zip(...))"),
    "search in f-string": ("say(f'{any(i for i in [1])}')", "lazy", 3, "assign it to a name first"),
    "two-argument iter": ("x = iter(get_target_speed, 3)", "lazy", 3, "iter takes one argument"),
}

PROGRAMS: dict[str, tuple[str, str, int | None, str]] = {
    "prose": ("Sure! Here is the program.", "syntax", 1, "not valid Python"),
    "too long": ("#" * 30_000, "syntax", None, "20000 are allowed"),
    "too deep": (f"x = {'[' * 60}{']' * 60}", "syntax", 1, "nested too deeply"),
    "for over a generator": (
        "def helper():\n    yield 1\ndef main():\n    for x in helper():\n        yield x\n",
        "generator-use",
        4,
        "yield from helper(...)",
    ),
    "main called": ("def main():\n    yield autopilot()\nmain()\n", "generator-use", 3, "called for you"),
    "policy assigned": ("def main():\n    yield autopilot()\npolicy = main()\n", "generator-use", 3, "called for you"),
    "async": ("async def main():\n    yield 1\n", "not-allowed", 1, "async functions"),
    "generator rebound": (
        "def helper():\n    yield\nhelper = 3\ndef main():\n    yield from helper()\n",
        "shadow",
        3,
        "also the name of a generator function",
    ),
}


def _assert_found(report: GateReport, code: str, line: int | None, words: str) -> None:
    assert not report.passed
    matching = [f for f in report.errors if f.code == code]
    assert matching, report.findings
    assert any(f.line == line for f in matching), report.findings
    assert any(words in str(f) for f in matching), report.findings


@pytest.mark.parametrize("name", REFUSED)
def test_refuses_in_words(name: str) -> None:
    body, code, line, words = REFUSED[name]
    _assert_found(check_source(_main(body)), code, line, words)


@pytest.mark.parametrize("name", PROGRAMS)
def test_refuses_programs(name: str) -> None:
    source, code, line, words = PROGRAMS[name]
    _assert_found(check_source(source), code, line, words)


@pytest.mark.parametrize(
    "body",
    [
        "n = 0\nwhile n < 5:\n    n += 1",
        "lanes = [1, 2]\nwhile lanes:\n    lanes.pop()",
        "n = 64\nwhile True:\n    n = n // 2\n    if n < 1:\n        break",
        "while True:\n    yield autopilot()\n    if get_speed_of(ego) < 1:\n        break",
        "while get_speed_of(ego) > 1:\n    if is_safe_enter(None):\n        return\n    yield autopilot()",
        "while True:\n    break",
        "while False:\n    pass",
        "set_target_speed(70)\nset_target_speed(0)\nset_desired_time_headway(3)",
        "set_target_speed(120 / 3.6)",
        "set_target_speed(get_target_speed() - 500)",
        "x = None\nx = detect_front_vehicle_in(None)\nx = x is not None and x != ego",
        "d = {'veh': 1}\nd.update(a=2)\nx = d['veh'] - 1",
        "print('debugging')",
        "import math as m\nx = m.sqrt(m.pi)",
        "for v in (ego, ego):\n    x = [get_speed_of(v)][0]",
    ],
)
def test_allows(body: str) -> None:
    report = check_source(_main(body))
    assert report.findings == (), report.findings


def test_a_pass_without_yield_is_a_warning_only() -> None:
    report = check_source(_main("while True:\n    if get_speed_of(ego) > 5:\n        yield autopilot()"))
    assert report.passed
    assert [f.code for f in report.findings] == ["may-spin"]
    assert "else: yield autopilot()" in str(report.findings[0])


def test_main_is_the_last_top_level_generator_without_arguments() -> None:
    source = (
        "def first():\n    yield\n"
        "def main(speed=3, *, gap=1):\n    def nested():\n        yield\n    yield from nested()\n"
        "def helper(x):\n    yield\n"
        "def plain():\n    pass\n"
    )
    assert check_source(source).main == "main"


def test_library_functions_are_known_and_checked_alike() -> None:
    library = "def wait(ticks):\n    for _ in range(ticks):\n        yield autopilot()\n"
    assert check_source("def main():\n    yield from wait(3)\n", library).passed
    assert not check_source("def main():\n    yield from wait(3)\n").passed
    assert not check_source("def main():\n    for x in wait(3):\n        yield\n", library).passed
    broken = check_source("def main():\n    yield\n", "def wait(:\n")
    assert [f.code for f in broken.findings] == ["library"]


def test_findings_are_few_and_quick_however_broken_the_text() -> None:
    names = "\n".join(f"    unknown_{i:04d}(other_{i:04d})" for i in range(450))
    before = time.perf_counter()
    report = check_source(f"def main():\n{names}\n    yield\n")
    assert time.perf_counter() - before < 2.0
    assert 0 < len(report.findings) <= 20


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=300))
def test_never_raises_on_any_text(text: str) -> None:
    report = check_source(text)
    assert all(str(finding) for finding in report.findings)


_WORDS = st.sampled_from(
    ["def main():\n", "    ", "yield ", "autopilot()", "while True:\n", "if ", "for x in ", "get_speed_of(", ")", "ego",
     "(", "[", "]", "lambda x: ", "any(", "1", "'a'", "f'{", "}'", "=", "==", ".", "\n", ":", ",", " for v in ",
     "from ", "import math\n", "try:\n", "except:\n", "return ", "\\\n", "#", "yield from ", "await ", "é", "\t"]
)  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(st.lists(_WORDS, max_size=40).map("".join))
def test_never_raises_on_broken_programs(text: str) -> None:
    check_source(text)
    check_source("def main():\n    yield\n", text)
    check_source(_main(text.replace("\n", "\n    ")))


def test_every_api_example_passes() -> None:
    setup = "lane = get_lane_of(ego)\nfront = detect_front_vehicle_in(lane)\n"
    for api in APIS.values():
        report = check_source(_main(setup + api.example.removeprefix("yield ")))
        assert report.passed, (api.name, report.findings)
