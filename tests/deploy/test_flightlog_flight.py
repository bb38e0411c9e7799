"""A flight's log: every topic of the table, what is attached, the same bytes twice; a disk that fills up in flight."""

import json
import os
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader

from deploy.flight.journal import Journal
from deploy.flightlog import recorder
from deploy.flightlog.container import Contents
from deploy.flightlog.reader import read_log
from deploy.flightlog.topics import TOPICS, find_topic
from deploy.phases import Phase
from deploy.planfile import plan_bytes
from deploy.rehearsal import rehearse
from deploy.scenario.load import load_scenario
from planner.indicators import indicators
from tests.deploy.flight_bench import parsed, small_plan, small_text

MISSION = small_text(
    cf1=', uri: "radio://0/80/2M/E7E7E7E701"',
    more="""\
connectivity: {policy: probabilistic, range: 1.2, sub_periods: 1, threshold: 0.01}
obstacles: [{type: circle, center: [2.2, 1.7], radius: 0.1}]
zones: [{type: keep_out, vertices: [[0.0, 1.8], [0.2, 1.8], [0.2, 2.0]]}]
""",
)
SCENARIO = "name: nothing much\nevents:\n  - {fault: slow_link, at: 1.0, to: cf1, latency: 0.02, duration: 0.5}\n"
MARKERS = {"/mocap/points"}  # in flights with unlabelled markers only
LIGHTS = {"/{robot}/light"}  # of robots with an LED ring and a footprint, see test_flight_lights.py


@pytest.fixture(scope="module")
def plan():
    return small_plan(parsed(MISSION))


@pytest.fixture(scope="module")
def flown(plan, tmp_path_factory):
    """Outcome, log, and what was tapped, of the same flight twice."""
    folder = tmp_path_factory.mktemp("flights")
    (folder / "faults.yaml").write_text(SCENARIO)
    scenario = load_scenario(folder / "faults.yaml", plan.mission)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        flights = []
        for number in range(2):
            tapped = []
            outcome, path = rehearse(
                plan,
                log_path=folder / f"{number}.mcap",
                scenario=scenario,
                tap=lambda time, topic, data, tapped=tapped: tapped.append((time, topic, data)),
            )
            flights.append((outcome, path, tapped))
    return flights


def messages(path):
    with path.open("rb") as stream:
        return [(s, c, m) for s, c, m in make_reader(stream, validate_crcs=True).iter_messages()]


def test_two_rehearsals_write_the_same_log(flown):
    (outcome, path, _), (_, again, _) = flown
    assert outcome.completed, outcome
    assert path.read_bytes() == again.read_bytes()


def test_the_table_holds_what_flights_and_plans_hold(flown, plan):
    seen = {find_topic(c.topic)[0].pattern for _, c, _ in messages(flown[0][1])}
    seen |= {find_topic(name)[0].pattern for name in Contents(plan_bytes(plan)).messages}
    assert seen == {topic.pattern for topic in TOPICS} - MARKERS - LIGHTS


def test_every_record_fits_its_schema_and_is_told_to_who_listens(flown):
    _, path, tapped = flown[0]
    written = messages(path)
    checks = {}
    for schema, _, message in written:
        if schema.name not in checks:
            checks[schema.name] = jsonschema.Draft202012Validator(json.loads(schema.data))
        checks[schema.name].validate(json.loads(message.data))
    assert len(tapped) == len(written)
    assert sorted((m.log_time, c.topic) for _, c, m in written) == sorted(item[:2] for item in tapped)


