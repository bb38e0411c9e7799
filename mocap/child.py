"""The child process that talks to a real motion-capture system, and what it says to its parent.

Some of the library's connections block for ever while holding the interpreter's lock (a dead Vicon or OptiTrack host):
no thread and no signal handler of the same process would run again. So the library lives here, and the parent, which
only reads a pipe, can always give up.

Messages, in this order: ``("connected",)`` or ``("failed", kind, text)``, then ``("frame", t, bodies)`` for ever, where
t is ``time.monotonic()``, which all processes of a machine share, and bodies is ``{name: (position, quaternion)}``.
"""

from __future__ import annotations

import importlib
import signal
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection


def serve(pipe: Connection, module: str, system: str, options: Mapping[str, str]) -> None:
    """Connect and send frames until the parent goes away.

    Args:
        pipe: to the parent.
        module: importable name of the library, with ``connect(type, options)``.
        system: the library's name of the system, e.g. ``vicon``.
        options: the library's settings, e.g. ``hostname``.
    """
    # Ctrl-C belongs to the flight: it needs poses while it lands. The parent ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        library = importlib.import_module(module)
    except ImportError as error:
        pipe.send(("failed", "unavailable", str(error)))
        return
    try:
        source = library.connect(system, dict(options))
    except (RuntimeError, ValueError, OSError) as error:
        pipe.send(("failed", "connect", str(error)))
        return
    pipe.send(("connected",))
    while True:
        source.waitForNextFrame()
        stamp = time.monotonic()
        bodies = {name: _pose(body) for name, body in source.rigidBodies.items()}
        try:
            pipe.send(("frame", stamp, bodies))
        except (BrokenPipeError, ConnectionResetError):
            return


def _pose(body: object) -> tuple[tuple[float, ...], tuple[float, ...]]:
    position = getattr(body, "position")  # noqa: B009  (an untyped library's object)
    q = getattr(body, "rotation")  # noqa: B009
    return tuple(map(float, position)), (float(q.x), float(q.y), float(q.z), float(q.w))
