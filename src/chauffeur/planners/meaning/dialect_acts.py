"""The acts of each skill of the driving dialect, in the notation of labels: read here in both directions.

`chauffeur.models.meaning` says the skills' wordings as these acts; `planners.meaning.highway` drives acts by skills.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

AHEAD: Final = "T K:vehicle where:ahead"
"""The lead vehicle; words that name it otherwise, or not at all, have another target or none."""

SKILL_ACTS: Final[Mapping[str, str]] = {
    "drive_at": "speed VALUE",
    "faster_by": "speed direction:faster measure:by VALUE",
    "slower_by": "speed direction:slower measure:by VALUE",
    "faster": "speed direction:faster",
    "a_bit_faster": "speed direction:faster degree:bit",
    "much_faster": "speed direction:faster degree:much",
    "slower": "speed direction:slower",
    "a_bit_slower": "speed direction:slower degree:bit",
    "much_slower": "speed direction:slower degree:much",
    "at_most": "speed measure:at_most VALUE",
    "at_least": "speed measure:at_least VALUE",
    "drive_at_limit": "speed aim:limit",
    "over_limit_by": "speed measure:over_limit aim:limit VALUE",
    "under_limit_by": "speed measure:under_limit aim:limit VALUE",
    "as_fast_as_allowed": "speed aim:maximum",
    "match_traffic": "speed aim:traffic",
    "speed_times": "speed measure:times VALUE",
    "hold_speed": "speed direction:same",
    "gap_of": f"gap VALUE {AHEAD}",
    "closer_by": f"gap direction:less measure:by VALUE {AHEAD}",
    "further_by": f"gap direction:more measure:by VALUE {AHEAD}",
    "closer": f"gap direction:less {AHEAD}",
    "a_bit_closer": f"gap direction:less degree:bit {AHEAD}",
    "much_closer": f"gap direction:less degree:much {AHEAD}",
    "further": f"gap direction:more {AHEAD}",
    "a_bit_further": f"gap direction:more degree:bit {AHEAD}",
    "much_further": f"gap direction:more degree:much {AHEAD}",
    "gap_of_seconds": f"gap VALUE {AHEAD}",
    "gap_at_least": f"gap measure:at_least VALUE {AHEAD}",
    "gap_at_most": f"gap measure:at_most VALUE {AHEAD}",
    "gap_times": f"gap measure:times VALUE {AHEAD}",
    "hold_gap": f"gap direction:same {AHEAD}",
    "lane_left": "lane side:left",
    "lane_right": "lane side:right",
    "change_lane": "lane",
    "lanes_left": "lane side:left VALUE",
    "lanes_right": "lane side:right VALUE",
    "leftmost_lane": "lane to:leftmost",
    "rightmost_lane": "lane to:rightmost",
    "middle_lane": "lane to:middle",
    "keep_lane": "keep",
    "back_on_the_road": "lane to:original",
    "lane_left_patiently": "lane side:left W:once E:clear",
    "lane_right_patiently": "lane side:right W:once E:clear",
    "overtake": f"pass {AHEAD}",
    "overtake_left": f"pass side:left {AHEAD}",
    "overtake_right": f"pass side:right {AHEAD}",
    "overtake_and_return": f"pass {AHEAD} + lane to:original",
    "overtake_left_and_return": f"pass side:left {AHEAD} + lane to:original",
    "overtake_right_and_return": f"pass side:right {AHEAD} + lane to:original",
    "turn_left": "turn side:left",
    "turn_right": "turn side:right",
    "go_straight": "straight",
    "pull_over": "pull_over",
    "stop_here": "stop",
    "follow": f"follow {AHEAD}",
    "no_overtaking": f"pass NOT {AHEAD}",
    "let_in": "yield T K:vehicle",
    "carry_on": "go",
    "drive_normally": "go style:normal",
    "hurry": "speed direction:faster style:hurry",
    "relax": "speed direction:slower style:relaxed",
    "gently": "go style:gentle",
    "carefully": "go style:careful",
    "sportily": "go style:sporty",
    "economically": "go style:economical",
}
"""By skill; ` + ` parts two acts."""

MANNER_ACTS: Final[Mapping[str, str]] = {"gently": "manner:slow", "quickly": "manner:quick"}
"""A skill's manner as a field of its act."""

CONDITION_ACTS: Final[Mapping[str, str]] = {
    "lead_slower_than": "E:slower CVALUE K:vehicle where:ahead",
    "lead_closer_than": "E:closer CVALUE K:vehicle where:ahead",
    "lead_further_than": "E:further CVALUE K:vehicle where:ahead",
    "clear_left": "E:clear K:lane side:left",
    "clear_right": "E:clear K:lane side:right",
}
"""Of what a step may depend on, behind `W:if` or `W:once`."""

REMARK_ACTS: Final[Mapping[str, str]] = {
    "too_fast/plain": "speed direction:slower",
    "too_fast/bit": "speed direction:slower degree:bit",
    "too_fast/much": "speed direction:slower degree:much",
    "too_slow/plain": "speed direction:faster",
    "too_slow/bit": "speed direction:faster degree:bit",
    "too_slow/much": "speed direction:faster degree:much",
    "too_close": f"gap direction:more {AHEAD}",
    "too_far": f"gap direction:less {AHEAD}",
    "close_call": "go style:careful",
    "harsh": "go style:gentle",
    "swerving": "keep",
    "timid": "go style:sporty",
    "no_overtake": f"pass {AHEAD}",
    "passed": f"pass NOT {AHEAD}",
    "waited": "go",
    "not_waited": "yield T K:vehicle",
    "not_right": "lane side:right",
    "not_parked": "park",
    "fine": "yes",
    "none": "",
}
"""Remarks about a drive that has been: what would have been right."""