def test_one_file_tells_the_whole_story(flown, plan):
    record = read_log(flown[0][1])
    assert set(record.attachments) == {
        "plan.mcap",
        "mission.yaml",
        "certificate.json",
        "fleet.json",
        "scenario.yaml",
    }
    assert record.attachments["mission.yaml"].decode() == MISSION
    assert record.attachments["scenario.yaml"].decode() == SCENARIO
    fleet = json.loads(record.attachments["fleet.json"])
    assert [item["robot"] for item in fleet] == ["cf1", "cf2"]
    assert fleet[0]["uri"].startswith("sim://")
    # Nothing of the computer it was made on.
    host = os.uname().nodename.encode()
    everything = b"".join(record.attachments.values()) + repr(dict(record.metadata)).encode()
    assert os.getcwd().encode() not in everything
    assert len(host) < 5 or host not in everything


def test_the_scene_shows_mission_drones_and_links(flown):
    newest = {c.topic: json.loads(m.data) for _, c, m in messages(flown[0][1])}
    entities = {entity["id"]: entity for entity in newest["/scene/mission"]["entities"]}
    assert set(entities) == {"workspace", "obstacle 0", "zone 0", "path cf1", "path cf2"}
    assert len(entities["path cf1"]["lines"][0]["points"]) == 16
    triangles = entities["obstacle 0"]["triangles"][0]
    assert max(triangles["indices"]) == len(triangles["points"]) - 1
    drones = newest["/scene/drones"]["entities"]
    assert [(entity["frame_id"], entity["texts"][0]["text"]) for entity in drones] == [("cf1",) * 2, ("cf2",) * 2]
    assert {item["child_frame_id"] for item in newest["/tf"]["transforms"]} == {"cf1", "cf2"}
    grid = newest["/map"]
    assert grid["column_count"] * grid["cell_size"]["x"] == pytest.approx(2.5)
    links = [
        json.loads(m.data)["entities"][0]["lines"][0] for _, c, m in messages(flown[0][1]) if c.topic == "/scene/links"
    ]
    assert max(len(line["points"]) for line in links) == 2  # one pair, in the air
    assert links[0]["points"] == []  # on the ground nobody searches


def test_ergodicity_so_far_ends_where_the_indicators_do(flown, plan):
    record = read_log(flown[0][1])
    series = record.series["/ergodicity"]
    start = next(event.t for event in record.events if event.name == "mission_start")
    assert series.t[0] >= start
    assert (series["certified"] == plan.certificate.indicators.ergodicity).all()
    t = np.arange(0.0, 3.0, 0.1)
    q = np.stack(
        [
            np.stack([np.interp(start + t, pose.t, pose["position"][:, axis]) for axis in range(2)], axis=1)
            for pose in (record.of(name, "pose") for name in ("cf1", "cf2"))
        ],
        axis=1,
    )
    assert series["value"][-1] == pytest.approx(indicators(plan.mission, t, q).ergodicity, rel=0.15)


def test_a_disk_that_fills_up_in_flight_is_said_and_the_flight_goes_on(plan, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    chunk = recorder.McapFile.chunk

    def full(file, found):
        if any(b'"mission_start"' in data for _, _, data in found):
            raise OSError(28, "No space left on device")
        chunk(file, found)

    monkeypatch.setattr(recorder.McapFile, "chunk", full)
    outcome, path = rehearse(plan, log_path=tmp_path / "flight.mcap")
    assert outcome.phase is Phase.LANDED
    assert all(outcome.landed.values())
    assert outcome.warnings.count("the flight log cannot be written any more: No space left on device") == 1
    assert path == tmp_path / "flight.mcap.part"
    assert not read_log(path).complete


def test_records_that_are_lost_are_said_once_each():
    log = SimpleNamespace(dropped=0, failure="", event=lambda *args, **kwargs: None)
    journal = Journal(log, 10.0)
    for dropped, failure in ((0, ""), (5, ""), (5, ""), (9, ""), (20, "disk gone"), (30, "disk gone")):
        log.dropped, log.failure = dropped, failure
        journal.log_state(1.0, Phase.ON_MISSION)
    assert journal.warnings == [
        "the flight log has lost 5 records: the disk cannot keep up",
        "the flight log has lost 9 records: the disk cannot keep up",
        "the flight log cannot be written any more: disk gone",
    ]
