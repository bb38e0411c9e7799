"""Drones on UDP: the server packet by packet, real time, the command, and clients that know nothing of this project."""

import contextlib
import io
import json
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import cflib.crtp
import pytest
from cflib.crtp.udpdriver import UdpDriver
from rich.console import Console

import missions
from deploy.cli.__main__ import main
from deploy.cli.sim import _table
from deploy.clock import SystemClock
from deploy.errors import LinkError
from deploy.radio.simulated.crazyflie import SimulatedCrazyflie
from deploy.radio.simulated.server import SILENCE, UdpServer
from deploy.served import POSITIONING, Served
from missions.loader import load_mission
from tests.contracts import link

MISSIONS = Path(missions.__file__).parent
CLIENT = Path(__file__).with_name("plain_client.py")
ECHO = b"\xf0hello"
SECONDS = 30.0  # patience of wall time


class Peer:
    """A client's end of the wire."""

    def __init__(self, server):
        self._server = server
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        host, _, port = server.uris["cf1"].removeprefix("udp://").rpartition(":")
        self._socket.connect((host, int(port)))
        self._socket.settimeout(SECONDS)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def say(self, datagram, now=0.0):
        self._socket.send(datagram)
        self._server.exchange(now, SECONDS)

    def hears(self):
        """What has arrived, or None."""
        self._socket.settimeout(0.0)
        with contextlib.suppress(BlockingIOError):
            return self._socket.recv(100)
        return None


@pytest.fixture
def drone():
    return SimulatedCrazyflie("cf1")


@pytest.fixture
def server(drone):
    with UdpServer({"cf1": drone}, port=0) as server:
        yield server


@pytest.fixture
def peer(server):
    with Peer(server) as peer:
        yield peer


def test_a_datagram_is_a_packet_and_an_answer_one_too(server, peer):
    peer.say(ECHO)
    assert peer.hears() == ECHO
    assert server.has_client("cf1")


def test_a_probe_is_answered_and_makes_nobody_a_client(server, peer):
    peer.say(b"\xff")
    assert peer.hears() == b"\xff"
    assert not server.has_client("cf1")


@pytest.mark.parametrize("datagram", [b"", bytes([0xF0]) + bytes(31), bytes(1400)])
def test_what_is_no_packet_is_ignored(server, peer, datagram):
    peer.say(datagram)
    assert peer.hears() is None
    assert not server.has_client("cf1")


def test_answers_go_to_whoever_spoke_last(server, drone, peer):
    with Peer(server) as other:
        peer.say(ECHO)
        other.say(ECHO)
        other.say(b"\xff")
        peer.say(b"\xff")  # a scan does not take the drone away
        assert (peer.hears(), other.hears(), other.hears()) == (ECHO, ECHO, b"\xff")
        assert peer.hears() == b"\xff"
        drone._console.write("for you")
        assert (peer.hears(), other.hears()) == (None, b"\0for you")


def test_a_client_that_falls_silent_is_forgotten_and_may_come_back(server, drone, peer):
    peer.say(ECHO)
    server.exchange(SILENCE, 0.0)
    assert server.has_client("cf1")
    server.exchange(SILENCE + 0.01, 0.0)
    assert not server.has_client("cf1")
    drone._console.write("nobody hears")
    peer.say(ECHO, 5.0)
    assert (peer.hears(), peer.hears(), peer.hears()) == (ECHO, ECHO, None)


def test_null_packets_keep_a_connection(server, peer):
    peer.say(ECHO)
    peer.say(b"\xff", 0.9)
    server.exchange(1.5, 0.0)
    assert server.has_client("cf1")


def test_a_client_that_is_gone_hurts_nobody(server, drone):
    with Peer(server) as peer:
        peer.say(ECHO)
    for _ in range(3):
        drone._console.write("hello?")
        server.exchange(0.1, 0.0)
    with Peer(server) as peer:
        peer.say(ECHO, 0.2)
        assert peer.hears() == ECHO


def test_a_rebooting_drone_is_silent(peer):
    peer.say(b"\x41\x09\0\0\0\0\x04")  # an assertion
    peer.say(ECHO)
    peer.say(b"\xff")
    assert peer.hears() is None


def test_addresses_that_cannot_be_had(drone):
    with UdpServer({"a": drone}, port=0) as server:
        port = int(server.uris["a"].rpartition(":")[2])
        with pytest.raises(LinkError, match=rf"udp://127.0.0.1:{port} for b: .*in use"):
            UdpServer({"b": drone}, port=port)
    with pytest.raises(LinkError, match="for b: ports end at 65535"):
        UdpServer({"a": drone, "b": drone}, port=65535)
    with pytest.raises(LinkError, match=r"192.0.2.1:\d+ for a: .*choose another"):
        UdpServer({"a": drone}, host="192.0.2.1")
    UdpServer({"b": drone}, port=port).close()  # what failed has left nothing open


def one_drone():
    return load_mission(MISSIONS / "one_drone.yaml")


class Hurried:
    """A clock that goes on by the same step whenever it is read, and jumps on request."""

    epoch = 0.0

    def __init__(self, step=0.01):
        self._now, self._step = 0.0, step

    def now(self):
        self._now += self._step
        return self._now

    def jump(self, seconds):
        self._now += seconds


@pytest.mark.parametrize("positioning", POSITIONING)
def test_drones_know_where_they_are_if_somebody_tells_them(positioning):
    clock = Hurried()
    with Served(one_drone(), clock, port=0, positioning=positioning) as served:
        served.run(lambda: served.t >= 1.0)
        (drone,) = served._stage.swarm.drones.values()
        pad = served.status()[0].position
        estimate = drone._snapshot.telemetry.position
        error = max(abs(a - b) for a, b in zip(estimate, pad, strict=True))
        assert error < 0.01 if positioning != "none" else error == pytest.approx(max(pad), abs=0.05)
        assert (drone._localization.latest is not None) == (positioning == "mocap")


