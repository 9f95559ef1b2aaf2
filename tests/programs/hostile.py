"""Hostile and broken programs, as data. None may escape, stop the host, or delay a control period.

Each entry: name, the outcomes that contain it when the static gate is off (several where the interpreter's or the
machine's speed decides), and the text. `harmless`: it runs or ends without having reached anything.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Hostile:
    """A program that means harm, or is broken. `outcomes` are what may happen to it without the gate."""

    name: str
    outcomes: frozenset[str]
    source: str


def _body(code: str) -> str:
    indented = "\n".join(f"    {line}" for line in code.strip("\n").split("\n"))
    return f"def attack():\n{indented}\n    yield autopilot()\n"


def _make(kind: str, outcomes: str, **bodies: str) -> list[Hostile]:
    return [Hostile(f"{kind}/{name}", frozenset(outcomes.split()), _body(code)) for name, code in bodies.items()]


CANARY = "/tmp/chauffeur-canary"

OS_ACCESS = [
    *_make(
        "os",
        "raised",
        import_os="import os\nos.system('touch /tmp/chauffeur-canary')",
        popen="import os\nos.popen('id').read()",
        environ="import os\nsay(os.environ['CHAUFFEUR_SECRET'])",
        getenv="import os\nsay('' + os.getenv('CHAUFFEUR_SECRET'))",
        listdir="import os\nsay(str(os.listdir('/')))",
        remove="import os\nos.remove('/tmp/chauffeur-canary')",
        fork="import os\nwhile True:\n    os.fork()",
        kill="import os\nos.kill(os.getppid(), 9)",
        open_read="say(open('/etc/passwd').read()[:100])",
        open_write="f = open('/tmp/chauffeur-canary', 'w')\nf.write('x')",
        open_proc="say(open('/proc/self/environ').read()[:100])",
        pathlib="from pathlib import Path\nsay(Path('/etc/passwd').read_text()[:100])",
        pathlib_write="from pathlib import Path\nPath('/tmp/chauffeur-canary').write_text('x')",
        subprocess="import subprocess\nsubprocess.run(['touch', '/tmp/chauffeur-canary'])",
        socket="import socket\nsocket.create_connection(('127.0.0.1', 80))",
        urllib="import urllib.request\nurllib.request.urlopen('http://127.0.0.1/')",
        ctypes="import ctypes\nctypes.CDLL(None).system(b'id')",
        importlib="import importlib\nimportlib.import_module('os').system('id')",
        dunder_import="__import__('os').system('touch /tmp/chauffeur-canary')",
        sys_exit="import sys\nsys.exit(1)",
        sys_modules="import sys\nsay(str(sys.modules['os'].environ))",
        signal="import signal\nsignal.alarm(1)",
        threading="import threading\nthreading.Thread(target=print).start()",
        pickle="import pickle\npickle.loads(b\"cos\\nsystem\\n(S'id'\\ntR.\")",
        chauffeur="import chauffeur.worlds\nsay(str(chauffeur))",
        exec_os="exec('import os; os.system(\"touch /tmp/chauffeur-canary\")')",
        eval_import='eval(\'__import__("os").system("id")\')',
        compile_it="exec(compile('1', 'x', 'exec'))",
        input_it="say(input())",
        breakpoint_it="breakpoint()",
        quit_it="quit()",
    )
]

OBJECT_GRAPH = [
    *_make(
        "graph",
        "raised",
        subclasses="say(str(().__class__.__base__.__subclasses__()))",
        mro="say(str(''.__class__.__mro__))",
        globals_of_api="say(str(autopilot.__globals__))",
        self_of_api="autopilot.__self__.vehicle.speed = 99",
        code_of_api="say.__code__ = attack.__code__",
        closure="say(str(attack.__closure__))",
        builtins="say(str(__builtins__))",
        loader="say(str(__loader__))",
        globals_call="globals()['say'] = None",
        vars_call="say(str(vars(attack)))",
        getattr_class="getattr((), '__cla' + 'ss__').__base__",
        getattr_globals="getattr(say, '__glo' + 'bals__')",
        setattr_api="setattr(say, 'x', 1)",
        format_globals="say('{0.__globals__}'.format(say))",
        format_class="say('{0.__class__.__mro__}'.format(()))",
        format_map="say('{a.__class__}'.format_map({'a': 1}))",
        frame="g = (x for x in [1])\ng.gi_frame.f_back.f_globals",
        traceback="try:\n    1 / 0\nexcept ZeroDivisionError as e:\n    e.__traceback__.tb_frame.f_back.f_globals['x']",
        mutate_vehicle="get_ego_vehicle().speed = 0",
        read_vehicle="get_ego_vehicle().road.vehicles.clear()",
        read_lane="get_lane_of(get_ego_vehicle()).speed_limit = 99",
        type_three="X = type('X', (), {})\nX().__class__.__init__.__globals__",
        descriptor="say(str(str.__dict__['join']))",
        reduce="().__reduce_ex__(2)[0].__globals__",
        object_new="object.__new__(object).__class__.__subclasses__()",
        math_loader="import math\nmath.__loader__.load_module('os')",
        asyncio_loop="import asyncio\nasyncio.get_event_loop().run_in_executor(None, print)",
    )
]

CPU = [
    *_make(
        "cpu",
        "time memory",
        spin="while True:\n    pass",
        spin_except="while True:\n    try:\n        while True:\n            pass\n    except:\n        pass",
        spin_finally="try:\n    while True:\n        pass\nfinally:\n    while True:\n        pass",
        sum_range="sum(range(10 ** 13))",
        nested_for="for a in range(10 ** 6):\n    for b in range(10 ** 6):\n        c = a * b",
        all_range="all(range(1, 10 ** 12))",
        max_gen="max(x * x for x in range(10 ** 12))",
        zip_range="for a, b in zip(range(10 ** 12), range(10 ** 12)):\n    pass",
        map_loop="len(list(map(lambda x: None, range(10 ** 9))))",
        any_filter="any(filter(lambda x: False, range(10 ** 12)))",
        collatz="n = 27\nwhile n > 0:\n    n = n // 2 if n % 2 == 0 else 3 * n + 1",
        string_scan="s = 'a' * 10 ** 6\nwhile True:\n    s.count('ab')",
        join_loop="while True:\n    ''.join(['x'] * 10 ** 4)",
        dict_churn="d = {}\nwhile True:\n    d[len(d) % 100] = d.get(1)",
        lambda_loop="f = lambda: None\nwhile True:\n    f()",
        while_else="n = 0\nwhile n >= 0:\n    n += 1\nelse:\n    say('never')",
        enumerate_it="for i, x in enumerate(range(10 ** 12)):\n    pass",
    ),
    *_make(
        "cpu",
        "time memory raised recursion harmless",
        sorted_big="sorted(range(10 ** 9))",
        in_range_float="1.5 in range(10 ** 12)",
        power_tower="9 ** 9 ** 9",
        power_str="str(7 ** 4000000)",
        shift="1 << (1 << 40)",
        pow_loop="n = 3\nwhile True:\n    n = n ** 3",
        int_parse="int('9' * 10 ** 6)",
        int_times="n = 3 ** 100000\nwhile True:\n    n = n * n",
        factorial="import math\nmath.factorial(10 ** 7)",
        comb="import math\nmath.comb(10 ** 9, 10 ** 8)",
        regex="import re\nre.match('(a+)+$', 'a' * 40 + 'b')",
        regex_nested="import re\nre.search('(x+x+)+y', 'x' * 60)",
        sleep="import time\ntime.sleep(5)",
        sleep_many="import time\nwhile True:\n    time.sleep(0.001)",
        busy_wait="import time\nend = time.time() + 5\nwhile time.time() < end:\n    pass",
        hash_deep="t = ()\nfor _ in range(100000):\n    t = (t,)\nhash(t)",
        compare_deep="a = []\nb = []\nfor _ in range(100000):\n    a = [a]\n    b = [b]\na == b",
        round_deep="round(5, -10 ** 9)",
        divmod_big="divmod(10 ** 200000, 3 ** 100000)",
        gcd_big="import math\nmath.gcd(3 ** 200000, 2 ** 300000)",
        replace_blowup="s = 'a' * 1000\nfor _ in range(6):\n    s = s.replace('a', s[:1000])",
        split_blowup="('a,' * 10 ** 6).split(',')",
    ),
]

MEMORY = [
    *_make(
        "memory",
        "memory time crash raised",
        list_append="a = []\nwhile True:\n    a.append(0)",
        list_multiply="a = [0] * 10 ** 10",
        text_multiply="s = 'a' * 10 ** 10",
        text_double="s = 'a'\nwhile True:\n    s += s",
        dict_grow="d = {}\ni = 0\nwhile True:\n    d[i] = str(i)\n    i += 1",
        set_grow="s = set()\ni = 0\nwhile True:\n    s.add(i)\n    i += 1",
        nested_lists="a = [0]\nwhile True:\n    a = [a, a[:]]",
        format_width="s = f'{1:>{8 * 10 ** 9}}'",
        percent_width="s = '%*d' % (10 ** 9, 1)",
        zfill="s = '1'.zfill(10 ** 10)",
        ljust="s = 'a'.ljust(10 ** 10)",
        join_huge="s = ('a' * 10 ** 6).join(['b'] * 10 ** 6)",
        tuple_range="t = tuple(range(10 ** 9))",
        bytes_huge="b = bytes(10 ** 10)",
        set_range="s = set(range(10 ** 8))",
        comprehension="a = [[0] * 1000 for _ in range(10 ** 6)]",
        repr_shared="a = [0] * 10\nfor _ in range(12):\n    a = [a] * 10\ns = repr(a)",
        say_shared="a = [0] * 10\nfor _ in range(30):\n    a = [a] * 10\nsay(a)",
        closures="fs = []\nwhile True:\n    fs.append(lambda: fs)",
        exceptions="es = []\nwhile True:\n    try:\n        1 / 0\n    except Exception as e:\n        es.append(e)",
    )
]

RECURSION = [
    Hostile("recursion/plain", frozenset({"recursion"}), "def f(n):\n    return f(n + 1)\n" + _body("f(0)")),
    Hostile(
        "recursion/mutual",
        frozenset({"recursion"}),
        "def f():\n    g()\ndef g():\n    f()\n" + _body("f()"),
    ),
    Hostile("recursion/lambda", frozenset({"recursion"}), _body("f = lambda g: g(g)\nf(f)")),
    Hostile("recursion/main", frozenset({"recursion"}), "def attack():\n    yield from attack()\n"),
    Hostile(
        "recursion/caught",
        frozenset({"recursion", "time", "calls"}),
        "def f():\n    try:\n        f()\n    except Exception:\n        f()\n" + _body("f()"),
    ),
    Hostile("recursion/sort_key", frozenset({"recursion", "raised"}), _body("f = lambda x: max([1, 2], key=f)\nf(1)")),
]

FLOODS = [
    *_make(
        "flood",
        "calls",
        api="while True:\n    get_ego_vehicle()",
        say="while True:\n    say('hello')",
        wishes="while True:\n    set_target_speed(20)\n    set_target_speed(25)",
        lanes="while True:\n    set_target_lane(get_lane_of(get_ego_vehicle()))",
        autopilot="while True:\n    autopilot()",
        refused="while True:\n    try:\n        get_speed_of('nobody')\n    except:\n        pass",
        opens="while True:\n    try:\n        open('/etc/passwd')\n    except:\n        pass",
        imports="while True:\n    try:\n        import nowhere\n    except:\n        pass",
        names="while True:\n    try:\n        nobody\n    except:\n        pass",
        unknown_calls="while True:\n    try:\n        globals()\n    except:\n        pass",
        generator="any(is_safe_enter(None) for _ in range(10 ** 9))",
        prints_and_calls="while True:\n    print('x' * 100)\n    get_target_speed()",
    ),
    *_make("flood", "time memory calls", prints="while True:\n    print('x' * 1000)"),
    *_make(
        "flood",
        "calls",
        wishes_that_wait="for i in range(1000):\n    for j in range(50):\n        set_target_speed(20.0 + j)\n"
        "    get_target_speed()",
    ),
    *_make(
        "flood",
        "harmless",
        says="while True:\n    for i in range(150):\n        say('a' * 490)\n    yield autopilot()",
    ),
    *_make(
        "flood",
        "memory crash",
        leaping_state="kept = ['x' * 400000 + str(i) for i in range(18)]\nwhile kept:\n    yield autopilot()",
    ),
    *_make("flood", "raised", long_say="say('a' * 10 ** 6)"),
    *_make("flood", "raised memory", huge_say="say('a' * 10 ** 7)"),
]

CONTROL_FLOW = [
    Hostile("flow/never_yields", frozenset({"time"}), "def attack():\n    while True:\n        x = 1\n    yield\n"),
    Hostile("flow/raise", frozenset({"raised"}), _body("raise ValueError('no')")),
    Hostile("flow/raise_system_exit", frozenset({"raised"}), _body("raise SystemExit")),
    Hostile("flow/raise_keyboard", frozenset({"raised"}), _body("raise KeyboardInterrupt")),
    Hostile("flow/raise_generator_exit", frozenset({"raised"}), _body("raise GeneratorExit")),
    Hostile("flow/raise_huge", frozenset({"raised"}), _body("raise ValueError('x' * 10 ** 6)")),
    Hostile("flow/raise_lookalike_time", frozenset({"raised"}), _body("raise TimeoutError('mine')")),
    Hostile("flow/raise_lookalike_memory", frozenset({"memory"}), _body("raise MemoryError('mine')")),
    Hostile("flow/assert", frozenset({"raised"}), _body("assert False, 'no'")),
    Hostile("flow/top_level_loop", frozenset({"time"}), "while True:\n    pass\n" + _body("pass")),
    Hostile("flow/top_level_raise", frozenset({"raised"}), "1 / 0\n" + _body("pass")),
    Hostile("flow/top_level_api", frozenset({"raised"}), "set_target_speed(99)\n" + _body("pass")),
    Hostile("flow/top_level_memory", frozenset({"memory", "crash", "time"}), "a = [0] * 10 ** 10\n" + _body("pass")),
    Hostile(
        "flow/swallow_all",
        frozenset({"calls"}),
        _body("while True:\n    try:\n        autopilot()\n        raise ValueError\n    except:\n        continue"),
    ),
    Hostile(
        "flow/finally_loop",
        frozenset({"calls"}),
        _body("try:\n    raise ValueError\nfinally:\n    while True:\n        autopilot()"),
    ),
    Hostile("flow/return_at_once", frozenset({"harmless"}), "def attack():\n    return\n    yield\n"),
    Hostile(
        "flow/generator_in_for",
        frozenset({"raised"}),
        "def helper():\n    yield 1\n" + _body("for x in helper():\n    say(str(x))"),
    ),
    Hostile("flow/next_of_generator", frozenset({"raised"}), "def h():\n    yield 1\n" + _body("next(h())")),
    Hostile(
        "flow/yield_everything",
        frozenset({"harmless"}),
        "def attack():\n    while True:\n        yield [0] * 10 ** 4\n",
    ),
    Hostile("flow/async", frozenset({"syntax"}), "async def attack():\n    yield 1\n"),
    Hostile(
        "flow/await",
        frozenset({"time", "raised"}),
        "import asyncio\n" + _body("asyncio.sleep(1)\nasyncio.run(asyncio.sleep(9))"),
    ),
]

TAMPERING = [
    Hostile("tamper/tick_call", frozenset({"harmless"}), _body("__tick__(7, None)\n__tick__('x' * 100, None)")),
    Hostile("tamper/drive_call", frozenset({"raised"}), _body("__drive__(7)\n__drive__([[]], 3)")),
    Hostile("tamper/tick_no_args", frozenset({"raised"}), _body("__tick__()")),
    Hostile(
        "tamper/host_period_calls",
        frozenset({"harmless"}),
        _body("__drive_host__(7)\n__drive_host__([[]], 3)\n__drive_host__()\n__tick_host__()\n__tick_host__(1, 2, 3)"),
    ),
    Hostile(
        "tamper/used_answers",
        frozenset({"harmless"}),
        _body("get_target_speed()\n__used__.extend([10 ** 30, True, None, 'x', -7, 0, 0, 1.5, [[]]])\nyield\n" * 3),
    ),
    Hostile("tamper/used_flood", frozenset({"harmless"}), _body("yield\n__used__.extend([0] * 10 ** 5)\nyield\n" * 3)),
    Hostile("tamper/end_early", frozenset({"harmless"}), _body("__end__(__used__)\nyield\n__end__([[]])")),
    Hostile("tamper/no_answers", frozenset({"raised"}), "__answers__ = None\n" + _body("get_ego_vehicle()")),
    Hostile(
        "tamper/waiting_wishes",
        frozenset({"harmless"}),
        _body(
            "__pending__.extend([1, ('say', 'x'), ('set_target_speed', 'fast'), ('set_target_speed', 1e999),"
            " ('set_target_speed', [[]]), ('set_target_speed', 5.0, 6.0)])\nyield\n" * 3
        ),
    ),
    Hostile("tamper/waiting_flood", frozenset({"calls"}), _body("__pending__.extend([[]] * 10 ** 5)\nyield\n" * 3)),
    Hostile(
        "tamper/wish_call",
        frozenset({"harmless"}),
        _body("__wish__(None)\n__wish__()\n__wish__([('set_target_speed', 5.0)])\nyield"),
    ),
    Hostile("tamper/wish_refused", frozenset({"raised"}), _body("__wish__([('set_target_speed', None)])")),
    Hostile(
        "tamper/slots",
        frozenset({"harmless"}),
        _body(
            "for slot in (0, 0, -7, 10 ** 30, True, None, 'x', 1.5, [[]]):\n"
            "    __get_speed_of_host__(slot, get_ego_vehicle())\nyield\nget_speed_of(get_ego_vehicle())"
        ),
    ),
    Hostile("tamper/no_slot", frozenset({"raised"}), _body("__get_speed_of_host__()")),
    Hostile("tamper/tick_flood", frozenset({"harmless"}), _body("while True:\n    __tick__(-1, [[]])")),
    Hostile(
        "tamper/tick_redefined",
        frozenset({"raised", "time"}),
        "def __tick__(line, value):\n    pass\n" + _body("while True:\n    yield"),
    ),
    Hostile("tamper/tick_none", frozenset({"raised"}), "__tick__ = None\n" + _body("pass")),
    Hostile("tamper/api_redefined", frozenset({"raised"}), "autopilot = None\n" + _body("pass")),
    Hostile(
        "tamper/api_shadowed", frozenset({"harmless"}), "def is_safe_enter(lane):\n    return True\n" + _body("pass")
    ),
    Hostile("tamper/forged_vehicle", frozenset({"raised"}), _body("say(str(get_speed_of('veh:9')))")),
    Hostile("tamper/forged_unknown", frozenset({"raised"}), _body("get_speed_of('veh:99999999999999999999')")),
    Hostile("tamper/forged_negative", frozenset({"raised"}), _body("get_speed_of('veh:-1')")),
    Hostile("tamper/forged_lane", frozenset({"raised"}), _body("set_target_lane('lane:a-b:2')")),
    Hostile("tamper/forged_lane_far", frozenset({"raised"}), _body("set_target_lane('lane:x:y:7')")),
    Hostile(
        "tamper/arithmetic_handle",
        frozenset({"raised"}),
        _body("set_target_lane(get_lane_of(get_ego_vehicle())[:-1] + '2')"),
    ),
    Hostile("tamper/tuple_lane", frozenset({"raised"}), _body("set_target_lane(('a', 'b', 2))")),
    Hostile("tamper/int_vehicle", frozenset({"raised"}), _body("get_speed_of(0)")),
    Hostile("tamper/list_vehicle", frozenset({"raised"}), _body("get_speed_of([get_ego_vehicle()])")),
    Hostile("tamper/function_vehicle", frozenset({"raised"}), _body("get_speed_of(get_ego_vehicle)")),
    Hostile("tamper/class_vehicle", frozenset({"raised"}), "class V:\n    speed = 3\n" + _body("get_speed_of(V())")),
    Hostile("tamper/nan_speed", frozenset({"raised"}), _body("set_target_speed(float('nan'))")),
    Hostile("tamper/inf_speed", frozenset({"raised"}), _body("set_target_speed(float('inf'))")),
    Hostile("tamper/huge_speed", frozenset({"raised"}), _body("set_target_speed(10 ** 400)")),
    Hostile("tamper/flag_speed", frozenset({"raised"}), _body("set_target_speed(True)")),
    Hostile("tamper/text_speed", frozenset({"raised"}), _body("set_target_speed('fast')")),
    Hostile("tamper/nan_headway", frozenset({"raised"}), _body("set_desired_time_headway(float('nan'))")),
    Hostile(
        "tamper/deep_argument",
        frozenset({"raised"}),
        _body("a = []\nfor _ in range(3000):\n    a = [a]\nget_speed_of(a)"),
    ),
    Hostile(
        "tamper/shared_argument",
        frozenset({"raised"}),
        _body("a = [0] * 10\nfor _ in range(40):\n    a = [a] * 10\nget_speed_of(a)"),
    ),
    Hostile("tamper/cyclic_argument", frozenset({"raised"}), _body("a = []\na.append(a)\nsay(a)")),
    Hostile("tamper/many_arguments", frozenset({"raised", "memory", "time"}), _body("say(*range(10 ** 5))")),
    Hostile(
        "tamper/many_keywords",
        frozenset({"raised", "memory", "time"}),
        _body("say(**{'a' + str(i): i for i in range(10 ** 4)})"),
    ),
    Hostile("tamper/long_keyword", frozenset({"raised"}), _body("say(**{'a' * 10 ** 5: 1})")),
    Hostile("tamper/large_integer", frozenset({"raised"}), _body("say(2 ** 5000000)")),
    Hostile("tamper/surrogate", frozenset({"raised", "harmless"}), _body("say('\\ud800')")),
    Hostile("tamper/control_characters", frozenset({"harmless"}), _body("say('\\x1b[2J\\x00')")),
    Hostile("tamper/bytes_say", frozenset({"raised"}), _body("say(b'abc')")),
]

LEAKS = [
    Hostile("leak/locals", frozenset({"harmless"}), _body("say(str(locals()))")),
    Hostile("leak/api_repr", frozenset({"harmless"}), _body("say(str(autopilot))")),
    Hostile("leak/function_repr", frozenset({"harmless"}), _body("say(repr(attack))")),
    Hostile("leak/id", frozenset({"harmless"}), _body("say(str(id(autopilot)))")),
    Hostile("leak/file", frozenset({"raised", "harmless"}), _body("say(str(__file__))")),
    Hostile("leak/time", frozenset({"harmless"}), _body("import time\nsay(str(time.time()))")),
    Hostile("leak/random", frozenset({"harmless"}), _body("import random\nsay(str(random.random()))")),
    Hostile("leak/cwd", frozenset({"harmless", "raised"}), _body("import os\nsay(os.getcwd())")),
    Hostile("leak/platform", frozenset({"raised", "harmless"}), _body("import sys\nsay(str(sys.version))")),
]

BROKEN = [
    Hostile("broken/empty", frozenset({"syntax"}), ""),
    Hostile("broken/prose", frozenset({"syntax"}), "I would change to the left lane."),
    Hostile("broken/syntax", frozenset({"syntax"}), "def attack(:\n    yield autopilot()\n"),
    Hostile("broken/indent", frozenset({"syntax"}), "def attack():\nyield autopilot()\n"),
    Hostile("broken/unclosed", frozenset({"syntax"}), "def attack():\n    yield autopilot(\n"),
    Hostile("broken/no_function", frozenset({"syntax"}), "set_target_speed(20)\n"),
    Hostile("broken/no_yield", frozenset({"syntax"}), "def attack():\n    set_target_speed(20)\n"),
    Hostile("broken/needs_argument", frozenset({"syntax"}), "def attack(ego):\n    yield autopilot()\n"),
    Hostile("broken/null_byte", frozenset({"syntax"}), "def attack():\n    yield '\x00'\n"),
    Hostile("broken/lone_surrogate", frozenset({"syntax"}), "def attack():\n    yield '\ud800'\n"),
    Hostile("broken/too_long", frozenset({"syntax"}), "def attack():\n    yield 1\n" + "# x\n" * 10_000),
    Hostile("broken/deep_parentheses", frozenset({"syntax"}), f"def attack():\n    yield {'(' * 5000}1{')' * 5000}\n"),
    Hostile("broken/deep_unary", frozenset({"syntax"}), f"def attack():\n    yield {'-' * 9000}1\n"),
    Hostile("broken/deep_lists", frozenset({"syntax"}), f"def attack():\n    yield {'[' * 90}{']' * 90}\n"),
    Hostile("broken/long_sum", frozenset({"syntax"}), f"def attack():\n    yield {'1+' * 4000}1\n"),
    Hostile(
        "broken/deep_blocks",
        frozenset({"syntax"}),
        "def attack():\n" + "".join(f"{' ' * (i + 1)}if 1:\n" for i in range(90)) + " " * 95 + "yield\n",
    ),
    Hostile("broken/huge_integer", frozenset({"syntax"}), f"def attack():\n    yield {'9' * 9000}\n"),
    Hostile(
        "broken/many_functions",
        frozenset({"harmless"}),
        "".join(f"def f{i}(): pass\n" for i in range(1000)) + "def attack():\n    yield\n",
    ),
    Hostile("broken/unknown_api", frozenset({"raised"}), _body("change_lane_left()")),
    Hostile("broken/unknown_method", frozenset({"raised"}), _body("get_ego_vehicle().accelerate(3)")),
    Hostile("broken/too_many_arguments", frozenset({"raised"}), _body("get_speed_of(get_ego_vehicle(), 3)")),
    Hostile("broken/missing_argument", frozenset({"raised"}), _body("get_speed_of()")),
    Hostile("broken/unknown_keyword", frozenset({"raised"}), _body("set_target_speed(speed_kmh=100)")),
    Hostile(
        "broken/none_vehicle", frozenset({"raised"}), _body("get_speed_of(detect_front_vehicle_in(get_left_lane(), 1))")
    ),
    Hostile("broken/none_lane", frozenset({"raised"}), _body("set_target_lane(None)")),
    Hostile("broken/divide_by_zero", frozenset({"raised"}), _body("set_target_speed(1 / 0)")),
    Hostile("broken/class", frozenset({"harmless", "raised"}), "class Planner:\n    pass\n" + _body("Planner()")),
    Hostile(
        "broken/inheritance", frozenset({"syntax", "raised"}), "class Planner(dict):\n    pass\n" + _body("Planner()")
    ),
    Hostile("broken/del", frozenset({"syntax"}), _body("x = 1\ndel x")),
    Hostile("broken/with", frozenset({"raised", "syntax"}), _body("with autopilot() as a:\n    pass")),
    Hostile("broken/yield_in_lambda", frozenset({"harmless", "raised"}), _body("f = lambda: (yield 1)\nf()")),
    Hostile("broken/yield_in_fstring", frozenset({"syntax"}), _body("x = f'{(yield 1)}'")),
    Hostile("broken/yield_from_list", frozenset({"harmless"}), _body("yield from [1, 2]")),
    Hostile("broken/index", frozenset({"raised"}), _body("x = [][0]")),
    Hostile("broken/undefined", frozenset({"raised"}), _body("set_target_speed(target)")),
]

HOSTILE: tuple[Hostile, ...] = (
    *OS_ACCESS,
    *OBJECT_GRAPH,
    *CPU,
    *MEMORY,
    *RECURSION,
    *FLOODS,
    *CONTROL_FLOW,
    *TAMPERING,
    *LEAKS,
    *BROKEN,
)
