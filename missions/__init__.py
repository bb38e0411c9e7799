"""What to fly: mission files and the records they are parsed into."""

from missions.airframes import Airframe, airframe, airframe_names
from missions.errors import MissionError
from missions.jsonschema import json_schema
from missions.loader import load_mission, parse_mission
from missions.schema import Mission

__all__ = [
    "Airframe",
    "Mission",
    "MissionError",
    "airframe",
    "airframe_names",
    "json_schema",
    "load_mission",
    "parse_mission",
]
