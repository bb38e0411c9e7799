"""Plan files packed again after an edit, so that every checksum fits: only the certificate is left to notice."""

import dataclasses
import json

import pytest

from deploy.cli.__main__ import main
from deploy.errors import PlanFileError
from deploy.planfile import plan_bytes, read_plan, read_plan_bytes, write
from deploy.planfile.layout import dump, load
from planner.certificate.compare import differences
from tests.deploy.flight_bench import parsed, small_plan, small_text

FILES = {name: f"trajectories/{name}.0.bin" for name in ("cf1", "cf2")}


@pytest.fixture(scope="module")
def plan():
    return small_plan(parsed(small_text()))


@pytest.fixture
def packed(plan, monkeypatch):
    """How to pack the plan with its attachments edited; all hashes of the file are taken afterwards."""
    honest = write._attachments

    def pack(edit):
        def edited(flight_plan):
            files = honest(flight_plan)
            edit(files)
            return files

        with monkeypatch.context() as patch:
            patch.setattr(write, "_attachments", edited)
            return plan_bytes(plan)

    return pack


def refusal(data):
    with pytest.raises(PlanFileError) as caught:
        read_plan_bytes(data)
    line = str(caught.value)
    assert "\n" not in line
    return line


def change(file, edit):
    """Edit one JSON attachment."""

    def apply(files):
        value = json.loads(files[file])
        edit(value)
        files[file] = json.dumps(value).encode()

    return apply


def flipped(data, at):
    return data[:at] + bytes([data[at] ^ 0x10]) + data[at + 1 :]


def swap(files):
    files[FILES["cf1"]], files[FILES["cf2"]] = files[FILES["cf2"]], files[FILES["cf1"]]


def other_order(rows):
    rows.reverse()


def other_place(rows):
    rows[0]["legs"][0]["offset"] = 2048


def other_mission(files):
    files["mission.yaml"] = files["mission.yaml"].replace(b"separation: 0.3", b"separation: 0.2")


def other_move(passages):
    passages["approach"]["cf2"][0]["target"][0] += 0.1


def no_certificate(files):
    del files["certificate.json"]


def no_robot(values):
    values["trajectories_sha256"] = values["trajectories_sha256"][:1]


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (swap, "other trajectories"),
        (lambda files: files.update({FILES["cf1"]: files[FILES["cf1"]][:-1]}), "other trajectories"),
        (lambda files: files.update({FILES["cf1"]: b""}), "other trajectories"),
        (change("trajectories.json", other_order), "the mission has cf1, cf2"),
        (change("trajectories.json", other_place), "other trajectories"),
        (other_mission, "another mission"),
        (change("transfers.json", other_move), "moves"),
        (no_certificate, "certificate.json"),
        (change("certificate.json", no_robot), "other trajectories"),
        (change("certificate.json", lambda values: values.pop("checks")), "cannot be understood"),
        (change("certificate.json", lambda values: values.update(passed=True)), "cannot be understood"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_edit_is_refused_in_one_line(packed, edit, reason):
    assert reason in refusal(packed(edit))


@pytest.mark.parametrize("name", FILES)
def test_every_byte_of_a_trajectory_is_bound(plan, packed, name):
    size = len(plan.trajectories[name].legs[0].data)
    for at in range(0, size, 5):
        edited = packed(lambda files, at=at: files.update({FILES[name]: flipped(files[FILES[name]], at)}))
        assert "other trajectories" in refusal(edited)


def kinder(values):
    check = next(check for check in values["checks"] if check["name"] == "separation")
    check.update(value=check["value"] + 0.5)


def laxer(values):
    values["checks"][0].update(severity="warning", passed=False)


def shorter(values):
    values["checks"] = values["checks"][1:]


@pytest.mark.parametrize("edit", [kinder, laxer, shorter])
def test_an_edited_certificate_is_found_by_computing_it_again(packed, edit, tmp_path, capsys):
    path = tmp_path / "edited.mcap"
    path.write_bytes(packed(change("certificate.json", edit)))
    assert main(["check", str(path)]) == 1
    captured = capsys.readouterr()
    assert "does not follow from its bytes" in captured.err
    assert len(captured.err.splitlines()) == 1
    assert main(["check", str(path), "--json"]) == 1
    assert len(json.loads(capsys.readouterr().out)["differs_from_file"]) == 1


def test_check_prints_margins_and_exits_by_what_it_finds(plan, tmp_path, capsys):
    path = tmp_path / "plan.mcap"
    path.write_bytes(plan_bytes(plan))
    assert main(["check", str(path)]) == 0
    shown = capsys.readouterr().out
    assert all(word in shown for word in ("separation", "margin", "cf1–cf2", "PASS"))
    assert main(["check", str(path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["passed"]
    assert answer["failures"] == answer["differs_from_file"] == []
    separation = next(check for check in answer["checks"] if check["name"] == "separation")
    assert separation["margin"] == pytest.approx(separation["value"] - separation["limit"])
    path.write_bytes(plan_bytes(plan)[:-20])
    assert main(["check", str(path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_warnings_come_back_from_a_file_as_warnings(plan):
    first, *others = plan.certificate.checks
    advice = dataclasses.replace(first, severity="warning", passed=False)
    warned = dataclasses.replace(plan, certificate=dataclasses.replace(plan.certificate, checks=(advice, *others)))
    again = read_plan_bytes(plan_bytes(warned)).certificate
    assert again.warnings == (advice,)
    assert again.passed
    assert differences(again, warned.certificate) == ()


def test_the_repacking_itself_is_honest(packed, plan, tmp_path):
    assert packed(lambda files: None) == plan_bytes(plan)
    (tmp_path / "plan.mcap").write_bytes(packed(lambda files: None))
    assert plan_bytes(read_plan(tmp_path / "plan.mcap")) == plan_bytes(plan)
    assert load(dump({"a": 1.0})) == {"a": 1.0}
