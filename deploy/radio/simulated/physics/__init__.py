"""The simulated world's physics: bodies, rotors, batteries, sensors, estimators and controllers of all drones at once.

One idea a file; :mod:`~deploy.radio.simulated.physics.world` puts them together. Nothing here knows packets or cflib.
"""
