"""The JSON Schema of scenario files, generated from the records like that of missions."""

from __future__ import annotations

from deploy.scenario.records import HAPPENINGS, PHASES, Scenario
from missions.jsonschema import JsonSchema, schema_of


def json_schema() -> JsonSchema:
    """JSON Schema (draft 2020-12) of a scenario file; whether its robots are in a mission, it cannot know."""
    return schema_of(Scenario, "ergoflie scenario", choices={"when": (*PHASES, *HAPPENINGS)}, either=("at", "when"))
