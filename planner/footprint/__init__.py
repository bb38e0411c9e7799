"""What a sensor sees of the plane the information lives on, and the ergodic metric of that (FEO).

A footprint is a density over the workspace's plane that goes with a robot's position: its statistics, not the
position's, are compared with the information map. One idea a file:

* :mod:`~planner.footprint.base`: what a footprint is to the metric.
* :mod:`~planner.footprint.point`, :mod:`~planner.footprint.disc`, :mod:`~planner.footprint.window`: in closed form.
* :mod:`~planner.footprint.outline`, :mod:`~planner.footprint.polar`: any outline, clipped at the workspace's edge, by
  quadrature.
* :mod:`~planner.footprint.lattice`: the paper's samples.
* :mod:`~planner.footprint.metric`: the footprint ergodic metric.

"FEO": Zheng et al., Ergodic Trajectory Planning with Dynamic Sensor Footprints.
"""
