"""The ROS 1 client against a real master and real nodes on loopback, none of them ROS's own; whatever they do to it."""

from __future__ import annotations

import http.client
import math
import socket
import struct
import threading
import time
import xmlrpc.client
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="rosbags is not installed: pip install 'chauffeur[ros]'")

import ros_graph as ros
from hypothesis import given
from hypothesis import strategies as st
from ros_graph import (
    ENGAGE,
    FOLLOWER,
    HOST,
    MD5,
    REPLANNER,
    Master,
    Subscriber,
    VelocityPublisher,
    counts,
    eventually,
    opening,
    wish,
)

from chauffeur.worlds.ros import VehicleError, VehicleInterface, VehicleLimits, VehicleRefusalError, node, publisher
from chauffeur.worlds.ros.autoware_ai import (
    DEFINITIONS,
    VELOCITY_TYPE,
    Acknowledgement,
    AutowareAi,
    ConstantSpeed,
    Replanner,
)
from chauffeur.worlds.ros.engage import WORDS, disengage, engage
from chauffeur.worlds.ros.master import MasterError, call
from chauffeur.worlds.ros.node import Ros1Settings
from chauffeur.worlds.ros.notes import Notes
from chauffeur.worlds.ros.publisher import Publication, Publisher
from chauffeur.worlds.ros.ros1 import Ros1Vehicle
from chauffeur.worlds.ros.types import Types
from chauffeur.worlds.ros.wire import WireError, header_bytes, header_fields

pytestmark = pytest.mark.server

STACK = AutowareAi(VehicleLimits(15.0, (4.0, 20.0)), Replanner(planned_max_mps=12.0))
QUICK_S = 0.05
"""Between two looks of our node at the master, so that tests need not wait a second."""

AT_ONCE_S = 0.1
"""What `apply` and `state` may take on a busy machine; on a quiet one they take less than a millisecond."""

Opened = Callable[..., Ros1Vehicle]


@pytest.fixture
def master() -> Iterator[Master]:
    graph = Master()
    yield graph
    graph.close()


@pytest.fixture
def vehicle() -> Iterator[Opened]:
    def make(uri: str, **settings: Any) -> Ros1Vehicle:
        return Ros1Vehicle(STACK, Ros1Settings(master=uri, **settings), check_s=QUICK_S)

    with opening(make) as opened:
        yield opened


def uri_of(master: Master) -> str:
    return eventually(lambda: next(iter(master.publishers.get(FOLLOWER, {}).values()), None))


def at_once(call: Callable[[], Any]) -> Any:
    begun = time.perf_counter()
    result = call()
    assert time.perf_counter() - begun < AT_ONCE_S
    return result


def test_a_wish_reaches_both_nodes_with_every_field(master: Master, vehicle: Opened) -> None:
    with (
        ros.closing_all(Subscriber(master, FOLLOWER)) as _,
        ros.closing_all(Subscriber(master, REPLANNER, "/replanner")),
    ):
        pass  # gone again: nobody may disturb the ones below
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER, "/waypoint_replanner")
    with ros.closing_all(follower, replanner):
        car = vehicle(master.uri)
        assert isinstance(car, VehicleInterface)
        eventually(lambda: car.state().link == "up")
        before_s = time.time()
        published = at_once(lambda: car.apply(wish(10.0)))
        assert published.number == 1
        eventually(lambda: follower.got and replanner.got and car.state().delivered)
        look = ros.follower_of(follower.got[0][0])
        assert before_s - 1e-3 <= look.pop("stamp_s") <= time.time()
        assert look == {
            "seq": 1,
            "frame_id": "",
            "param_flag": 0,
            "velocity": pytest.approx(36.0),
            "lookahead_distance": 8.0,
            "lookahead_ratio": 2.0,
            "minimum_lookahead_distance": 8.0,
            "displacement_threshold": 0.0,
            "relative_angle_threshold": 0.0,
        }
        cap = ros.replanner_of(replanner.got[0][0])
        assert cap == {name: pytest.approx(value) for name, value in published.messages[0].fields.items()}
        assert (cap["velocity_max"], cap["replanning_mode"], cap["realtime_tuning_mode"]) == (36.0, True, True)
        header = follower.headers[0]
        assert header["md5sum"] == MD5[FOLLOWER]
        assert header["type"] == "autoware_config_msgs/ConfigWaypointFollower"
        assert header["latching"] == "1"
        assert header["message_definition"].startswith("std_msgs/Header header\nint32 param_flag\nfloat32 velocity\n")
        assert replanner.headers[0]["md5sum"] == MD5[REPLANNER]
        eventually(lambda: counts(car)["sent"] == 2)


