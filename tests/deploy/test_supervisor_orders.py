"""Orders to the supervisor: bytes, ports by firmware, and what a drone gets whose link is just being opened again."""

import pytest
from cflib.crazyflie.localization import Localization
from cflib.crazyflie.platformservice import PLATFORM_REQUEST_ARMING
from cflib.crtp.crtpstack import CRTPPort

from deploy.clock import SystemClock
from deploy.radio import orders
from deploy.radio.drone import Drone

NEW = CRTPPort.SUPERVISOR, 1
SENT = {  # protocol 12 and later, before
    "emergency_stop": ((*NEW, b"\x03"), (CRTPPort.LOCALIZATION, 1, bytes([Localization.EMERGENCY_STOP]))),
    "watchdog": ((*NEW, b"\x04"), (CRTPPort.LOCALIZATION, 1, bytes([Localization.EMERGENCY_STOP_WATCHDOG]))),
    "arm": ((*NEW, b"\x01\x01"), (CRTPPort.PLATFORM, 0, bytes([PLATFORM_REQUEST_ARMING, 1]))),
    "disarm": ((*NEW, b"\x01\x00"), (CRTPPort.PLATFORM, 0, bytes([PLATFORM_REQUEST_ARMING, 0]))),
}
GIVE = {
    "emergency_stop": orders.emergency_stop,
    "watchdog": orders.feed_watchdog,
    "arm": lambda protocol: orders.arm(protocol, True),
    "disarm": lambda protocol: orders.arm(protocol, False),
}


@pytest.mark.parametrize("order", SENT)
def test_the_port_follows_the_firmware_and_both_are_served_when_it_is_not_known(order):
    new, old = SENT[order]
    assert [GIVE[order](protocol) for protocol in (4, 11, 12, 13)] == [(old,), (old,), (new,), (new,)]
    assert set(GIVE[order](orders.UNKNOWN)) == {new, old}


@pytest.mark.parametrize(("told", "expected"), [(12, 1), (9, 1), (orders.UNKNOWN, 2)])
def test_a_stop_goes_out_without_a_word_while_the_link_is_opened_again(monkeypatch, told, expected):
    drone, sent = Drone("cf1", "radio://0/80", SystemClock()), []
    platform = drone._crazyflie.platform
    monkeypatch.setattr(drone._crazyflie, "send_packet", lambda packet: sent.append(packet.port))
    monkeypatch.setattr(platform, "get_protocol_version", lambda: told)
    assert drone.protocol == told
    monkeypatch.setattr(platform, "get_protocol_version", lambda: orders.UNKNOWN)  # cflib, once it dials again
    drone.emergency_stop()
    drone.request_arming(False)
    assert len(sent) == 2 * expected
    assert (CRTPPort.SUPERVISOR in sent) == (told != 9)
