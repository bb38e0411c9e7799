"""Models of motion behind one seam: controls in, motion out, and the transpose of that map.

All robots roll out at once. Axis order is time, robot, axis everywhere. The CasADi model is not imported here: it needs
an optional package.
"""

from planner.dynamics.base import Cotangent, Dynamics, Linearisation, Motion, StateGradient
from planner.dynamics.double_integrator import DoubleIntegrator
from planner.dynamics.single_integrator import SingleIntegrator

__all__ = ["Cotangent", "DoubleIntegrator", "Dynamics", "Linearisation", "Motion", "SingleIntegrator", "StateGradient"]
