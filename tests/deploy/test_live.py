"""Watching a flight: page, feed and Foxglove's protocol, with real clients; strangers are sent away."""

import http.client
import json
import math
import socket
import struct
import threading

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from deploy.cli import flying
from deploy.errors import DeployError
from deploy.flight.records import FlightStatus, RobotStatus
from deploy.flightlog.writer import FlightLog
from deploy.live import live, server
from deploy.live.frames import Frames, encode
from deploy.live.outlet import Outlet
from deploy.phases import Phase
from tests.deploy import synthetic_flight as synthetic
from tests.deploy.browser import CHROMIUM, Page, browser

PATIENCE = 20.0  # s
FOXGLOVE = ["foxglove.websocket.v1"]


@pytest.fixture(scope="module")
def plan():
    return synthetic.flight_plan(duration=6.0, robots=2, name="evil", description="</script><script>alert(1)</script>")


@pytest.fixture
def served(plan):
    with live(plan, 0) as watched:
        yield watched


def status(k, phase=Phase.ON_MISSION, message="go", note=""):
    """The k-th of a flight: two robots, search since 1 s."""
    robots = tuple(
        RobotStatus(
            name,
            (0.5 + 0.01 * k, y, 0.6),
            0.031,
            3.9,
            4.0,
            note,
            target=(0.5 + 0.01 * k, y + 0.03, 0.6),
            state="flying",
        )
        for name, y in (("cf1", 0.5), ("cf2", 1.5))
    )
    mission = 0.1 * k - 1.0 if k >= 10 else math.nan
    return FlightStatus(0.1 * k, phase, mission, 6.0, robots, message, 1.0 / (k + 1), 0.01)


def address(served, path="feed"):
    return served.url.replace("http", "ws") + path


def hear(socket):
    return json.loads(socket.recv(timeout=PATIENCE))


def get(served, path="/", **headers):
    host = served.url.split("/")[2]
    connection = http.client.HTTPConnection(host, timeout=PATIENCE)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    return response.status, response.read().decode()


def test_the_page_is_whole_and_asks_for_its_feed_only(served):
    code, page = get(served)
    assert code == 200
    assert page.count("<script") == 2
    assert "connect-src 'self'" in page
    assert "https://" not in page
    assert get(served, "/etc/passwd")[0] == 404


def test_who_comes_late_gets_the_whole_flight(served):
    with connect(address(served)) as early:
        assert hear(early) == {"begin": []}
        served.frames.show(status(0))
        first = hear(early)
        assert first["r"][0][0] == [0.5, 0.5, 0.6]
        assert first["m"] is None
        with connect(address(served)) as late:
            assert hear(late) == {"begin": [first]}
            served.frames.show(status(11))
            assert hear(late) == hear(early)
        served.frames.end()
        assert hear(early) == {"end": True}


def test_a_frame_says_what_is_not_known_and_who_is_left_behind():
    lonely = FlightStatus(1.0, Phase.TAKING_OFF, math.nan, 6.0, (RobotStatus("b", None, math.nan, math.nan, math.nan),))
    frame = json.loads(encode(lonely, ("a", "b")))
    assert frame["phase"] == "taking off"
    assert frame["r"] == [None, [None, None, "", None, None, None, ""]]
    assert frame["e"] is None


def test_strangers_are_sent_away(served):
    assert get(served, Host="evil.example:80")[0] == 403
    for origin in ("https://evil.example", "null", "http://127.0.0.1.evil.example"):
        for path, protocols in (("feed", None), ("", FOXGLOVE)):
            with (
                pytest.raises(InvalidStatus) as refused,
                connect(address(served, path), origin=origin, subprotocols=protocols),
            ):
                pass
            assert refused.value.response.status_code == 403
    with pytest.raises(InvalidStatus), connect(address(served, "other")):
        pass
    with connect(address(served), origin=served.url.rstrip("/")) as friend:
        assert hear(friend) == {"begin": []}
    with connect(address(served, ""), origin="https://app.foxglove.dev", subprotocols=FOXGLOVE) as viewer:
        assert hear(viewer)["op"] == "serverInfo"


