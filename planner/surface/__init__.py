"""What cameras see of an object's surface, and the ergodic metric of that (FEO, IV-D).

A look from somewhere is a density over the surface: what each point of it takes up in the picture. It depends on where
the robot is only, because it faces the object, so looks are worked out once, at viewpoints all over the workspace, by
casting rays; in between they are blended. One idea a file:

* :mod:`~planner.surface.rays`: what is seen from where, past what is in front of it.
* :mod:`~planner.surface.camera`: how much of the picture a point takes up.
* :mod:`~planner.surface.views`: looks from all over the workspace, and from anywhere in between.
* :mod:`~planner.surface.metric`: the ergodic metric of them.
* :mod:`~planner.surface.mission`: of a mission.
* :mod:`~planner.surface.seen`: what robots have seen at the end.

"FEO": Zheng et al., Ergodic Trajectory Planning with Dynamic Sensor Footprints.
"""
