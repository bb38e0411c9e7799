"""The firmware supervisor's state word, decoded (supervisor.h; also the log variable supervisor.info)."""

from __future__ import annotations

from dataclasses import dataclass

BITS = (
    "can be armed",
    "armed",
    "auto-armed",
    "can fly",
    "flying",
    "tumbled",
    "locked",
    "crashed",
    "high-level commander active",
    "high-level trajectory finished",
    "high-level commander disabled",
    "deck fault",
)


@dataclass(frozen=True)
class Supervisor:
    """State word of one drone.

    Attributes:
        bits: the word as the firmware sent it.
    """

    bits: int

    def _bit(self, number: int) -> bool:
        return bool(self.bits >> number & 1)

    @property
    def armed(self) -> bool:
        """The motors may turn."""
        return self._bit(1)

    @property
    def arms_itself(self) -> bool:
        """The drone needs no arming request."""
        return self._bit(2)

    @property
    def can_fly(self) -> bool:
        """The high-level commander takes commands."""
        return self._bit(3)

    @property
    def flying(self) -> bool:
        """The motors were above idle within the last two seconds."""
        return self._bit(4)

    @property
    def tumbled(self) -> bool:
        """Lies on its side or back."""
        return self._bit(5)

    @property
    def locked(self) -> bool:
        """Refuses everything until it is restarted."""
        return self._bit(6)

    @property
    def crashed(self) -> bool:
        """Tumbled in flight; needs a recovery request, upright."""
        return self._bit(7)

    @property
    def planner_active(self) -> bool:
        """The high-level commander steers."""
        return self._bit(8)

    @property
    def trajectory_finished(self) -> bool:
        """The high-level commander's last manoeuvre is over (it hovers or is idle)."""
        return self._bit(9)

    @property
    def manoeuvring(self) -> bool:
        """The high-level commander steers, and what it flies is not over yet."""
        return self.planner_active and not self.trajectory_finished

    @property
    def ready(self) -> bool:
        """Armed, able to fly, nothing wrong: on the ground 0x020E."""
        return self.armed and self.can_fly and not self.fault

    @property
    def fault(self) -> str:
        """What keeps this drone from flying for good; empty if nothing does."""
        return ", ".join(BITS[bit] for bit in (5, 6, 7, 11) if self._bit(bit))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the bits that are set."""
        return tuple(name for bit, name in enumerate(BITS) if self._bit(bit))

    @property
    def word(self) -> str:
        """The state in a word or two, for a person in a hurry."""
        return self.fault or ("flying" if self.flying else "ready" if self.ready else "on the ground")

    def __str__(self) -> str:
        return f"0x{self.bits:04X} ({', '.join(self.names) or 'nothing'})"
