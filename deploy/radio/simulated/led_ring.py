"""An LED ring: what it shines like, by its parameters (firmware ledring12.c).

Effects 0 (dark), 7 (one colour) and 14 (fade to a colour within ``fadeTime``) are modelled: all LEDs are alike in
them. The firmware redraws the ring 20 times a second, here it fades without steps. Other effects stay dark.
"""

from __future__ import annotations

from deploy.radio.simulated.parameters import Parameters

Colour = tuple[float, float, float]
_SOLID, _FADE = 7, 14
_WHITE: Colour = (255.0, 255.0, 255.0)  # what the first fade begins with


class LedRing:
    """The ring of one drone.

    Args:
        parameters: of the drone, ``ring.*`` among them.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._from = self._to = _WHITE
        self._began, self._lasts, self._told = 0.0, 0.0, -1.0

    def run(self, uptime: float) -> Colour:
        """Take in what the parameters say at ``uptime`` [s]; the colour then, red, green, blue up to 255 each."""
        effect, told = self._parameters.get("ring.effect", 0.0), self._parameters.get("ring.fadeColor", 0.0)
        if effect == _SOLID:
            red, green, blue = (self._parameters[f"ring.solid{name}"] for name in ("Red", "Green", "Blue"))
            return red, green, blue
        if effect != _FADE:
            return 0.0, 0.0, 0.0
        if told != self._told:
            self._from, self._to, self._told = self._faded(uptime), _rgb(int(told)), told
            self._began, self._lasts = uptime, self._parameters.get("ring.fadeTime", 0.5)
        return self._faded(uptime)

    def _faded(self, uptime: float) -> Colour:
        share = 1.0 if self._lasts <= 0.0 else min((uptime - self._began) / self._lasts, 1.0)
        red, green, blue = (a + share * (b - a) for a, b in zip(self._from, self._to, strict=True))
        return red, green, blue


def _rgb(packed: int) -> Colour:
    return float(packed >> 16 & 0xFF), float(packed >> 8 & 0xFF), float(packed & 0xFF)
