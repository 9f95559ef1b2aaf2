"""Task families of DbLv1, as the paper groups them (Tab. III)."""

from __future__ import annotations

import re

FAMILIES = ("distance", "speed", "lane change", "overtake", "pull over", "routing")

_BY_NAME: tuple[tuple[str, str], ...] = (
    (r"(inc|dec)_(abs|rel)_dis", "distance"),
    (r"(inc|dec)_(abs|rel)_speed", "speed"),
    (r"(left|right)_lc", "lane change"),
    (r"(left|right)_overtake", "overtake"),
    (r"pull_over", "pull over"),
    (r"(go_straight|turn_left|turn_right)", "routing"),
)


def family_of(task: str) -> str:
    """Family of a task file's name; `other` for tasks that are not DbLv1's."""
    return next((family for pattern, family in _BY_NAME if re.match(pattern, task)), "other")
