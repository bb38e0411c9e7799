"""Several information maps at once: plans that trade one map's ergodicity for another's, and the front they form.

As a library, from a mission with several maps to a certified plan of a person's choice::

    from missions import load_mission
    from planner.pareto.explore import explore
    from planner.pareto.front import FrontSettings
    from planner.pareto.pick import flight_plan_of

    front = explore(load_mission("missions/examples/two_maps.yaml"), FrontSettings("a-sles", step=0.2))
    print(front.names, front.vectors[list(front.best)], front.hypervolume)
    flight = flight_plan_of(front, "compromise")    # or an index, or a map's name

=================  ================================================================================================
dominance          who is better than whom
hypervolume        how much of the box below a reference a set of vectors dominates, exactly
simplex            weights: grids, A-SLES's lattice, SLES's order
ideal              the front that no plan is below; where a front is thin
front, episodes,   fronts of missions: swarms with every constraint, in processes, kept on disk
work, explore,
store, file, pick
genetic            NSGA-II, the baseline
drive, minimise,   the published problem: one differential-drive robot, all weights in one vectorised search, or one
exchange,          after the other
sequence
=================  ================================================================================================
"""
