"""Which motion-capture systems there are, what hands over what of them, and how to get it."""

from __future__ import annotations

from dataclasses import dataclass

from mocap.errors import MocapUnavailable


@dataclass(frozen=True)
class Library:
    """What talks to a system.

    Attributes:
        client: importable name of a module of ``mocap.clients``, or one like them.
        package: what it needs. extra: the extra of ergoflie that installs that.
    """

    client: str
    package: str
    extra: str

    @property
    def missing(self) -> str:
        """What to do if it cannot be imported."""
        return f"the {self.package} package is not installed: pip install 'ergoflie[{self.extra}]'"


BODIES = Library("mocap.clients.libmotioncapture", "motioncapture", "mocap")
WITH_BODIES = ("vicon", "optitrack", "qualisys", "vrpn")
WITH_MARKERS = {
    "optitrack": Library("mocap.clients.optitrack", "natnet", "optitrack"),
    "qualisys": Library("mocap.clients.qualisys", "qtm-rt", "qualisys"),
}
# libmotioncapture knows these, its wheel does not: it says "Unknown motion capture type!" of them.
_BUILT_FROM_SOURCE = ("nokov", "fzmotion", "motionanalysis", "optitrack_closed_source")


def library_for(system: str, tracking: str) -> Library:
    """What talks to a system when robots are tracked in a mission's way.

    Raises:
        MocapUnavailable: nothing does.
    """
    if tracking == "markers":
        if system in WITH_MARKERS:
            return WITH_MARKERS[system]
        known = ", ".join(WITH_MARKERS)
        raise MocapUnavailable(
            f"motion capture ({system}): nothing hands over its unlabelled markers; allowed with "
            f"'motion_capture.tracking: markers': {known}; with the others, define a rigid body for each robot"
        )
    if system in WITH_BODIES or system in _BUILT_FROM_SOURCE or system == "mock":
        return BODIES
    raise MocapUnavailable(
        f"motion capture: got {system[:60]!r}; allowed: {', '.join(WITH_BODIES)}; with a motioncapture package of your "
        f"own build (github.com/IMRCLab/libmotioncapture): {', '.join(_BUILT_FROM_SOURCE)}"
    )