def test_foxglove_gets_what_the_log_gets(served, tmp_path):
    with FlightLog(tmp_path / "a.mcap", 1.0e9, {}, {}) as log:
        log.tap = served.topics.record
        log.write("/map", 0.0, {"frame_id": "world"})
        with connect(address(served, ""), subprotocols=FOXGLOVE) as viewer:
            assert viewer.subprotocol == FOXGLOVE[0]
            assert hear(viewer)["capabilities"] == []
            (channel,) = hear(viewer)["channels"]
            assert (channel["topic"], channel["schemaName"], channel["encoding"]) == ("/map", "foxglove.Grid", "json")
            assert json.loads(channel["schema"])["title"] == "foxglove.Grid"
            # What was written once before anybody looked is sent all the same.
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": channel["id"]}]}))
            data = viewer.recv(timeout=PATIENCE)
            assert struct.unpack_from("<BIQ", data) == (1, 7, 10**18)
            assert json.loads(data[13:]) == {"frame_id": "world"}
            log.battery("cf1", 0.5, 3.9)
            (battery,) = hear(viewer)["channels"]
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 8, "channelId": battery["id"]}]}))
            assert json.loads(viewer.recv(timeout=PATIENCE)[13:])["voltage"] == 3.9
            viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [7]}))
            for nonsense in ("no json", "[]", '{"op":"advertise"}', '{"op":"subscribe","subscriptions":[{}]}'):
                viewer.send(nonsense)
                assert hear(viewer)["level"] == 1
            log.write("/map", 1.0, {"frame_id": "nobody asked"})
            log.battery("cf1", 1.5, 3.8)
            assert json.loads(viewer.recv(timeout=PATIENCE)[13:])["voltage"] == 3.8


def test_nobody_who_watches_holds_up_the_flight(plan):
    outlet = Outlet(most=3)
    for k in range(10):
        outlet.put(k)
    outlet.close()
    got = []
    outlet.drain(got.append)
    assert got == [7, 8, 9]
    frames = Frames(["cf1", "cf2"])
    asleep = frames.join()
    for k in range(20):
        frames.show(status(k))
    frames.leave(asleep)
    frames.end()


def test_who_stopped_listening_does_not_keep_the_program_from_ending(plan, monkeypatch):
    monkeypatch.setattr(server, "PATIENCE", 0.1)
    before = set(threading.enumerate())
    with live(plan, 0) as watched, socket.socket() as deaf:
        host, port = watched.url.split("/")[2].split(":")
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.connect((host, int(port)))
        deaf.sendall(
            f"GET /feed HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        assert deaf.recv(12) == b"HTTP/1.1 101"
        for k in range(8):
            watched.frames.show(status(k, message="x" * 4_000_000))  # more than any socket holds
        watched.frames.end()
        with connect(address(watched), max_size=None) as friend:
            assert len(json.loads(friend.recv(timeout=PATIENCE))["begin"]) == 8
    for thread in set(threading.enumerate()) - before:
        thread.join(PATIENCE)
        assert not thread.is_alive()


def test_a_port_that_is_taken_is_an_error_before_the_flight(served, plan):
    port = int(served.url.split(":")[2].strip("/"))
    with pytest.raises(DeployError, match=f"port {port} of this computer cannot be served"), live(plan, port):
        pass


def test_the_command_line_shows_it_all_at_once(plan, tmp_path, capsys):
    with flying.watched(plan, live=0) as watch:
        url = capsys.readouterr().err.split("live: ")[1].split()[0]
        with connect(url.replace("http", "ws") + "feed") as socket:
            assert hear(socket) == {"begin": []}
            watch.observer(status(12))
            assert hear(socket)["t"] == 1.2
        assert watch.tap is not None
    assert "on mission: go" in capsys.readouterr().err
    with flying.watched(plan) as watch:
        assert watch.tap is None


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: the page was not tried in a browser")
def test_the_page_plays_what_comes(served, tmp_path):
    for k in range(15):
        served.frames.show(status(k, Phase.TAKING_OFF if k < 10 else Phase.ON_MISSION))
    with browser(tmp_path) as socket:
        page = Page(socket, served.url, 1200, 1400)
        page.wait("document.documentElement.dataset.frames === '15'")
        assert float(page.ask("document.documentElement.dataset.time")) == pytest.approx(0.4, abs=1e-3)
        served.frames.show(status(15, message="cf2: <b>late</b>", note="off its way"))
        page.wait("document.documentElement.dataset.frames === '16'")
        # It follows the flight until somebody looks back, and stays there then.
        assert float(page.ask("document.documentElement.dataset.time")) == pytest.approx(0.5, abs=1e-3)
        page.ask("document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'Home', bubbles: true }))")
        served.frames.show(status(16, note="off its way"))
        page.wait("document.documentElement.dataset.frames === '17'")
        assert float(page.ask("document.documentElement.dataset.time")) == pytest.approx(-1.0, abs=1e-3)
        page.ask("document.getElementById('follow').click()")
        assert float(page.ask("document.documentElement.dataset.time")) == pytest.approx(0.6, abs=1e-3)
        table = page.ask("document.getElementById('table').innerText")
        for cell in ("cf1", "flying", "3.90", "3.1", "off its way"):
            assert cell in table
        assert "<b>late</b>" in page.ask("document.getElementById('said').innerText")
        assert page.ask("document.getElementById('phase').textContent") == "on mission"
        assert int(page.ask("document.querySelector('#chart-ergodicity canvas').dataset.points")) == 17
        served.frames.end()
        page.wait("document.documentElement.dataset.live === 'over'")
        assert page.ask("document.documentElement.scrollWidth") <= 1200
        assert page.errors == []
