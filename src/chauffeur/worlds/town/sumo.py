"""Traffic by Eclipse SUMO, in this process (libsumo): the one module that knows it.

libsumo holds one simulation a process. The `Sumo` opened last owns it, and the one opened before is told so, in
words, when it is used again: worlds that have to run beside each other run in processes of their own.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from chauffeur.concept import AgentKind, ChauffeurError, MissingExtraError, ScenarioError
from chauffeur.geometry import Pose
from chauffeur.worlds.town.bodies import Trails

EGO_NAME: Final = "ego"


class Make(NamedTuple):
    """Properties of a kind of vehicle: size, bounds, and share of the traffic."""

    kind: AgentKind
    length_m: float
    width_m: float
    most_mps: float
    acceleration_mps2: float
    vehicle_class: str
    share: float


MAKES: Final[Mapping[str, Make]] = {
    "car": Make("car", 4.6, 1.85, 50.0, 2.6, "passenger", 0.70),
    "van": Make("car", 5.6, 2.0, 40.0, 2.2, "delivery", 0.10),
    "truck": Make("truck", 8.0, 2.4, 25.0, 1.4, "truck", 0.05),
    "bus": Make("bus", 9.5, 2.5, 23.0, 1.3, "bus", 0.03),
    "motorcycle": Make("motorcycle", 2.2, 0.9, 45.0, 3.0, "motorcycle", 0.05),
    "bicycle": Make("bicycle", 1.8, 0.65, 5.5, 1.2, "bicycle", 0.07),
}
JAM_S: Final = 60.0
"""Time after which a stuck vehicle is taken out, and put in elsewhere."""
LANE_CHANGE_S: Final = 3.0
DECIDES_S: Final = 0.2
"""Interval at which a driver decides anew: a quick driver's response, and half the work of deciding every period."""
_MATCH_M: Final = 20.0
"""A lane for what is moved from outside is looked for this near; SUMO's own 100 m cost it a millisecond."""
_MINOR: Final = "g"
_MAJOR: Final = "G"


class Mover(NamedTuple):
    """One of SUMO's vehicles at an instant: the middle of its body."""

    name: str
    make: str
    x_m: float
    y_m: float
    heading_rad: float
    speed_mps: float
    acceleration_mps2: float
    lane: str


@dataclass(frozen=True, slots=True)
class Link:
    """A way over a junction that a light rules: its place in the state of that light, and whether it turns left."""

    light: str
    index: int
    lane: str
    left: bool


