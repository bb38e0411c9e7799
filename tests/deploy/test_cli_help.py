"""``--help`` is there for everything, says what it does, and states the defaults that are used."""

import argparse
import re

import pytest

from deploy.cli.__main__ import main, parser


def commands(top, path=()):
    """Every parser below, with the words that lead to it."""
    yield path, top
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, sub in action.choices.items():
                yield from commands(sub, (*path, name))


ALL = list(commands(parser()))


@pytest.mark.parametrize("path", [path for path, _ in ALL], ids=" ".join)
def test_help_is_printed(path, capsys):
    with pytest.raises(SystemExit) as ended:
        main([*path, "--help"])
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(" ".join(["usage: ergoflie", *path]))


@pytest.mark.parametrize("top", [top for _, top in ALL], ids=[" ".join(path) for path, _ in ALL])
def test_everything_is_explained_and_defaults_are_true(top):
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            assert all(choice.help for choice in action._choices_actions)
            continue
        assert action.help, action
        stated = re.search(r"\[default: ([^]]*)\]", action.help)
        if stated and action.default is not None:
            assert str(action.default) == stated[1], action.help


@pytest.mark.parametrize("argv", [[], ["import"], ["nix"], ["plan"], ["import", "waypoints", "m.yaml", "-o", "x"]])
def test_words_that_are_no_command(argv, capsys):
    with pytest.raises(SystemExit) as ended:
        main(argv)
    assert ended.value.code == 2
    assert "usage: ergoflie" in capsys.readouterr().err
