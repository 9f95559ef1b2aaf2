"""What the language model of a case answers when nothing is wrong with it, and what when it is bad."""

from __future__ import annotations

from typing import Final, Literal

Road = Literal["highway", "crossing"]


def reply(thoughts: str, program: str) -> str:
    """An answer in the form that planners are asked for."""
    return f"Thoughts: {thoughts}\n\n```python\n{program}```\n"


def _lane(side: str) -> str:
    return f"""def change():
    ego = get_ego_vehicle()
    lane = get_{side}_lane(ego)
    while not is_safe_enter(lane):
        yield autopilot()
        lane = get_{side}_lane(ego)
    set_target_lane(lane)
    while get_lane_of(ego) != lane:
        yield autopilot()
    for _ in range(30):
        yield autopilot()
"""


def _crossing(turn: str) -> str:
    return f"""def cross():
    {turn}
    ego = get_ego_vehicle()
    lanes = get_left_to_right_cross_traffic_lanes() + get_right_to_left_cross_traffic_lanes()
    set_target_speed(9.0)
    while get_speed_of(ego) > 0.9:
        yield autopilot()
    clear = False
    while not clear:
        clear = True
        for lane in lanes:
            if not is_safe_enter(lane):
                clear = False
        yield autopilot()
    recover_from_stop()
    while True:
        yield autopilot()
"""


_HOLD: Final = """def hold():
    set_target_speed({speed})
    while True:
        yield autopilot()
"""
_ROOM: Final = """def room():
    set_desired_time_headway(2.0)
    while True:
        yield autopilot()
"""

WISHES: Final[dict[Road, tuple[tuple[str, str], ...]]] = {
    "highway": (
        ("Change to the left lane.", reply("I change to the left lane when there is room.", _lane("left"))),
        ("Change to the right lane.", reply("I change to the right lane when there is room.", _lane("right"))),
        ("Slow down to 20 m/s.", reply("I slow down to 20 m/s.", _HOLD.format(speed=20.0))),
        ("Drive 27 m/s.", reply("I drive 27 m/s.", _HOLD.format(speed=27.0))),
        ("Leave more room to the car ahead.", reply("I keep a time headway of 2 s.", _ROOM)),
    ),
    "crossing": (
        (
            "Go straight on at the intersection.",
            reply("I stop at the sign, wait until it is clear, and go straight on.",
                  _crossing("go_straight_at_next_intersection()")),
        ),
        (
            "Turn left at the intersection.",
            reply("I stop at the sign, wait until it is clear, and turn left.",
                  _crossing("turn_left_at_next_intersection()")),
        ),
        (
            "Turn right at the intersection.",
            reply("I stop at the sign, wait until it is clear, and turn right.",
                  _crossing("turn_right_at_next_intersection()")),
        ),
    ),
}  # fmt: skip
"""Wish and good answer, by road."""

UNKNOWN_API: Final = reply(
    "I fly over them.", "def fly():\n    set_altitude(100.0)\n    engage_thrusters()\n    yield autopilot()\n"
)
IMPORTS: Final = reply(
    "I ask the system.", "import os\n\ndef f():\n    os.system('true')\n    while True:\n        yield autopilot()\n"
)
NEVER_YIELDS: Final = reply(
    "I hold.", "def hold():\n    n = 0\n    while True:\n        n = n + 1\n    yield autopilot()\n"
)
SPINS_LATER: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    set_target_speed(25.0)\n    n = 0\n    while True:\n        n = n + 1\n"
    "        while n > 8 and get_speed_of(get_ego_vehicle()) > -1.0:\n            n = n + 1\n"
    "        yield autopilot()\n",
)
DIES_LATER: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    set_target_speed(25.0)\n    left = [1, 2, 3, 4, 5, 6]\n    while True:\n"
    "        left.pop()\n        yield autopilot()\n",
)
BEYOND_LIMITS: Final = reply(
    "I drive 70 m/s.",
    "def race():\n    set_target_speed(70.0)\n    set_desired_time_headway(0.05)\n    while True:\n"
    "        yield autopilot()\n",
)
CREEPS_BEYOND: Final = reply(
    "I drive as the road allows.",
    "def race():\n    speed = get_target_speed()\n    while True:\n        speed = speed + 1.5\n"
    "        set_target_speed(speed)\n        set_desired_time_headway(speed / 4000.0)\n        yield autopilot()\n",
)
GROWS: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    set_target_speed(25.0)\n    kept = []\n    while True:\n"
    "        kept.append('x' * 400000 + str(len(kept)))\n        yield autopilot()\n",
)
LEAPS: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    set_target_speed(25.0)\n    yield autopilot()\n"
    "    kept = ['x' * 400000 + str(i) for i in range(18)]\n    while kept:\n        yield autopilot()\n",
)
SAYS_ON_AND_ON: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    set_target_speed(25.0)\n    while True:\n        for i in range(150):\n"
    "            say(str(i) + 'x' * 490)\n        yield autopilot()\n",
)
WISHES_ON_AND_ON: Final = reply(
    "I hold 25 m/s.",
    "def hold():\n    while True:\n        for i in range(1000):\n            for j in range(50):\n"
    "                set_target_speed(25.0 + 0.001 * j)\n            get_target_speed()\n        yield autopilot()\n",
)
LONG_THOUGHTS: Final = reply(
    "1" * 8000, "def hold():\n    set_target_speed(25.0)\n    while True:\n        yield autopilot()\n"
)
REFUSES: Final = "I am a language model and would rather talk about the weather."
