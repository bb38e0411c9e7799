"""The operator's words: over a socket of this computer, and from the keyboard."""

import os
import pty
import socket
import sys
import time

import pytest

from deploy.cli.__main__ import main
from deploy.cli.keys import KEYS, keys
from deploy.control import HOST, WORDS, listening, tell, tell_map
from deploy.errors import DeployError
from deploy.operator import Interrupts


class Heard(list):
    say = list.append


@pytest.mark.parametrize("word", WORDS)
def test_words_are_heard_and_answered(word, capsys):
    heard = Heard()
    with listening(0, heard) as port:
        assert tell(port, word) == f"ok: {word}"
        assert main(["control", word, "--port", str(port)]) == 0
    assert heard == [word, word]
    assert capsys.readouterr().out == f"ok: {word}\n"


@pytest.mark.parametrize(
    "line", ["land\n", "ergoflie fly\n", "POST / HTTP/1.1\r\n", "ergoflie land now\n", "x" * 300, ""]
)
def test_whatever_else_arrives_is_nobodys_word(line):
    heard = Heard()
    with listening(0, heard) as port:
        with socket.create_connection((HOST, port), timeout=5.0) as link:
            link.sendall(line.encode())
            link.shutdown(socket.SHUT_WR)
            answer = link.recv(500)
        assert answer.startswith(b"not understood; allowed: ergoflie land, ")
        assert tell(port, "land") == "ok: land"  # and the next one is heard
    assert heard == ["land"]


def test_only_this_computer_is_heard():
    assert HOST == "127.0.0.1"


def test_a_port_that_is_taken_and_one_where_nobody_listens(capsys):
    with listening(0, Heard()) as port:
        second = listening(port, Heard())
        with pytest.raises(DeployError, match=f"control port {port}: .*choose another with --control"):
            second.__enter__()
    assert main(["control", "land", "--port", str(port)]) == 2
    assert capsys.readouterr().err.startswith(f"ergoflie: no flight listens at port {port}")


def test_what_the_words_ask_for():
    asked = {}
    for word in WORDS:
        operator = Interrupts()
        operator.say(word)
        operator.say(word)
        asked[word] = [
            operator.land_requested(),
            operator.hold_requested(),
            operator.return_requested(),
            operator.stop_requested(),
        ]
    assert asked == {
        "land": [True, False, False, False],  # twice is no stop: somebody only wants to be sure
        "hold": [False, True, False, False],
        "abort": [False, False, True, False],
        "stop": [False, False, False, True],
    }


def test_keys_are_words_while_a_flight_is_watched(monkeypatch):
    ours, theirs = pty.openpty()
    heard = []
    with open(theirs, closefd=False) as keyboard:
        monkeypatch.setattr(sys, "stdin", keyboard)
        os.write(ours, b"l")  # before the flight: nobody's word
        with keys(heard.append) as there:
            assert there
            for key in "zhaX":
                os.write(ours, key.encode())
            deadline = time.monotonic() + 5.0
            while len(heard) < 3 and time.monotonic() < deadline:
                os.sched_yield()
    os.close(ours)
    os.close(theirs)
    assert heard == [KEYS["h"], KEYS["a"], KEYS["X"]]


def test_without_a_keyboard_there_are_no_keys(monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with keys(lambda word: pytest.fail("a word")) as there:
            assert not there


def test_a_map_is_told_once_and_the_last_one_counts(tmp_path, capsys):
    operator, file = Interrupts(), tmp_path / "map.yaml"
    file.write_text("type: gaussians\ncomponents:\n  - {mean: [1.0, 0.5], covariance: 0.1}\n")
    with listening(0, operator) as port:
        assert tell_map(port, "{type: uniform}") == "ok: map"
        assert main(["control", "map", "--file", str(file), "--port", str(port)]) == 0
    assert operator.new_map() == '{"type": "gaussians", "components": [{"mean": [1.0, 0.5], "covariance": 0.1}]}'
    assert operator.new_map() is None
    assert not operator.land_requested()
    assert main(["control", "map", "--port", str(port)]) == 2
    assert main(["control", "land", "--file", str(file), "--port", str(port)]) == 2
    assert "a map needs --file MAP" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["{type: uniform,\n}", "x" * 60_000])
def test_maps_that_are_no_line_are_not_told(text):
    with pytest.raises(DeployError, match="allowed: one line"):
        tell_map(1, text)
