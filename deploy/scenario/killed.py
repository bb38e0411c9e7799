"""The end of the host's process, as a rehearsal plays it."""

from __future__ import annotations

from deploy.errors import DeployError


class ProcessKilled(BaseException):
    """Ends the flight code wherever it is; like a real kill it is nobody's to handle, hence no ``Exception``.

    Attributes:
        watch: for how long the drones are watched then [s].
    """

    def __init__(self, watch: float) -> None:
        self.watch = watch
        super().__init__("the host's process was killed")


class HostDied(DeployError):
    """A rehearsal in which the host's process was killed.

    Attributes:
        t: when [s]. after: what every drone did then, one line each.
    """

    def __init__(self, t: float, after: tuple[str, ...]) -> None:
        self.t, self.after = t, after
        super().__init__(f"the host's process was killed at {t:.2f} s; {'; '.join(after)}")
