"""A real motion-capture system, through a library in a child process with a watchdog."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Mapping, Sequence

from mocap.child import serve
from mocap.clients import Report
from mocap.errors import MocapConnectError, MocapError, MocapLost, MocapUnavailable
from mocap.offset import ClockOffset
from mocap.source import MocapFrame, Pose
from mocap.systems import BODIES, Library


class SystemMocap:
    """Frames of a real system.

    Absence from a frame is the only sign of a lost body, and silence the only sign of a dead server: a server that says
    nothing for ``frame_timeout`` is given up.

    Args:
        system: the library's name of it: ``vicon``, ``optitrack``, ``qualisys``, ``vrpn``, …
        options: the library's settings, e.g. ``{"hostname": "192.168.0.10"}``.
        now: the flight clock's time [s]; frames are stamped with it.
        connect_timeout: [s] until the connection stands; the child process needs about 0.1 s of it to start.
        frame_timeout: longest silence [s].
        library: what to talk to it with.

    Raises:
        MocapUnavailable: the library is not installed.
        MocapConnectError: no connection, or not in time.
    """

    def __init__(
        self,
        system: str,
        options: Mapping[str, str],
        now: Callable[[], float],
        *,
        connect_timeout: float = 10.0,
        frame_timeout: float = 1.0,
        library: Library = BODIES,
    ) -> None:
        self._name = f"motion capture ({system})"
        self._offset, self._clock = now() - time.monotonic(), ClockOffset()
        self._frame_timeout = frame_timeout
        self._number = 0
        self._error: MocapError | None = None
        self._ending = ""  # what the child said last, if it has ended
        context = multiprocessing.get_context("spawn")  # a fork would inherit cflib's threads' locks
        self._pipe, theirs = context.Pipe(duplex=False)
        self._child = context.Process(
            target=serve, args=(theirs, library.client, system, dict(options)), name="mocap", daemon=True
        )
        self._child.start()
        theirs.close()  # so that the child's death ends the pipe
        self._await_connection(library, connect_timeout)
        self._heard = time.monotonic()

    def poll(self) -> Sequence[MocapFrame]:
        """Frames that arrived since the last call, oldest first; never blocks.

        Raises:
            MocapLost: the system fell silent, or the child process ended. Final: a new object is needed.
        """
        if self._error is not None:
            raise self._error
        frames: list[MocapFrame] = []
        try:
            while not self._ending and self._pipe.poll():
                kind, *what = self._pipe.recv()
                if kind == "frame":
                    frames.append(self._frame(*what))
                else:
                    self._ending = str(what[0])
        except (EOFError, OSError):
            self._ending = "the connection's process ended"
        if self._ending and not frames:  # what did arrive comes first, the bad news with the next call
            raise self._give_up(MocapLost(f"{self._name}: {self._ending}"))
        if frames:
            self._heard = time.monotonic()
        elif (silence := time.monotonic() - self._heard) > self._frame_timeout:
            raise self._give_up(MocapLost(f"{self._name}: no frame for {silence:.1f} s"))
        return frames

    def close(self) -> None:
        """End the child process, whatever it is doing."""
        self._give_up(MocapLost(f"{self._name}: closed"))

    def _await_connection(self, library: Library, timeout: float) -> None:
        try:
            if not self._pipe.poll(timeout):
                problem = f"{self._name}: no connection within {timeout:g} s; is the server on, and the address right?"
                raise self._give_up(MocapConnectError(problem))
            message = self._pipe.recv()
        except EOFError:
            raise self._give_up(MocapConnectError(f"{self._name}: the connection's process ended")) from None
        if message[0] == "failed":
            _, kind, text = message
            if kind == "unavailable":
                raise self._give_up(MocapUnavailable(f"{self._name}: {library.missing} ({text})"))
            raise self._give_up(MocapConnectError(f"{self._name}: {text}"))

    def _frame(self, arrival: float, report: Report) -> MocapFrame:
        self._number += 1
        measured = arrival if report.stamp is None else self._clock.to_local(report.stamp, arrival)
        bodies = {name: Pose(p, q) for name, (p, q) in report.bodies.items()}
        return MocapFrame(measured + self._offset, self._number, bodies, report.points)

    def _give_up(self, error: MocapError) -> MocapError:
        if self._error is None:
            self._error = error
            # kill, not terminate: a library that holds the interpreter's lock never sees a signal handler run.
            self._child.kill()
            self._child.join(timeout=5.0)
            self._pipe.close()
        return error
