"""A town from a running CARLA server: its OpenDRIVE, stop lines and light cycles, as the tables that `build` reads."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import DataError, MissingExtraError
from chauffeur.worlds.town.build import MapSources

_TIMEOUT_S: Final = 20.0
_DEPTH_M: Final = 1.0
ALL_RED_S: Final = 2.0
"""CARLA's groups show red everywhere for as long as the light that was green says."""


def connect(host: str, port: int) -> Any:
    """The world of a running server. Raises MissingExtraError, DataError."""
    try:
        import carla  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise MissingExtraError("Exporting a map needs the client of CARLA.", extra="carla") from error
    try:
        client = carla.Client(host, port)
        client.set_timeout(_TIMEOUT_S)
        return client.get_world()
    except RuntimeError as error:
        raise DataError(f"No CARLA server answers at {host}:{port}: {error}.", hint="Start CARLA first.") from error


def export(world: Any, folder: Path) -> MapSources:
    """Write what a server knows of its town into a folder.

    Args:
        world: A `carla.World`.
        folder: Gets `NAME.xodr` and the two tables beside it.

    Raises:
        DataError: The server says something that cannot be used, or the folder cannot be written.
    """
    try:
        town = world.get_map()
        name = str(town.name).rpartition("/")[2]
        actors = world.get_actors()
        lights = list(actors.filter("traffic.traffic_light*"))
        rows = [row for light in lights for row in _light_rows(light)]
        rows += [_sign_row(sign, "stop_sign") for sign in actors.filter("traffic.stop")]
        rows += [_sign_row(sign, "yield_sign") for sign in actors.filter("traffic.yield")]
        cycles = [_cycle(group) for group in _groups(lights)]
        text = str(town.to_opendrive())
    except (AttributeError, RuntimeError, TypeError, ValueError) as error:
        raise DataError(f"The CARLA server's town cannot be exported: {error}.") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        sources = MapSources(
            folder / f"{name}.xodr",
            folder / f"carla_{name}_stoplines.json",
            folder / f"carla_{name}_traffic_light_controller.json",
        )
        sources.xodr.write_text(text)
        (folder / f"carla_{name}_stoplines.json").write_text(json.dumps(rows))
        (folder / f"carla_{name}_traffic_light_controller.json").write_text(json.dumps(cycles))
    except OSError as error:
        raise DataError(f"Cannot write the town into {folder}: {error}.") from error
    return sources


def _light_rows(light: Any) -> Iterable[dict[str, Any]]:
    """One row for all lanes of a light: across the stop waypoints that the server gives for it."""
    stops = list(light.get_stop_waypoints())
    if not stops:
        return
    at = [stop.transform.location for stop in stops]
    yaw = math.radians(stops[0].transform.rotation.yaw)
    aside = [-(one.x - at[0].x) * math.sin(yaw) + (one.y - at[0].y) * math.cos(yaw) for one in at]
    middle = (min(aside) + max(aside)) / 2.0
    width = max(aside) - min(aside) + float(stops[0].lane_width)
    x, y = at[0].x - middle * math.sin(yaw), at[0].y + middle * math.cos(yaw)
    yield _row(light.id, "traffic_light", (x, y), _DEPTH_M, width, yaw)


def _sign_row(sign: Any, kind: str) -> dict[str, Any]:
    """A stop sign's ground: the trigger volume of the actor."""
    box = sign.trigger_volume
    at = sign.get_transform().transform(box.location)
    yaw = math.radians(sign.get_transform().rotation.yaw + box.rotation.yaw)
    return _row(sign.id, kind, (at.x, at.y), 2.0 * box.extent.x, 2.0 * box.extent.y, yaw)


def _row(number: int, kind: str, at: tuple[float, float], length: float, width: float, yaw: float) -> dict[str, Any]:
    return {
        "actor_id": int(number), "agent_type": kind, "x": at[0], "y": at[1],
        "length": length, "width": width, "orientation": yaw,
    }  # fmt: skip


def _groups(lights: Sequence[Any]) -> Iterable[list[Any]]:
    seen: set[int] = set()
    for light in lights:
        if light.id not in seen:
            group = list(light.get_group_traffic_lights())
            seen.update(one.id for one in group)
            yield group


def _cycle(group: Sequence[Any]) -> list[dict[str, Any]]:
    """CARLA's own cycle: one light after the other is green, then yellow, then all are red."""
    phases: list[dict[str, Any]] = []
    for light in group:
        for state, seconds in (
            ("green", light.get_green_time()),
            ("yellow", light.get_yellow_time()),
            ("red", light.get_red_time() or ALL_RED_S),
        ):
            states = {str(one.id): state if one is light else "red" for one in group}
            phases.append({"actor_states": states, "duration": float(seconds), "state": len(phases)})
    for i, phase in enumerate(phases):
        phase["next_state"] = (i + 1) % len(phases)
    return phases
