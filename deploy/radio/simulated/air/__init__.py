"""What is between cflib and the simulated drones: dongles that are shared, packets that are late, and links that break.

One :class:`~deploy.radio.simulated.air.air.Air` holds a :class:`~deploy.radio.simulated.air.dongle.Dongle` for every
Crazyradio, which polls its drones in turn, and a :class:`~deploy.radio.simulated.air.line.Line` for every drone:
queues, retries, losses. It lives on the caller's time: everything happens while :meth:`Air.advance` is under way, in
the same order for the same seed.
"""
