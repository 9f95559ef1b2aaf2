"""A real ROS 1 for tests, from Debian's packages: master, rospy nodes, and a vehicle's message package."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import ros_graph as ros

from chauffeur.worlds.ros.autoware_ai import DEFINITIONS

PYTHON = "/usr/bin/python3"
GENERATOR = Path("/usr/lib/genpy/genmsg_py.py")
TOOLS = [Path("/usr/bin/roscore"), Path("/usr/bin/rostopic"), Path("/usr/bin/rosnode"), GENERATOR]
MISSING = (
    "no ROS 1 here: apt-get install ros-core python3-rospy python3-rostopic python3-rosnode ros-std-msgs "
    "python3-std-msgs python3-genpy"
)

LISTENER = """
import json, sys, time
import rospy
from autoware_config_msgs.msg import ConfigWaypointFollower, ConfigWaypointReplanner

def told(message):
    came = time.time()
    fields = {name: getattr(message, name) for name in message.__slots__ if name != "header"}
    header = getattr(message, "header", None)
    stamp = header.stamp.to_sec() if header else None
    print(json.dumps({"fields": fields, "came": came, "stamp": stamp}), flush=True)

rospy.init_node(sys.argv[1], anonymous=True, disable_signals=True)
kind = {"follower": ConfigWaypointFollower, "replanner": ConfigWaypointReplanner}[sys.argv[2]]
rospy.Subscriber("/config/waypoint_" + sys.argv[2], kind, told, tcp_nodelay=True, queue_size=1000)
print(json.dumps({"ready": True}), flush=True)
rospy.spin()
"""

SPEEDOMETER = """
import json, sys
import rospy
from geometry_msgs.msg import TwistStamped

rospy.init_node("can_status", disable_signals=True)
out = rospy.Publisher("/current_velocity", TwistStamped, queue_size=1)
print(json.dumps({"ready": True}), flush=True)
message = TwistStamped()
message.twist.linear.x = float(sys.argv[1])
while not rospy.is_shutdown():
    message.header.stamp = rospy.Time.now()
    out.publish(message)
    rospy.sleep(0.05)
"""


def missing() -> str:
    """Why there is no ROS 1 here; empty when there is."""
    return "" if all(tool.exists() for tool in TOOLS) else MISSING


def make_packages(folder: Path) -> Path:
    """`autoware_config_msgs`, generated as ROS itself does it, and a folder for PYTHONPATH and ROS_PACKAGE_PATH."""
    package = folder / "autoware_config_msgs"
    (package / "msg").mkdir(parents=True)
    (package / "package.xml").write_text(
        '<package format="2"><name>autoware_config_msgs</name><version>1.14.0</version><description>d</description>'
        '<maintainer email="a@example.org">a</maintainer><license>Apache-2.0</license></package>'
    )
    files = []
    for name, definition in DEFINITIONS.items():
        files.append(package / "msg" / f"{name.partition('/')[2]}.msg")
        files[-1].write_text("".join(f"{kind} {field}\n" for kind, field in definition))
    generate = [PYTHON, str(GENERATOR), "-p", "autoware_config_msgs", "-I", "std_msgs:/usr/share/std_msgs/msg"]
    out = ["-o", str(package / "msg")]
    subprocess.run([*generate, *out, *map(str, files)], check=True, capture_output=True, env=environment(folder, 1))
    subprocess.run([*generate, *out, "--initpy"], check=True, capture_output=True, env=environment(folder, 1))
    (package / "__init__.py").touch()
    return folder


def environment(folder: Path, port: int) -> dict[str, str]:
    """Of every ROS process: our packages, our master, nothing of this virtual environment."""
    return {
        "PATH": "/usr/bin:/bin",
        "HOME": str(folder),
        "ROS_HOME": str(folder / "ros_home"),
        "ROS_MASTER_URI": f"http://{ros.HOST}:{port}",
        "ROS_IP": ros.HOST,
        "ROS_PACKAGE_PATH": f"{folder}:/usr/share",
        "PYTHONPATH": str(folder),
        "PYTHONUNBUFFERED": "1",
        "PYTHONWARNINGS": "ignore",
    }


@contextmanager
def running(command: list[str], folder: Path, port: int) -> Iterator[subprocess.Popen[str]]:
    """A process in a group of its own, and nothing of it afterwards."""
    process = subprocess.Popen(
        command,
        env=environment(folder, port),
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        end(process)


def end(process: subprocess.Popen[str]) -> None:
    """Kill it and its children."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait(timeout=10)


@contextmanager
def roscore(folder: Path, port: int) -> Iterator[None]:
    """A real `roscore`: master and `rosout`."""
    command = ["/usr/bin/roscore", "-p", str(port)]
    with running(command, folder, port) as process:
        threading.Thread(target=_swallow, args=(process.stdout,), daemon=True).start()
        try:
            _until_it_answers(port)
            yield
        finally:
            process.send_signal(signal.SIGINT)  # its children are in groups of their own; so it ends them itself
            process.wait(timeout=20)


@contextmanager
def rosmaster(folder: Path, port: int) -> Iterator[None]:
    """The master alone, which is killed without warning at the end."""
    with running(["/usr/bin/rosmaster", "--core", "-p", str(port)], folder, port) as process:
        threading.Thread(target=_swallow, args=(process.stdout,), daemon=True).start()
        _until_it_answers(port)
        yield


def _until_it_answers(port: int) -> None:
    def answers() -> bool:
        with suppress(OSError):
            return xmlrpc.client.ServerProxy(f"http://{ros.HOST}:{port}").getPid("/test")[0] == 1
        return False

    ros.eventually(answers, within_s=20.0)


def _swallow(stream: IO[str] | None) -> None:
    for _ in stream or ():
        pass


class Node:
    """A rospy program that prints JSON lines."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.said: list[dict[str, Any]] = []
        self._process = process
        threading.Thread(target=self._read, daemon=True).start()
        ros.eventually(lambda: self.said, within_s=20.0)

    @property
    def got(self) -> list[dict[str, Any]]:
        return self.said[1:]

    def _read(self) -> None:
        for line in self._process.stdout or ():
            self.said.append(json.loads(line))


@contextmanager
def rospy_node(program: str, folder: Path, port: int, *arguments: str) -> Iterator[Node]:
    """A rospy program, ready."""
    with running([PYTHON, "-c", program, *arguments], folder, port) as process:
        yield Node(process)


def tool(command: list[str], folder: Path, port: int) -> str:
    """Output of one of ROS's own tools."""
    done = subprocess.run(
        command, env=environment(folder, port), capture_output=True, text=True, timeout=30, check=True, input=""
    )
    return done.stdout


def has_geometry() -> bool:
    """Whether `geometry_msgs` for rospy is installed; `ros-core` does not bring it."""
    return Path("/usr/lib/python3/dist-packages/geometry_msgs").exists()
