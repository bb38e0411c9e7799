"""What happens when something goes wrong: who may be left behind, and what each finding of the watch leads to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from missions.fields import field

Policy = Literal["hold", "return", "land_here", "land_all", "stop_motors"]


@dataclass(frozen=True)
class Safety:
    """What happens when something goes wrong, on the ground and in flight."""

    min_robots: int | None = field(
        "fewest robots that fly when others fail before take-off, if the certificate of the others still holds "
        "without them; default: nobody is left behind",
        at_least=1,
        at_most=100,
        default=None,
    )
    retries: int = field(
        "how often a robot that fails before take-off is tried again", at_least=0, at_most=10, default=2
    )
    retry_pause: float = field(
        "pause before the first retry; each further one takes twice as long",
        unit="s",
        at_least=0.1,
        at_most=60.0,
        default=1.0,
    )
    on_host_loss: Literal["continue", "motor_stop"] = field(
        "when the drones no longer hear of this computer: they finish what they were told and hover, or the firmware "
        "stops their motors after a second, in whatever height",
        default="continue",
    )
    hold_time: float = field(
        "longest hover of the policy 'hold' before everybody lands", unit="s", above=0.0, at_most=300.0, default=20.0
    )
    link: Policy = field("a lost link, or a robot that is silent for 2 s", default="land_all")
    supervisor: Policy = field("a robot that tumbled, is locked, crashed or may not fly", default="land_all")
    pose: Policy = field("a robot that nobody has seen for 1 s", default="land_all")
    identity: Policy | Literal["go_on"] = field(
        "motion capture took robots for each other; they are told their own poses all the same, by how they move",
        default="land_all",
    )
    tracking: Policy = field("a robot farther than flight.tracking_limit from its trajectory", default="land_all")
    separation: Policy = field("two robots that are, or are about to be, too close", default="land_all")
    geofence: Policy = field("a robot outside the geofence, or one that cannot stop inside", default="land_all")
    battery: Policy = field("a robot whose battery is low", default="land_all")
    tilt: Policy = field("a robot that tilts farther than tilt_limit", default="land_all")
    tilt_limit: float = field("largest tilt from the vertical", unit="rad", above=0.0, below=1.5, default=0.9)
    battery_limit: float = field(
        "least battery voltage in flight; the firmware itself warns at 3.2 V",
        unit="V",
        at_least=2.5,
        at_most=4.2,
        default=2.8,
    )
