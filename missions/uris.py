"""Link URIs of cflib: what they look like, and when two of them mean the same drone."""

from __future__ import annotations

import re

from missions.records import did_you_mean

# The forms cflib 0.1 accepts (cflib/crtp/*driver.py), and our own sim://. Stricter where cflib guesses: it takes a
# missing channel for 2, an unknown rate for 2M, and fills a short address up with zeros.
_FORMS = {
    "radio": (
        r"(?:[0-9]{1,9}|[0-9A-Fa-f]{10,})/(?:12[0-5]|1[01][0-9]|[0-9]{1,2})/(?:250K|1M|2M)"
        r"(?:/[0-9A-Fa-f]{10})?(?:\?[A-Za-z0-9_=&.]+)?",
        "radio://0/80/2M/E7E7E7E701 (dongle, channel 0 to 125, rate 250K, 1M or 2M, address of 10 hexadecimal digits)",
    ),
    "usb": (r"[0-9]+", "usb://0"),
    "udp": (r"[^/\s:]+:[0-9]{1,5}", "udp://127.0.0.1:19850"),
    "tcp": (r"[^/\s:]+:[0-9]{1,5}", "tcp://192.168.4.1:5000"),
    "serial": (r"\S+", "serial://ttyAMA0"),
    "sim": (r"\S+", "sim://0/cf1"),
}


def check_uri(uri: str) -> str:
    """What is wrong with a link URI; empty if nothing is, or if there is none."""
    if not uri:
        return ""
    shown = repr(uri if len(uri) <= 60 else uri[:57] + "...")
    scheme, separator, rest = uri.partition("://")
    if not separator:
        hint = ""
        if address := re.fullmatch(r"(?:0x)?([0-9A-Fa-f]{10})", uri):
            hint = f" (for this address: radio://0/80/2M/{address[1].upper()})"
        return f"got {shown}; allowed: a link URI such as radio://0/80/2M/E7E7E7E701{hint}"
    if scheme not in _FORMS:
        return f"got {shown}; allowed: {', '.join(f'{name}://' for name in _FORMS)}{did_you_mean(scheme, _FORMS)}"
    form, example = _FORMS[scheme]
    return "" if re.fullmatch(form, rest) else f"got {shown}; allowed: {example}"


def same_drone(uri: str) -> str:
    """A key that is equal for URIs that reach the same drone: the dongle and link options do not matter."""
    if not uri.startswith("radio://"):
        return uri
    parts = uri.removeprefix("radio://").partition("?")[0].split("/")
    channel, rate = str(int(parts[1])), parts[2]
    address = parts[3].upper() if len(parts) > 3 else "E7E7E7E7E7"  # cflib's default address
    return f"radio {channel} {rate} {address}"