def test_late_ticks_are_caught_up_with_and_very_late_ones_given_up():
    clock = Hurried(0.005)
    with Served(one_drone(), clock, port=0) as served:

        def run_with_pause(pause, until):
            pauses = [pause]

            def stop():
                if pauses:
                    clock.jump(pauses.pop())
                return served.t >= until

            served.run(stop)

        run_with_pause(0.15, 0.5)
        assert (served.lost, clock.now() - served.t) == (0.0, pytest.approx(0.0, abs=0.03))
        run_with_pause(5.0, 1.0)
        assert served.lost == pytest.approx(4.8, abs=0.03)
        assert clock.now() - served.t == pytest.approx(served.lost, abs=0.03)


def test_status_says_what_the_room_sees():
    clock, seen = Hurried(), []
    with Served(one_drone(), clock, port=0) as served, Peer(served) as peer:
        peer._socket.send(ECHO)
        served.run(lambda: served.t >= 0.6, lambda s: seen.append(s.status()[0]))
        served._stage.swarm.drones["cf1"].receive(0x91, b"\x03")  # emergency stop
        served.run(lambda: served.t >= 1.2, lambda s: seen.append(s.status()[0]))
        served._stage.swarm.drones["cf1"].receive(0x41, b"\x09\0\0\0\0\x04")  # an assertion
        last = served.status()[0]
    assert 4 <= len(seen) <= 8
    assert [row.state for row in (seen[0], seen[-1], last)] == ["ready", "locked", "rebooting"]
    assert seen[1].connected
    assert seen[0].uri == served.uris["cf1"]
    assert 3.0 < seen[0].voltage < 4.3


def test_the_terminal_shows_everybody():
    clock = Hurried()
    with Served(one_drone(), clock, port=0) as served:
        served.lost = 1.5
        console = Console(width=120, record=True, file=io.StringIO())
        console.print(_table(served))
        text = console.export_text()
    for part in ("cf1", "udp://127.0.0.1:", "ready", " V", "0.00", "1.5 s lost", "Ctrl-C"):
        assert part in text


@pytest.fixture(scope="module")
def live():
    """URI of a drone that is served in real time, in a thread of this process."""
    cflib.crtp.CLASSES.append(UdpDriver)
    stop = threading.Event()
    with Served(one_drone(), SystemClock(), port=0) as served:
        thread = threading.Thread(target=served.run, args=(stop.is_set,))
        thread.start()
        yield served.uris["cf1"]
        stop.set()
        thread.join()
    cflib.crtp.CLASSES.remove(UdpDriver)


@pytest.mark.parametrize("promise", link.PROMISES, ids=lambda promise: promise.__name__)
def test_contract(promise, live):
    clock = SystemClock()
    promise(live, lambda seconds: clock.sleep_until(clock.now() + seconds))


@contextlib.contextmanager
def sim(*arguments):
    """``ergoflie sim`` as users start it, and the URIs it prints."""
    command = [sys.executable, "-m", "deploy.cli", "sim", *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process, process.stdout
        finally:
            process.kill()


def client(*arguments):
    """A program that uses cflib and nothing of ours."""
    command = [sys.executable, str(CLIENT), *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd="/")


def ends_well(process):
    _, complaints = process.communicate(timeout=2 * SECONDS)
    assert process.returncode == 0, complaints


@pytest.mark.slow
def test_plain_cflib_flies_a_swarm_and_clients_come_and_go():
    with sim(MISSIONS / "imec_four_drones.yaml", "--port", 0) as (process, lines):
        uris = [next(lines).split()[1] for _ in range(4)]
        with client("fly", *uris[:3]) as swarm:
            with client("hover", uris[3]) as first:
                assert first.stdout.readline() == "hovering\n"
                first.kill()
            with client("rescue", uris[3]) as second:
                ends_well(second)
            ends_well(swarm)
        process.send_signal(signal.SIGINT)
        _, complaints = process.communicate(timeout=SECONDS)
        assert (process.returncode, complaints) == (0, "")


def test_a_port_in_use_is_one_line(server, capsys):
    port = server.uris["cf1"].rpartition(":")[2]
    assert main(["sim", str(MISSIONS / "one_drone.yaml"), "--port", port]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert f"udp://127.0.0.1:{port} for cf1: " in captured.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nix.yaml"], "nix.yaml"),
        ([str(MISSIONS / "one_drone.yaml"), "--port", "70000"], "65535"),
        ([str(MISSIONS / "one_drone.yaml"), "--port", "-1"], "-1"),
        ([str(MISSIONS / "one_drone.yaml"), "--host", "192.0.2.1"], "192.0.2.1"),
    ],
)
def test_misuse_is_one_line(arguments, said, capsys):
    assert main(["sim", *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert said in captured.err


def test_machines_are_told_where_everybody_is(capsys):
    assert main(["sim", str(MISSIONS / "one_drone.yaml"), "--port", "0", "--duration", "0.5", "--json"]) == 0
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert 2 <= len(rows) <= 6
    assert [row["t"] for row in rows] == sorted(row["t"] for row in rows)
    (drone,) = rows[-1]["drones"]
    assert drone["name"] == "cf1"
    assert drone["uri"].startswith("udp://127.0.0.1:")
    assert (drone["connected"], drone["position"][2]) == (False, pytest.approx(0.0, abs=0.01))


def test_it_ends_by_itself_when_asked_to(capsys):
    assert main(["sim", str(MISSIONS / "one_drone.yaml"), "--port", "0", "--duration", "0.2"]) == 0
    assert capsys.readouterr().out.startswith("cf1 udp://127.0.0.1:")
