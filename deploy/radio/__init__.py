"""The drones as seen through cflib; the simulated radio behind cflib's driver seam.

::

    fleet.py       all drones: act in parallel, report every failure
    drone.py       one Crazyflie: connection, parameters, memory, commands, telemetry, poses
    requests.py    packets that are answered, with deadlines
    highlevel.py   the high-level commander's commands and return codes, as bytes
    memory.py      chunks of the drone's memories
    parameters.py  on-board parameters, written and read back
    ping.py        round trips by the flight's clock
    telemetry.py   log blocks and the records made of them
    supervisor.py  the supervisor's state word
    simulated/     sim://…, a driver like any other

cflib's threads and callbacks stay inside this package; everything above it is synchronous.
"""
