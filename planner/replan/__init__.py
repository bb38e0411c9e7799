"""Plans that are changed while they are flown: another map, less time, what has been flown counts."""

from planner.replan.anew import planned_anew, replan
from planner.replan.consume import Sensing, consumed

__all__ = ["Sensing", "consumed", "planned_anew", "replan"]
