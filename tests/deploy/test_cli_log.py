"""``ergoflie log``: what is in a log, as tables, recovered, and laid out for viewers."""

import csv
import json
import sys

import numpy as np
import pytest
from mcap.reader import make_reader

from deploy.cli.__main__ import main
from deploy.errors import LogFileError
from deploy.flightlog.export import export
from deploy.flightlog.reader import read_log
from deploy.flightlog.recover import recover
from deploy.flightlog.topics import TOPICS, find_topic, markdown
from deploy.planfile import plan_bytes
from tests.deploy import synthetic_flight as synthetic


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    return path, synthetic.write_flight(path, synthetic.flight_plan(duration=6.0, robots=2))


@pytest.fixture(scope="module")
def cut(flight):
    path = flight[0].with_name("cut.mcap.part")
    data = flight[0].read_bytes()
    path.write_bytes(data[: int(0.8 * len(data))])
    return path


def test_info_lists_topics_attachments_and_what_is_missing(flight, cut, capsys):
    assert main(["log", "info", str(flight[0]), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["complete"]
    assert facts["robots"] == ["cf1", "cf2"]
    assert facts["topics"]["/cf1/pose"]["rate"] == pytest.approx(50.0)
    assert facts["attachments"]["plan.mcap"] == len(read_log(flight[0]).attachments["plan.mcap"])
    assert main(["log", "info", str(cut)]) == 0
    out = capsys.readouterr().out
    assert "not complete" in out
    assert "was not closed" in out
    assert "/cf2/battery" in out


def test_tables_hold_what_the_log_holds(flight, tmp_path, capsys):
    assert main(["log", "export", str(flight[0]), "-o", str(tmp_path), "--topics", "/cf1/*", "/events"]) == 0
    assert "cf1_pose.csv" in capsys.readouterr().out
    assert not (tmp_path / "cf2_pose.csv").exists()
    record = read_log(flight[0])
    with (tmp_path / "cf1_pose.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    pose = record.of("cf1", "pose")
    assert [float(row["t"]) for row in rows] == pose.t.tolist()
    found = [[float(row[f"position.{axis}"]) for axis in "xyz"] for row in rows]
    assert found == pose["position"].tolist()
    with (tmp_path / "events.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["name"] for row in rows] == [event.name for event in record.events]
    assert rows[1]["value"] == ""  # not known
    with (tmp_path / "cf1_supervisor.csv").open(newline="") as stream:
        assert json.loads(next(csv.DictReader(stream))["names"]) == ["can_fly"]


def test_parquet_holds_the_same(flight, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    ((path, rows),) = export(read_log(flight[0]), tmp_path, "parquet", ["/cf1/estimate"])
    table = parquet.read_table(path).to_pydict()
    estimate = read_log(flight[0]).of("cf1", "estimate")
    assert rows == len(estimate)
    np.testing.assert_array_equal(table["velocity.z"], estimate["velocity"][:, 2])


def test_export_says_what_is_wrong(flight, tmp_path, capsys, monkeypatch):
    log = str(flight[0])
    assert main(["log", "export", log, "-o", str(tmp_path), "--topics", "/cf9/*"]) == 2
    assert "no topic fits '/cf9/*'; topics: /cf1/battery" in capsys.readouterr().err
    (tmp_path / "file").touch()
    assert main(["log", "export", log, "-o", str(tmp_path / "file")]) == 2
    assert "cannot write the table" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert main(["log", "export", log, "-o", str(tmp_path), "--format", "parquet"]) == 2
    assert "pip install 'ergoflie[parquet]'" in capsys.readouterr().err


def test_a_recovered_log_is_whole_and_says_so(cut, tmp_path, capsys):
    target = tmp_path / "again.mcap"
    assert main(["log", "recover", str(cut), "-o", str(target)]) == 0
    assert "was not closed" in capsys.readouterr().out
    before, after = read_log(cut), read_log(target)
    assert after.series.keys() == before.series.keys()
    for name, series in before.series.items():
        np.testing.assert_array_equal(after.series[name].t, series.t)
    assert after.attachments == before.attachments
    assert after.metadata == before.metadata
    assert not after.complete
    assert after.problems[0].startswith("recovered from a damaged log: the file ends early")
    with target.open("rb") as stream:  # viewers read it by its indexes
        assert make_reader(stream, validate_crcs=True).get_summary().statistics.message_count > 100
    assert main(["log", "recover", str(cut), "-o", str(target)]) == 2
    assert "exists already" in capsys.readouterr().err


def test_a_damaged_chunk_stays_behind(flight, tmp_path):
    data = bytearray(flight[0].read_bytes())
    with flight[0].open("rb") as stream:
        chunk = make_reader(stream).get_summary().chunk_indexes[5]
    data[chunk.chunk_start_offset + 100] ^= 1
    (tmp_path / "hurt.mcap").write_bytes(data)
    recover(tmp_path / "hurt.mcap", tmp_path / "well.mcap")
    hurt, well = read_log(tmp_path / "hurt.mcap"), read_log(tmp_path / "well.mcap")
    assert len(well.of("cf1", "pose")) == len(hurt.of("cf1", "pose")) < len(read_log(flight[0]).of("cf1", "pose"))


def test_recover_says_what_is_wrong(flight, cut, tmp_path):
    with pytest.raises(LogFileError, match="nothing to recover"):
        recover(flight[0], tmp_path / "x.mcap")
    with pytest.raises(LogFileError, match="cannot write the recovered log"):
        recover(cut, tmp_path / "no" / "x.mcap")
    (tmp_path / "x").write_bytes(b"no log")
    with pytest.raises(LogFileError, match="not an MCAP file"):
        recover(tmp_path / "x", tmp_path / "y.mcap")


def test_a_layout_names_topics_that_there_are(flight, tmp_path, capsys):
    plan, path = tmp_path / "plan.mcap", tmp_path / "layout.json"
    plan.write_bytes(plan_bytes(flight[1]))
    for source in ([], [str(plan)], [str(flight[0])]):
        assert main(["log", "layout", *source, "-o", str(path)]) == 0
        found = json.loads(path.read_text())
        panels = found["configById"]
        named = set(panels["3D!scene"]["topics"]) | {panels["RosOut!log"]["topicToRender"]}
        for panel in panels.values():
            named |= {line["value"].partition(".")[0] for line in panel.get("paths", [])}
        for name in named:
            find_topic(name)

        def leaves(node):
            return {node} if isinstance(node, str) else leaves(node["first"]) | leaves(node["second"])

        assert leaves(found["layout"]) == set(panels)
    assert "/cf2/battery" in named
    assert "/cf3/battery" not in named
    plan.write_bytes(b"")
    assert main(["log", "layout", str(plan), "-o", str(path)]) == 2
    assert "not an MCAP file" in capsys.readouterr().err


def test_the_document_of_topics_is_the_table(capsys):
    from importlib.resources import files

    assert main(["log", "topics"]) == 0
    assert capsys.readouterr().out.strip() == markdown()
    text = files("deploy.flightlog").joinpath("TOPICS.md").read_text(encoding="utf-8")
    assert markdown() in text
    for topic in TOPICS:
        assert all((topic.pattern, topic.schema, topic.clock, topic.rate, topic.doc))
        assert topic.fields or topic.schema.startswith("foxglove.")
