"""Everything around the search: the way to it and back, heights, durations, on-board settings, rates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from missions.fields import field
from missions.mappings import FrozenMapping


@dataclass(frozen=True)
class Flight:
    """Everything around the search: the way to it and back, heights, durations, on-board settings, rates."""

    altitude: float = field(
        "height of the search above the floor (2-D workspaces)",
        unit="m",
        above=0.0,
        at_most=10.0,
        default=0.6,
    )
    assignment: Literal["fixed", "cheapest"] = field(
        "who flies from which start: as the robots are listed, or the cheapest safe way from the pads to the starts, "
        "among robots that may do the same",
        default="fixed",
    )
    return_to: Literal["pads", "none"] = field(
        "where everybody lands after the search: back on the pads, or where the search ended", default="pads"
    )
    takeoff_duration: float = field("time to climb to the altitude", unit="s", at_least=0.5, at_most=30.0, default=3.0)
    landing_duration: float = field("time to descend to the floor", unit="s", at_least=0.5, at_most=30.0, default=3.0)
    transfer_speed: float = field(
        "mean speed of moves to the start points and back; a move's peak is 2.2 times as fast",
        unit="m/s",
        above=0.0,
        at_most=3.0,
        default=0.3,
    )
    settle_time: float = field(
        "hover before the search starts and after it", unit="s", at_least=0.0, at_most=60.0, default=2.0
    )
    airframe: str = field("an airframe of airframes.yaml", default="cf21")
    controller: Literal["pid", "mellinger"] = field("on-board controller", default="mellinger")
    pose_rate: float = field("external poses sent to each drone", unit="Hz", at_least=5.0, at_most=200.0, default=50.0)
    log_rate: float = field("rate of the drones' own telemetry", unit="Hz", at_least=1.0, at_most=100.0, default=10.0)
    battery_minimum: float = field(
        "least battery voltage for take-off", unit="V", at_least=2.8, at_most=4.3, default=3.7
    )
    geofence_margin: float = field(
        "how far outside the workspace a drone may be before all land",
        unit="m",
        at_least=0.05,
        at_most=10.0,
        default=0.3,
    )
    tracking_limit: float = field("tracking error at which all land", unit="m", above=0.0, at_most=5.0, default=0.3)
    parameters: Mapping[str, float] = field(
        "further on-board parameters to set, 'group.name: value'", default=FrozenMapping()
    )
