"""Reaching a CARLA server, and saying in words what one lacks."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from chauffeur.concept import MissingExtraError, ScenarioError

SERVER_VARIABLE: Final = "CHAUFFEUR_CARLA"
"""Environment variable naming the server, `HOST:PORT`; `localhost:2000` where it is not set."""
EGO_BLUEPRINTS: Final = "vehicle.lincoln.mkz_2017", "vehicle.lincoln.mkz2017"
"""The ego's car, as servers since 0.9.12 and before it name it."""
_TIMEOUT_S: Final = 10.0


class CarlaAddress(NamedTuple):
    """Address of a server."""

    host: str
    port: int


def address(environ: Mapping[str, str] = os.environ) -> CarlaAddress:
    """The server's address. Raises ScenarioError for one that is none."""
    named = environ.get(SERVER_VARIABLE, "") or "localhost:2000"
    host, _, port = named.rpartition(":")
    if not host or not (port.isascii() and port.isdigit()) or not 0 < int(port) < 1 << 16:
        raise ScenarioError(
            f"{SERVER_VARIABLE} is {named!r} and must be HOST:PORT.", hint=f"export {SERVER_VARIABLE}=localhost:2000"
        )
    return CarlaAddress(host, int(port))


def library() -> Any:
    """The CARLA client library. Raises MissingExtraError."""
    try:
        import carla
    except ImportError as error:
        raise MissingExtraError(
            "CARLA needs its client: Linux or Windows on x86-64, Python 3.10 to 3.12.",
            extra="carla",
        ) from error
    return carla


def connect() -> Any:
    """A client of the server. Raises MissingExtraError, ScenarioError."""
    carla, where = library(), address()
    try:
        client = carla.Client(where.host, where.port)  # looks the host up
        client.set_timeout(_TIMEOUT_S)
        client.get_server_version()
    except RuntimeError as error:
        raise ScenarioError(
            f"No CARLA server answers at {where.host}:{where.port}.",
            hint=f"Start one: CarlaUE4.sh -nullrhi. Or name it: export {SERVER_VARIABLE}=HOST:PORT.",
        ) from error
    return client


def lacks(client: Any) -> tuple[str, ...]:
    """Requirements a server does not meet, a sentence each; empty if it meets all.

    Raises:
        RuntimeError: The server stops answering.
    """
    found: list[str] = []
    ours, theirs = client.get_client_version(), client.get_server_version()
    if ours.split("-")[0] != theirs.split("-")[0]:
        found.append(f"The server is version {theirs}, the client {ours}: install carla=={theirs}.")
    world = client.get_world()
    names = {blueprint.id for blueprint in world.get_blueprint_library()}
    if not names & set(EGO_BLUEPRINTS):
        found.append(f"The server has no {EGO_BLUEPRINTS[0]} to drive.")
    if not any(name.startswith("walker.pedestrian") for name in names):
        found.append("The server has no people on foot.")
    towns = {str(name).rpartition("/")[2].removesuffix("_Opt") for name in client.get_available_maps()}
    missing = [f"Town0{n}" for n in range(1, 7) if f"Town0{n}" not in towns]
    if missing:
        found.append(f"The server lacks {', '.join(missing)}; Town06 comes with CARLA's additional maps.")
    return tuple(found)