def engine_name() -> str:
    """Name and version of SUMO, `sumo` where it is not installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return f"sumo-2d {version('libsumo')}"
    except PackageNotFoundError:
        return "sumo-2d"


def _library() -> Any:
    try:
        import libsumo
    except ImportError as error:
        raise MissingExtraError("Driving in a town needs SUMO.", extra="town") from error
    return libsumo


_holder: list[Sumo] = []
"""Owner of the simulation that this process runs: none or one."""


class Sumo:
    """One simulation: its traffic, its lights, our ego and whatever else is moved from outside."""

    def __init__(self, net: Path, dt_s: float, seed: int) -> None:
        """Start a simulation of a road network.

        Raises:
            MissingExtraError: SUMO is not installed.
            ScenarioError: SUMO does not read the network.
        """
        self._sumo = library = _library()
        for other in tuple(_holder):
            other.close()
        with tempfile.TemporaryDirectory(prefix="chauffeur-town-") as folder:
            kinds = Path(folder) / "kinds.rou.xml"
            kinds.write_text(_kinds(), encoding="utf-8")
            options = {
                "-n": net,
                "-r": kinds,
                "--step-length": dt_s,
                "--seed": seed % 2**31,
                "--collision.action": "none",
                "--time-to-teleport": -1,
                "--lanechange.duration": LANE_CHANGE_S,
                "--no-step-log": "true",
                "--no-warnings": "true",
                "--duration-log.disable": "true",
            }
            try:
                library.start(["sumo", *(str(part) for pair in options.items() for part in pair)])
            except library.libsumo.TraCIException as error:
                raise ScenarioError(f"SUMO does not read the road network {net}: {error}.") from error
        _holder.append(self)
        self._kind_of: dict[str, str] = {}
        self._way_of: dict[str, tuple[str, ...]] = {}
        self._onward: dict[str, frozenset[str]] = {}
        self._trails = Trails()
        self._length_of: dict[str, float] = {name: make.length_m for name, make in MAKES.items()}

    @property
    def open(self) -> bool:
        """True if this process still runs it."""
        return self in _holder

    def close(self) -> None:
        """End the simulation, if it is still this one."""
        if self.open:
            _holder.clear()
            self._sumo.close()

    def step(self) -> None:
        """Let the traffic go on for a period.

        Raises:
            ScenarioError: Another simulation was opened.
            ChauffeurError: SUMO failed; it is good for nothing more.
        """
        self._ours()
        try:
            self._sumo.simulationStep()
        except (self._sumo.TraCIException, self._sumo.FatalTraCIError) as error:
            raise ChauffeurError(f"SUMO failed while it ran: {error}", hint="Run the same command again.") from error

    # Traffic ----------------------------------------------------------------------------------------------------------

    def edges(self) -> Mapping[str, tuple[str, ...]]:
        """Edges on which traffic can go round for ever, and those that follow each."""
        lanes = self._sumo.lane
        follow: dict[str, set[str]] = {}
        for lane in lanes.getIDList():
            allowed = lanes.getAllowed(lane)
            if lane.startswith(":") or (allowed and "passenger" not in allowed) or lanes.getLength(lane) < 1.0:
                continue
            if "passenger" in lanes.getDisallowed(lane):
                continue
            edge = lanes.getEdgeID(lane)
            ways = follow.setdefault(edge, set())
            ways.update(lanes.getEdgeID(link[0]) for link in lanes.getLinks(lane) if link[6] != "t")
        return _endless(follow)

    def length_m(self, edge: str) -> float:
        """Length of an edge."""
        return float(self._sumo.lane.getLength(f"{edge}_0"))

    def lanes_of(self, edge: str) -> int:
        """Number of lanes of an edge."""
        return int(self._sumo.edge.getLaneNumber(edge))

    def add(self, name: str, make: str, edges: Sequence[str]) -> None:
        """Insert an agent on the first of some edges, wherever there is room."""
        self._sumo.route.add(f"r-{name}", edges)
        self._sumo.vehicle.add(
            name, f"r-{name}", typeID=make, departLane="best", departPos="random_free", departSpeed="0"
        )
        self._kind_of[name] = make

    def put(self, name: str, make: str, edges: Sequence[str], lane: str, middle: Pose, speed_mps: float) -> None:
        """Have a vehicle of the traffic set out on some edges from a place of its lane, with a speed."""
        front = middle.ahead(MAKES[make].length_m / 2.0)
        self.add(name, make, edges)
        edge, _, index = lane.rpartition("_")
        degrees = 90.0 - math.degrees(middle.heading_rad)
        self._sumo.vehicle.moveToXY(name, edge, int(index or 0), front.x_m, front.y_m, degrees, 1, _MATCH_M)
        self._sumo.vehicle.setPreviousSpeed(name, speed_mps)

    def go_on(self, name: str, edges: Sequence[str]) -> None:
        """Give an agent another way from the edge it is on."""
        self._way_of.pop(name, None)
        try:
            self._sumo.vehicle.setRoute(name, edges)
        except self._sumo.libsumo.TraCIException:  # it has got past the edge meanwhile: it keeps its old way
            return

    def route_of(self, name: str) -> tuple[str, ...]:
        """The edges that an agent has before it, its present one first."""
        vehicle = self._sumo.vehicle
        way = self._way_of.get(name)
        if way is None:  # SUMO is asked once for what only `go_on` changes
            way = self._way_of[name] = tuple(vehicle.getRoute(name))
        return way[max(0, vehicle.getRouteIndex(name)) :]

    def driven_m(self, name: str) -> float:
        """Distance a vehicle has driven since it set out, m; 0 before that."""
        try:
            return max(0.0, float(self._sumo.vehicle.getDistance(name)))
        except self._sumo.libsumo.TraCIException:
            return 0.0

    def known(self) -> frozenset[str]:
        """Names of everybody in the traffic, under way or about to set out."""
        return frozenset(self._kind_of)

    def gone(self) -> tuple[str, ...]:
        """Vehicles that arrived or were stuck too long in the past period."""
        simulation = self._sumo.simulation
        stuck = [name for name in simulation.getStartingTeleportIDList() if name in self._kind_of]
        for name in stuck:
            self.remove(name)
        arrived = [name for name in simulation.getArrivedIDList() if name in self._kind_of]
        return tuple(sorted({*stuck, *arrived}))

    def remove(self, name: str) -> None:
        """Take an agent out."""
        self._kind_of.pop(name, None)
        self._way_of.pop(name, None)
        try:
            self._sumo.vehicle.remove(name)
        except self._sumo.libsumo.TraCIException:
            return

    def hold(self, name: str, speed_mps: float | None) -> None:
        """Have an agent drive at a speed, or as it likes again."""
        try:
            self._sumo.vehicle.setSpeed(name, -1.0 if speed_mps is None else speed_mps)
        except self._sumo.libsumo.TraCIException:  # it has gone meanwhile
            return

    def mean_speed_mps(self) -> float:
        """Of everybody in the traffic, the ego and what is moved from outside left out."""
        speeds = [self._sumo.vehicle.getSpeed(name) for name in self._sumo.vehicle.getIDList() if name in self._kind_of]
        return sum(speeds) / len(speeds) if speeds else 0.0

    # What is moved from outside ---------------------------------------------------------------------------------------

    def place(self, name: str, length_m: float, width_m: float, edges: Sequence[str], reach_m: float = 0.0) -> None:
        """Put in something that is moved from outside.

        Args:
            name: Of it.
            length_m, width_m: Size.
            edges: Its way: who has to yield to it, does so because of this.
            reach_m: How far around it `around` looks; nowhere by default.
        """
        library = self._sumo
        vehicle, constants = library.vehicle, library.constants
        library.route.add(f"r-{name}", self._joined(edges))
        vehicle.add(name, f"r-{name}", typeID="moved")
        vehicle.setLength(name, length_m)
        vehicle.setWidth(name, width_m)
        vehicle.setSpeedMode(name, 0)
        vehicle.setLaneChangeMode(name, 0)
        if reach_m:
            wanted = [
                constants.VAR_POSITION,
                constants.VAR_ANGLE,
                constants.VAR_SPEED,
                constants.VAR_ACCELERATION,
                constants.VAR_LANE_ID,
            ]
            vehicle.subscribeContext(name, constants.CMD_GET_VEHICLE_VARIABLE, reach_m, wanted)

    def move(self, name: str, middle: Pose, length_m: float, lane: str) -> None:
        """Put something that is moved from outside to a place, for the period to come. Raises ScenarioError."""
        self._ours()
        front = middle.ahead(length_m / 2.0)
        edge, _, index = lane.rpartition("_")
        degrees = 90.0 - math.degrees(middle.heading_rad)
        self._sumo.vehicle.moveToXY(name, edge, int(index or 0), front.x_m, front.y_m, degrees, 2, _MATCH_M)

    def lead(self, name: str, edges: Sequence[str]) -> None:
        """Set the way of something that is moved from outside, from the edge that it is on.

        What SUMO joins to nothing it knows (it drops ways that its own traffic may not take) ends the way.
        """
        self.go_on(name, self._joined(edges))

    def _joined(self, edges: Sequence[str]) -> list[str]:
        """Edges up to the first that SUMO does not join to the one before."""
        way = list(edges[:1])
        for edge in edges[1:]:
            if edge not in self._onward_of(way[-1]):
                break
            way.append(edge)
        return way

    def _onward_of(self, edge: str) -> frozenset[str]:
        """Edges that one leads into."""
        found = self._onward.get(edge)
        if found is None:
            lane = self._sumo.lane
            links = (link for i in range(self.lanes_of(edge)) for link in lane.getLinks(f"{edge}_{i}"))
            found = self._onward[edge] = frozenset(str(link[0]).rpartition("_")[0] for link in links)
        return found

    def around(self, name: str) -> list[Mover]:
        """Everybody of the traffic around something that looks around."""
        c = self._sumo.constants
        found: list[Mover] = []
        for other, seen in self._sumo.vehicle.getContextSubscriptionResults(name).items():
            make = self._kind_of.get(other)
            if make is None:
                continue
            x, y = seen[c.VAR_POSITION]
            length = self._length_of[make]
            heading = self._trails.heading_rad(other, x, y, length, math.radians(90.0 - seen[c.VAR_ANGLE]))
            back = length / 2.0
            found.append(
                Mover(
                    other,
                    make,
                    x - back * math.cos(heading),
                    y - back * math.sin(heading),
                    heading,
                    seen[c.VAR_SPEED],
                    seen[c.VAR_ACCELERATION],
                    seen[c.VAR_LANE_ID],
                )
            )
        found.sort()
        self._trails.seen()
        return found

    # Lights -----------------------------------------------------------------------------------------------------------

    def links(self) -> tuple[Link, ...]:
        """Links that its traffic lights rule."""
        lights, lanes = self._sumo.trafficlight, self._sumo.lane
        found: list[Link] = []
        for light in lights.getIDList():
            for index, ways in enumerate(lights.getControlledLinks(light)):
                for lane, _, via in ways:
                    turn = next((link[6] for link in lanes.getLinks(lane) if link[4] == via), "s")
                    found.append(Link(light, index, lane, turn.lower() in "lt"))
        return tuple(found)

    def show(self, links: Iterable[Link], shown: Mapping[str, str]) -> None:
        """Set all lights: what each lane before a junction is shown, `red`, `yellow`, `green` or `off`."""
        states: dict[str, list[str]] = {}
        for link in links:
            state = states.setdefault(link.light, [])
            state.extend("r" * (link.index + 1 - len(state)))
            colour = shown.get(link.lane, "off")
            state[link.index] = {"red": "r", "yellow": "y", "off": "o"}.get(colour, _MINOR if link.left else _MAJOR)
        for light, state in states.items():
            self._sumo.trafficlight.setRedYellowGreenState(light, "".join(state))

    def _ours(self) -> None:
        if not self.open:
            raise ScenarioError(
                "Another town was set up in this process, and SUMO runs one at a time.",
                hint="Reset this one, or drive them in processes of their own.",
            )


def _kinds() -> str:
    rows = [
        f'<vType id="{name}" vClass="{make.vehicle_class}" length="{make.length_m}" width="{make.width_m}" '
        f'maxSpeed="{make.most_mps}" accel="{make.acceleration_mps2}" decel="4.5" emergencyDecel="8" sigma="0.3" '
        f'tau="1.3" minGap="2.5" speedFactor="normc(0.9,0.08,0.7,1.05)" timeToTeleport="{JAM_S}" '
        f'actionStepLength="{DECIDES_S}"/>'
        for name, make in MAKES.items()
    ]
    rows.append('<vType id="moved" vClass="ignoring" length="4.9" width="2.1" minGap="0" timeToTeleport="-1"/>')
    return f"<routes>{''.join(rows)}</routes>"


def _endless(follow: Mapping[str, set[str]]) -> dict[str, tuple[str, ...]]:
    """The largest part of a graph in which every node can be reached from every other."""
    before: dict[str, set[str]] = {}
    for edge, ways in follow.items():
        for onward in ways:
            before.setdefault(onward, set()).add(edge)
    left, best = set(follow), set[str]()
    while len(left) > len(best):
        seed = min(left)
        part = _reached(seed, follow) & _reached(seed, before)
        best = max(best, part, key=len)
        left -= part | {seed}
    return {edge: tuple(sorted(follow[edge] & best)) for edge in sorted(best)}


def _reached(start: str, follow: Mapping[str, set[str]]) -> set[str]:
    seen, rim = {start}, [start]
    while rim:
        new = [one for one in follow.get(rim.pop(), ()) if one not in seen]
        seen.update(new)
        rim.extend(new)
    return seen
