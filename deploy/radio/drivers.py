"""cflib's drivers, set up once."""

from __future__ import annotations

import cflib.crtp
from cflib.crtp.udpdriver import UdpDriver

from deploy.errors import LinkError

NO_DONGLE = "no Crazyradio found: plug one in, and check that this user may open it (udev rules on Linux)"


def initialise() -> None:
    """Register cflib's own drivers (radio, USB, UDP, …); calling it again changes nothing."""
    if UdpDriver not in cflib.crtp.CLASSES:
        cflib.crtp.init_drivers()


def require_crazyradio() -> None:
    """Raise LinkError with one clear line when no Crazyradio can be opened."""
    from cflib.drivers.crazyradio import get_serials

    try:
        serials = get_serials()
    except Exception as error:  # pyusb back-ends raise whatever they like; the answer is the same
        raise LinkError(f"{NO_DONGLE} ({error})") from error
    if not serials:
        raise LinkError(NO_DONGLE)
