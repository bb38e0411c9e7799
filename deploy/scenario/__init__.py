"""Scenario files: what goes wrong in a rehearsal, when, and with whom.

:mod:`records` says what may be in one, :mod:`load` reads it, :mod:`director` makes it happen through :mod:`effects`,
and :mod:`aftermath` tells what drones do whose host has died.
"""
