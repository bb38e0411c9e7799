"""Keys during a flight: one key, one word of the operator's."""

from __future__ import annotations

import os
import select
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType

from deploy.operator import Word

# Stopping the motors takes two hands.
KEYS: Mapping[str, Word] = MappingProxyType({"l": "land", "h": "hold", "a": "abort", "X": "stop"})
_POLL = 0.1  # s


@contextmanager
def keys(say: Callable[[Word], None]) -> Iterator[bool]:
    """While inside, keys of :data:`KEYS` are words; yields whether there is a keyboard. Ctrl-C works as ever."""
    try:
        import termios
        import tty
    except ImportError:  # not on Windows
        yield False
        return
    if not sys.stdin.isatty():
        yield False
        return
    terminal = sys.stdin.fileno()
    before, over = termios.tcgetattr(terminal), threading.Event()

    def read() -> None:
        while not over.is_set():
            if not select.select([terminal], [], [], _POLL)[0]:
                continue
            pressed = os.read(terminal, 16)
            if not pressed:
                return  # the terminal is gone
            for word in (KEYS.get(chr(key)) for key in pressed):
                if word is not None:
                    say(word)

    tty.setcbreak(terminal)
    termios.tcflush(terminal, termios.TCIFLUSH)  # what was typed before the flight is no word
    reader = threading.Thread(target=read, name="keys", daemon=True)
    reader.start()
    try:
        yield True
    finally:
        over.set()
        reader.join(2.0 * _POLL)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)