def test_who_comes_late_gets_the_newest_wish_and_only_that(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    for speed in (3.0, 4.0, 5.0):
        car.apply(wish(speed))
    assert not car.state().delivered
    assert "Nobody listens to /config/waypoint_replanner; is waypoint_replanner running?" in eventually(
        lambda: (state := car.state()).link == "waiting" and state.words
    )
    late = Subscriber(master, FOLLOWER)
    with ros.closing_all(late):
        eventually(lambda: late.got)
        time.sleep(0.05)
        assert [ros.follower_of(data)["velocity"] for data, _ in late.got] == [18.0]


def test_a_constant_speed_ends_with_us_on_the_wire(master: Master) -> None:
    stack = replace(STACK, source=ConstantSpeed(Acknowledgement("Ana Example", 3.0)))
    follower = Subscriber(master, FOLLOWER)
    with ros.closing_all(follower):
        car = Ros1Vehicle(stack, Ros1Settings(master=master.uri), check_s=QUICK_S)
        car.apply(wish(2.0))
        eventually(lambda: follower.got)
        with pytest.raises(VehicleRefusalError, match="Ana Example"):
            car.apply(wish(3.1))
        car.close()
        eventually(lambda: len(follower.got) == 2)
        flags = [ros.follower_of(data)["param_flag"] for data, _ in follower.got]
        assert flags == [1, 0]
        assert ros.follower_of(follower.got[1][0])["minimum_lookahead_distance"] == 8.0


def test_a_dead_master_is_said_and_one_that_comes_is_joined(vehicle: Opened) -> None:
    port = ros.free_port()
    car = vehicle(f"http://{HOST}:{port}/")
    words = eventually(lambda: "refused" in (said := car.state().words) and said)
    assert f"No ROS master at http://{HOST}:{port}/: the connection is refused." in words
    assert car.state().link == "connecting"
    at_once(lambda: car.apply(wish(6.0)))
    master = Master(port)
    follower, replanner = Subscriber(master, FOLLOWER), Subscriber(master, REPLANNER)
    with ros.closing_all(follower, replanner, master):
        eventually(lambda: car.state().delivered and follower.got)
        assert ros.follower_of(follower.got[0][0])["velocity"] == pytest.approx(21.6)
        assert car.state().link == "up"
        car.close()


def test_a_master_started_anew_is_registered_with_again(vehicle: Opened) -> None:
    first = Master()
    old = Subscriber(first, FOLLOWER)
    car = vehicle(first.uri)
    eventually(lambda: old.headers and counts(car).get("registrations") == 1)  # with every topic, not only with ours
    first.close()
    eventually(lambda: "refused" in " ".join(car.state().notes))
    at_once(lambda: car.apply(wish(7.0)))
    eventually(lambda: old.got)  # connections outlive a master
    second = Master(first.port)
    fresh = Subscriber(second, FOLLOWER, "/pure_pursuit_2")
    with ros.closing_all(fresh, second):
        eventually(lambda: fresh.got)
        eventually(lambda: counts(car)["registrations"] == 2)
        assert counts(car)["master_failures"] >= 1
        car.close()
        assert not second.publishers[FOLLOWER]
    old.server.server_close()
    old.vanish()


def test_a_master_that_forgot_us_is_registered_with_again(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    uri_of(master)
    eventually(lambda: counts(car).get("registrations") == 1)
    master.publishers.clear()
    master.nodes.clear()
    eventually(lambda: counts(car)["registrations"] == 2)
    assert uri_of(master)
    assert "does not know us any more" in " ".join(car.state().notes)


def test_a_master_that_hangs_holds_nobody_up(monkeypatch: pytest.MonkeyPatch, vehicle: Opened) -> None:
    monkeypatch.setattr(node, "GOODBYE_S", 0.5)
    monkeypatch.setattr(node, "TIMEOUT_S", 0.6)
    with socket.create_server((HOST, 0)) as silent:
        car = vehicle(f"http://{HOST}:{silent.getsockname()[1]}/")
        for speed in range(10):
            at_once(lambda speed=speed: car.apply(wish(speed)))
            at_once(car.state)
        eventually(lambda: "does not answer within 0.6 s" in car.state().words)
        begun = time.perf_counter()
        car.close()
        assert time.perf_counter() - begun < 3.0


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        (b"HTTP/1.0 500 Oh\r\n\r\n", "What answers as ROS master at"),
        (b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\nnot xml", "What answers as ROS master at"),
        (
            b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n"
            b"<methodResponse><params><param><value>7</value></param></params></methodResponse>",
            "answered registerPublisher with '7'",
        ),
        (
            b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<methodResponse><params><param><value>"
            b"<bigdecimal>x</bigdecimal></value></param></params></methodResponse>",
            "What answers as ROS master at",
        ),
        (b"SSH-2.0-OpenSSH_9.2\r\n", "cannot be reached: BadStatusLine"),
        (b"", "cannot be reached: RemoteDisconnected"),
    ],
)
def test_what_is_no_master_is_said(reply: bytes, words: str, vehicle: Opened) -> None:
    with socket.create_server((HOST, 0)) as listener:

        def serve() -> None:
            while True:
                try:
                    sock, _ = listener.accept()
                except OSError:
                    return
                with sock:
                    asked = b""
                    while b"</methodCall>" not in asked:  # closing before all is read would reset the connection
                        asked += sock.recv(65536)
                    sock.sendall(reply)

        threading.Thread(target=serve, daemon=True).start()
        car = vehicle(f"http://{HOST}:{listener.getsockname()[1]}")
        eventually(lambda: counts(car).get("master_failures"))
        assert words in car.state().words
        at_once(lambda: car.apply(wish(5.0)))
        car.close()
        listener.shutdown(socket.SHUT_RDWR)


def test_another_build_of_autoware_is_refused_in_words(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    car.apply(wish(5.0))
    uri = uri_of(master)
    with ros.connect(uri, FOLLOWER, md5sum="0" * 32, callerid="/pure_pursuit") as sock:
        answer = ros.fields_of(ros.one(sock))
        assert set(answer) == {"error"}
        assert sock.recv(1) == b""  # not one byte of a message
    state = eventually(lambda: (seen := car.state()).link == "refused" and seen)
    assert "/pure_pursuit expects another autoware_config_msgs/ConfigWaypointFollower" in state.words
    assert MD5[FOLLOWER] in state.words
    assert "no build known here" in state.words
    assert counts(car)["refused_subscribers"] == 1
    with ros.connect(uri, FOLLOWER, md5sum="*") as looking:  # `rostopic echo`
        assert ros.fields_of(ros.one(looking))["md5sum"] == MD5[FOLLOWER]
        assert ros.follower_of(ros.one(looking))["velocity"] == 18.0
        assert car.state().link == "refused"  # looking on does not make the follower right
        assert car.state().receivers == 0
        assert not car.state().delivered
    with ros.connect(uri, FOLLOWER) as right:
        ros.one(right)
        eventually(lambda: car.state().link == "waiting")
        with ros.connect(uri, REPLANNER, md5sum="*") as looking:
            ros.one(looking)
            assert "Nobody listens to /config/waypoint_replanner" in car.state().words


def test_a_subscriber_that_vanishes_is_said(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    follower = Subscriber(master, FOLLOWER)
    eventually(lambda: follower.headers)
    follower.vanish()
    eventually(lambda: "/pure_pursuit closed its connection." in car.state().notes)
    assert car.state().receivers == 0
    at_once(lambda: car.apply(wish(5.0)))
    follower.server.shutdown()


def test_a_subscriber_that_breaks_off_is_said_and_missed_by_nobody(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    with ros.connect(uri_of(master), FOLLOWER, callerid="/broken") as broken:
        ros.one(broken)
        broken.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed with a reset
    eventually(lambda: "Lost /broken" in " ".join(car.state().notes))
    follower = Subscriber(master, FOLLOWER)
    with ros.closing_all(follower):
        car.apply(wish(5.0))
        eventually(lambda: follower.got)


def test_a_reply_that_never_ends_is_given_up() -> None:
    with socket.create_server((HOST, 0)) as listener:

        def drip() -> None:
            sock, _ = listener.accept()
            with sock, suppress(OSError):
                sock.recv(65536)
                sock.sendall(b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<methodResponse>")
                while True:
                    sock.sendall(b" ")
                    time.sleep(0.01)

        threading.Thread(target=drip, daemon=True).start()
        begun = time.perf_counter()
        with pytest.raises(MasterError, match="does not answer within"):
            call(f"http://{HOST}:{listener.getsockname()[1]}", "ROS master", "getPid", "/x", timeout_s=0.3)
        assert time.perf_counter() - begun < 3.0


def test_a_subscriber_that_cannot_reach_us_is_named(master: Master, vehicle: Opened) -> None:
    xmlrpc.client.ServerProxy(master.uri).registerSubscriber(
        "/far_follower", REPLANNER, ros.TYPES[REPLANNER], f"http://{HOST}:{ros.free_port()}/"
    )
    car = vehicle(master.uri)
    words = eventually(lambda: "does not connect" in (said := car.state().words) and said)
    assert "/far_follower listens to /config/waypoint_replanner but does not connect to us" in words
    assert HOST in words


def test_connections_that_say_nothing_or_nonsense_are_closed(
    master: Master, vehicle: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(publisher, "PATIENCE_S", 0.3)
    car = vehicle(master.uri)
    address = ros.topic_address(uri_of(master), FOLLOWER)
    for sent in (
        b"",
        b"\x10",
        struct.pack("<I", 2**31),
        struct.pack("<I", 4) + b"\xff\xff\xff\xff",
        b"GET / HTTP/1.1\r\n\r\n",
    ):
        with socket.create_connection(address, timeout=5.0) as sock:
            sock.sendall(sent)
            assert sock.recv(1) == b"", sent  # closed by the other side
    notes = " ".join(car.state().notes)
    assert "said nothing for" in notes
    assert "no ROS connection header" in notes
    monkeypatch.setattr(publisher, "PATIENCE_S", 5.0)
    crowd = [socket.create_connection(address, timeout=5.0) for _ in range(publisher.MOST_SUBSCRIBERS + 8)]
    eventually(lambda: counts(car).get("turned_away") == 8)
    for sock in crowd:
        sock.close()
    with ros.connect(uri_of(master), "/config/waypoint_follower", topic="/cmd_vel") as sock:
        assert "not published here" in ros.fields_of(ros.one(sock))["error"]


def test_who_reads_slowly_gets_the_newest_and_holds_nobody_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(publisher, "PATIENCE_S", 0.5)
    notes = Notes()
    topic = Publication("/t", "a/B", "m" * 32, "int32 x\n")
    out = Publisher(HOST, "/us", (topic,), notes, lambda md5, _: md5)
    header = ros.framed({"callerid": "/slow", "topic": "/t", "md5sum": "m" * 32, "type": "a/B"})
    slow = socket.create_connection((HOST, out.port), timeout=5.0)
    dead = socket.create_connection((HOST, out.port), timeout=5.0)
    with slow, dead:
        for sock in (slow, dead):
            sock.sendall(header)
            ros.one(sock)
        body = b"." * 300_000
        begun = time.perf_counter()
        for number in range(200):
            out.publish("/t", struct.pack("<I", number) + body)
        assert time.perf_counter() - begun < 1.0
        got = [struct.unpack_from("<I", ros.one(slow))[0]]
        while got[-1] != 199:
            got.append(struct.unpack_from("<I", ros.one(slow))[0])
        assert got == sorted(set(got))
        assert len(got) < 200
        assert dict(notes.counted())["replaced"] > 0
        slow.close()

        def dropped() -> bool:
            out.publish("/t", body)  # until the buffers between the two are full
            return "/slow took no message for 0.5 s; connection closed." in notes.said()

        eventually(dropped)
        assert out.receivers("/t") == (0, False)
    out.close()


def test_a_second_node_of_the_same_name_ends_the_first(master: Master, vehicle: Opened) -> None:
    first = vehicle(master.uri, node="/chauffeur")
    eventually(lambda: counts(first).get("registrations"))  # with all its topics: or it would end the second in turn
    second = vehicle(master.uri, node="/chauffeur")
    state = eventually(lambda: (seen := first.state()).link == "replaced" and seen)
    assert "new node registered with same name" in state.words
    with pytest.raises(VehicleError, match="told /chauffeur to end"):
        first.apply(wish(5.0))
    second.apply(wish(5.0))
    eventually(lambda: counts(second).get("registrations"))
    first.close()
    assert list(master.publishers[FOLLOWER]) == ["/chauffeur"]  # the first did not unregister the second


def test_the_vehicles_speed_is_read_and_grows_old(
    master: Master, vehicle: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chauffeur.worlds.ros.ros1.FRESH_S", 0.3)
    monkeypatch.setattr("chauffeur.worlds.ros.subscriber.RETRY_S", 0.05)
    car = vehicle(master.uri)
    assert car.state().speed_mps is None
    publisher = VelocityPublisher(master)
    publisher.speed_mps = 3.5
    eventually(lambda: car.state().speed_mps == 3.5)
    publisher.speed_mps = math.nan
    eventually(lambda: car.state().speed_mps is None)
    publisher.speed_mps = 4.5
    eventually(lambda: car.state().speed_mps == 4.5)
    publisher.speed_mps = struct.pack("<I", 5) + b"short"
    eventually(lambda: "no geometry_msgs/TwistStamped" in " ".join(car.state().notes))
    publisher.speed_mps = struct.pack("<I", 2**31)
    eventually(lambda: "a message of 2147483648 bytes" in " ".join(car.state().notes))
    publisher.speed_mps = 5.5  # it was connected to anew each time
    eventually(lambda: car.state().speed_mps == 5.5)
    publisher.close()
    publisher.speed_mps = b""
    eventually(lambda: car.state().speed_mps is None)
    other = VelocityPublisher(master, md5="f" * 32)
    eventually(lambda: "refuses to send: md5sums do not match" in " ".join(car.state().notes))
    other.close()


def test_the_slave_answers_nodes_and_withstands_the_rest(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    uri = uri_of(master)
    proxy: Any = xmlrpc.client.ServerProxy(uri)
    assert proxy.getMasterUri("/test")[2] == master.uri
    assert [REPLANNER, ros.TYPES[REPLANNER]] in proxy.getPublications("/test")[2]
    assert proxy.getSubscriptions("/test")[2] == [["/current_velocity", "geometry_msgs/TwistStamped"]]
    assert proxy.requestTopic("/test", "/cmd_vel", [["TCPROS"]])[0] == -1
    assert proxy.requestTopic("/test", FOLLOWER, [["UDPROS", "", "", 0, 0]])[0] == 0
    with ros.connect(uri, FOLLOWER, callerid="/looker") as sock:
        ros.one(sock)
        assert proxy.getBusInfo("/test")[2] == [[0, "/looker", "o", "TCPROS", FOLLOWER, 1]]
    for arguments in ((), ("/x", 5, None), ("/x", "/current_velocity", "http://nowhere")):
        with pytest.raises((xmlrpc.client.Fault, TypeError)):
            assert proxy.publisherUpdate(*arguments)[0] != 1
            raise TypeError  # answered, with no
    with pytest.raises(xmlrpc.client.Fault):
        proxy.system("true")
    host, _, port = uri.removeprefix("http://").strip("/").partition(":")
    for length, status in (("99999999", 413), ("-1", 411), ("x", 411)):
        connection = http.client.HTTPConnection(host, int(port), timeout=5.0)
        connection.putrequest("POST", "/RPC2")
        connection.putheader("Content-Length", length)
        connection.endheaders()
        assert connection.getresponse().status == status
        connection.close()
    car.apply(wish(5.0))
    proxy.shutdown("/rosnode", "user request")
    assert "user request (from /rosnode)" in eventually(lambda: (s := car.state()).link == "replaced" and s.words)
    with pytest.raises(VehicleError, match="user request"):
        car.apply(wish(5.0))


def test_publishers_named_by_a_stranger_start_few_threads(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    proxy: Any = xmlrpc.client.ServerProxy(uri_of(master))
    before = threading.active_count()
    for number in range(100):
        proxy.publisherUpdate("/x", "/current_velocity", [f"http://127.0.0.1:{1 + number}/"])
    assert threading.active_count() <= before + 16
    at_once(lambda: car.apply(wish(5.0)))


def test_only_the_configured_address_is_listened_on(master: Master, vehicle: Opened) -> None:
    vehicle(master.uri)
    uri_of(master)
    assert ros.listening() == {HOST}
    with pytest.raises(VehicleError, match=r"Cannot listen on 192\.0\.2\.1"):
        Ros1Vehicle(STACK, Ros1Settings(master=master.uri, host="192.0.2.1"))
    with pytest.raises(VehicleError, match="no ROS master"):
        Ros1Vehicle(STACK, Ros1Settings(master="11311"))


def test_nothing_is_left_open(master: Master) -> None:
    follower = Subscriber(master, FOLLOWER)
    before = threading.enumerate()
    with ros.closing_all(follower):
        settled = None
        for _ in range(4):
            car = Ros1Vehicle(STACK, Ros1Settings(master=master.uri), check_s=QUICK_S)
            car.apply(wish(5.0))
            eventually(lambda car=car: car.state().receivers == 0 and counts(car).get("sent"))
            car.close()
            car.close()
            assert car.state().link == "closed"
            eventually(lambda: not [t for t in threading.enumerate() if t.name.startswith("ros1-") and t not in before])
            eventually(lambda: not follower._known)
            files = ros.open_files()
            assert settled is None or files <= settled
            settled = files
        assert not master.publishers[FOLLOWER]


def test_of_many_callers_the_last_number_is_what_stands(master: Master, vehicle: Opened) -> None:
    car = vehicle(master.uri)
    numbers: list[tuple[int, float]] = []

    def many(offset: int) -> None:
        for step in range(25):
            published = car.apply(wish((offset * 25 + step) / 20))
            numbers.append((published.number, float(published.messages[1].fields["velocity"])))  # type: ignore[arg-type]

    threads = [threading.Thread(target=many, args=(offset,)) for offset in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(number for number, _ in numbers) == list(range(1, 201))
    late = Subscriber(master, FOLLOWER)
    with ros.closing_all(late):
        eventually(lambda: late.got)
        assert ros.follower_of(late.got[0][0])["velocity"] == pytest.approx(max(numbers)[1])


def test_engaging_takes_the_word_and_a_node_that_hears_it(master: Master) -> None:
    settings = Ros1Settings(master=master.uri)
    for typed in ("", "yes", WORDS[1], WORDS[0].upper()):
        with pytest.raises(VehicleError, match="another word"):
            engage(settings, WORDS[0], typed)
    with pytest.raises(VehicleError, match="another word"):
        engage(settings, "yes", "yes")
    assert not master.publishers
    with pytest.raises(VehicleError, match="Nobody took it"):
        engage(settings, WORDS[0], WORDS[0], within_s=0.2)
    interface = Subscriber(master, ENGAGE, "/ssc_interface")
    with ros.closing_all(interface):
        assert engage(settings, WORDS[0], WORDS[0]) == 1
        assert disengage(settings) == 1
        eventually(lambda: [data for data, _ in interface.got] == [b"\x01", b"\x00"])
        late = Subscriber(master, ENGAGE, "/late")
        time.sleep(0.2)
        assert not late.got  # nothing goes on telling the vehicle to engage
        late.close()


@given(st.dictionaries(st.text("abcxyz_", min_size=1), st.text(max_size=20)), st.binary(max_size=60))
def test_headers_are_read_back_and_nonsense_is_refused(fields: dict[str, str], nonsense: bytes) -> None:
    data = header_bytes(fields)
    assert header_fields(data[4:]) == fields
    for damaged in (nonsense, data[4:] + nonsense):
        with suppress(WireError):
            header_fields(damaged)


@pytest.mark.parametrize(
    ("data", "words"),
    [(b"\x01\x00\x00\x00\xff", "no text"), (b"\x01\x00\x00\x00a", "no value"), (b"\x05\x00\x00\x00a", "beyond")],
)
def test_damaged_headers_say_what_is_wrong(data: bytes, words: str) -> None:
    with pytest.raises(WireError, match=words):
        header_fields(data)


TYPES = Types(1, DEFINITIONS)


@given(st.binary(max_size=120))
def test_bytes_that_are_no_message_are_refused(data: bytes) -> None:
    for name in (VELOCITY_TYPE, *DEFINITIONS):
        try:
            TYPES.decode(name, data)
        except VehicleError as error:
            assert name in str(error)


def test_values_that_fit_no_field_are_refused() -> None:
    good: dict[str, Any] = dict(STACK.released(None)[0][0].fields)
    assert TYPES.md5("autoware_config_msgs/ConfigWaypointReplanner") == MD5[REPLANNER]
    TYPES.encode("autoware_config_msgs/ConfigWaypointReplanner", good)
    bad = [good | {"velocity_offset": 2**40}, good | {"velocity_max": "fast"}, good | {"extra": 1}]
    for fields in [*bad, {name: value for name, value in good.items() if name != "velocity_max"}]:
        with pytest.raises(VehicleError, match="cannot be made"):
            TYPES.encode("autoware_config_msgs/ConfigWaypointReplanner", fields)
