"""The child process that talks to a real motion-capture system, and what it says to its parent.

Some of the libraries' connections block for ever while holding the interpreter's lock (a dead Vicon or OptiTrack host):
no thread and no signal handler of the same process would run again. So the libraries live here, and the parent, which
only reads a pipe, can always give up.

Messages, in this order: ``("connected",)`` or ``("failed", kind, text)``, then ``("frame", t, report)`` for ever, where
t is ``time.monotonic()``, which all processes of a machine share, and at last perhaps ``("ended", text)``.
"""

from __future__ import annotations

import contextlib
import importlib
import signal
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection

from mocap.clients import Client


def serve(pipe: Connection, client: str, system: str, options: Mapping[str, str]) -> None:
    """Connect and send frames until the parent goes away.

    Args:
        pipe: to the parent.
        client: importable name of a module of ``mocap.clients``, or one like them.
        system: the library's name of the system, e.g. ``vicon``.
        options: the library's settings, e.g. ``hostname``.
    """
    # Ctrl-C belongs to the flight: it needs poses while it lands. The parent ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        source: Client = importlib.import_module(client).connect(system, options)
    except ImportError as error:
        pipe.send(("failed", "unavailable", str(error)))
        return
    except (RuntimeError, ValueError, OSError) as error:
        pipe.send(("failed", "connect", str(error)))
        return
    with contextlib.closing(source), contextlib.suppress(BrokenPipeError, ConnectionResetError):
        pipe.send(("connected",))
        while True:
            try:
                report = source.wait()
            except (RuntimeError, ValueError, OSError) as error:
                pipe.send(("ended", str(error)))
                return
            pipe.send(("frame", time.monotonic(), report))
