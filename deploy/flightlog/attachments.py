"""What is embedded in a flight log, so that one file tells the whole story.

==================  ============================================================================
attachment          content
==================  ============================================================================
``plan.mcap``       the plan file: what was flown, and all that is needed to check it again
``mission.yaml``    the mission file's text, to be read without tools of ours
``certificate.json``  what was checked of which bytes
``fleet.json``      who flew: robot, link URI, rigid body, airframe
``scenario.yaml``   what was to go wrong; in rehearsals with a scenario only
==================  ============================================================================
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping

from deploy.flightlog.reader import PLAN
from deploy.planfile import plan_bytes
from deploy.planfile.layout import dump
from planner.flightplan import FlightPlan

MISSION, CERTIFICATE, FLEET, SCENARIO = "mission.yaml", "certificate.json", "fleet.json", "scenario.yaml"


def attachments(flight_plan: FlightPlan, uris: Mapping[str, str], scenario: str = "") -> dict[str, bytes]:
    """Attachments of a flight's log, by name; nothing in them is about the computer that flies.

    Args:
        flight_plan: what is flown.
        uris: link URI by robot.
        scenario: text of the scenario file; empty if there is none.

    Raises:
        PlanFileError: the mission has no source text.
    """
    mission = flight_plan.mission
    fleet = [
        {
            "robot": robot.name,
            "uri": uris.get(robot.name, ""),
            "rigid_body": robot.rigid_body or robot.name,
            "airframe": mission.flight.airframe,
        }
        for robot in mission.robots
    ]
    out = {
        PLAN: plan_bytes(flight_plan),
        CERTIFICATE: dump(dataclasses.asdict(flight_plan.certificate)),
        FLEET: json.dumps(fleet, indent=1).encode(),
    }
    if mission.source is not None:
        out[MISSION] = mission.source.text.encode()
    return out | ({SCENARIO: scenario.encode()} if scenario else {})
