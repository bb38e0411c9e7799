"""Pre-flight checks: each with a name, what was found, what is allowed and what to do about it; no I/O.

All drones are checked before anybody is told, and every failure is listed. :mod:`records` says what a check is,
:mod:`whole` checks plan, log and swarm, :mod:`drone` what is known of one drone on its pad.
"""

from deploy.preflight.drone import PASSING, SETTLED_DEVIATION, DroneFacts, check_drone, failed_before
from deploy.preflight.records import PreflightCheck, PreflightReport
from deploy.preflight.whole import check_left, check_limits, check_log, check_plan, check_same

__all__ = [
    "PASSING",
    "SETTLED_DEVIATION",
    "DroneFacts",
    "PreflightCheck",
    "PreflightReport",
    "check_drone",
    "check_left",
    "check_limits",
    "check_log",
    "check_plan",
    "check_same",
    "failed_before",
]
