"""Helper functions of composed programs, in the driving language: driving on, waiting for an event, coming to a stand.

A control period of a town is 0.05 s. A wait ends after two minutes, and says so.
"""

from __future__ import annotations

import re
from typing import Final

_OVER: Final = """def over_SIDE(pace):
    ego = get_ego_vehicle()
    goal = None
    for _ in range(600):
        if goal is not None and get_lane_of(ego) == goal:
            break
        goal = get_SIDE_lane(ego)
        change_lane_SIDE()
        yield proceed(min(check_speed_limit(), pace))
    yield from drive_on(20, pace)
"""
_OUTERMOST: Final = """def outermost_SIDE(pace):
    for _ in range(100):
        if get_SIDE_lane(get_ego_vehicle()) is not None:
            break
        yield proceed(min(check_speed_limit(), pace))
    for _ in range(6):
        if get_SIDE_lane(get_ego_vehicle()) is None:
            break
        yield from over_SIDE(pace)
    yield from drive_on(20, pace)
"""
_STAND: Final = """def stand_WHERE(who):
    stood = 0
    for _ in range(2400):
        if not in_sight(who):
            say("It is out of sight. I go on along the road.")
            return
PASSED        yield stop_WHERE(who)
        stood = stood + 1 if get_target_speed() < 0.05 and get_speed_of(get_ego_vehicle()) < 0.1 else 0
        if stood > 60:
            return
"""
_PASSED: Final = """        if has_passed(who):
            say("We are past it already, so I stop here.")
            yield from halt(80)
            return
"""

HELPERS: Final[dict[str, str]] = {
    "drive_on": """def drive_on(steps, pace):
    for _ in range(steps):
        yield proceed(min(check_speed_limit(), pace))
""",
    "halt": """def halt(steps):
    for _ in range(400):
        yield stop()
        if get_speed_of(get_ego_vehicle()) < 0.1:
            break
    for _ in range(steps):
        yield stop()
""",
    "let_go": """def let_go(who):
    for _ in range(2400):
        if has_gone(who):
            return
        yield give_way_to(who)
    say("I have waited for two minutes, and go on.")
""",
    "stand_until_gone": """def stand_until_gone(who):
    for _ in range(2400):
        if has_gone(who):
            return
        yield stop()
    say("I have waited for two minutes, and go on.")
""",
    "until_green": """def until_green(pace):
    for _ in range(2400):
        state, distance = check_traffic_light()
        if state == "green":
            return
        yield proceed(min(check_speed_limit(), pace))
    say("The light has not turned green for two minutes.")
""",
    "until_passed": """def until_passed(who, pace):
    for _ in range(2400):
        if has_passed(who):
            return
        yield proceed(min(check_speed_limit(), pace))
    say("I have not come past it in two minutes.")
""",
    "until_moves": """def until_moves(who):
    for _ in range(2400):
        if not in_sight(who) or is_moving(who):
            return
        yield stop_behind(who)
    say("It has not moved for two minutes, and I go on.")
""",
    "until_stands": """def until_stands(who):
    for _ in range(2400):
        if not in_sight(who) or not is_moving(who):
            return
        yield follow_agent(who)
    say("It has not stopped for two minutes, and I go on.")
""",
    "until_near": """def until_near(who, pace):
    for _ in range(2400):
        ahead, distance = get_distance_to(who)
        if not ahead or distance < 25.0:
            return
        yield proceed(min(check_speed_limit(), pace))
""",
    "over_left": _OVER.replace("SIDE", "left"),
    "over_right": _OVER.replace("SIDE", "right"),
    "outermost_left": _OUTERMOST.replace("SIDE", "left"),
    "outermost_right": _OUTERMOST.replace("SIDE", "right"),
    "until_clear": """def until_clear(pace):
    for _ in range(40):
        yield proceed(min(check_speed_limit(), pace))
    for _ in range(2400):
        if is_clear():
            return
        yield proceed(min(check_speed_limit(), pace))
""",
    "keep_behind": """def keep_behind(who, steps):
    for _ in range(steps):
        if not in_sight(who):
            say("It is out of sight. I go on along the road.")
            return
        yield follow_agent(who)
""",
    "stand_behind": _STAND.replace("WHERE", "behind").replace("PASSED", _PASSED),
    "stand_beside": _STAND.replace("WHERE", "beside").replace("PASSED", _PASSED),
    "stand_beyond": _STAND.replace("WHERE", "beyond").replace("PASSED", ""),
    "stand_before_junction": """def stand_before_junction(pace):
    for _ in range(2400):
        state, line = check_traffic_light()
        left = min(get_distance_to_junction() - 6.0, line - 2.0)
        if left < 0.5:
            break
        yield proceed(min(check_speed_limit(), pace, max(0.6, (1.5 * left) ** 0.5)))
    yield from halt(80)
""",
    "look_for": """def look_for(kind, colour, state, side, pace):
    who = see(kind, colour, state, side)
    for _ in range(1200):
        if who is not None:
            return who
        yield proceed(min(check_speed_limit(), pace))
        who = see(kind, colour, state, side)
    say("I have not come to see what you mean.")
    return None
""",
    "cross_the_junction": """def cross_the_junction(pace, beyond=38.0):
    last = get_distance_to_junction()
    for _ in range(12000):
        now = get_distance_to_junction()
        if now > last + 10:
            break
        last = now
        yield proceed(min(check_speed_limit(), pace))
    gone = 0.0
    for _ in range(12000):
        gone = gone + 0.05 * get_speed_of(get_ego_vehicle())
        if gone > beyond:
            break
        yield proceed(min(check_speed_limit(), pace))
""",
    "to_the_end": """def to_the_end(pace):
    for _ in range(8):
        if not can_go("straight"):
            break
        yield from cross_the_junction(pace)
""",
    "pass_ways": """def pass_ways(side, count, pace):
    for _ in range(8):
        if count < 1:
            break
        if can_go(side):
            count = count - 1
        yield from cross_the_junction(pace)
""",
}
"""Source of each by its name."""
_WORD: Final = re.compile(r"\w+")


def helpers_used(source: str) -> str:
    """The helper functions that a program calls, and those that they call, as one text."""
    used: list[str] = []
    rim = [name for name in HELPERS if name in set(_WORD.findall(source))]
    while rim:
        name = rim.pop(0)
        if name not in used:
            used.append(name)
            rim += [one for one in HELPERS if one != name and one in set(_WORD.findall(HELPERS[name]))]
    return "\n\n".join(HELPERS[name] for name in HELPERS if name in used)
