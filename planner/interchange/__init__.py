"""Flights planned elsewhere: trajectories and waypoints of others become certified plans, without a solver."""
