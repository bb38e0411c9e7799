"""What a flight is made of; ``deploy.execute`` puts it together.

::

    records.py      what the flight tells its observer and its caller
    poses.py        motion capture to drones
    journal.py      telemetry to the flight log
    courses.py      where everybody should be
    whereabouts.py  where everybody is, as well as it is known
    seen.py         what the watch looks at, compares with, and finds
    watch.py        what may not happen in flight
    separations.py  ... between two
    lookout.py      what the watch is told, and what its findings lead to
    rescue.py       lost links, opened again
    reactions.py    what follows when it does: the mission's policies
    deadlines.py    how long everything may take
    timing.py       how prompt commands and reactions are
    keepalive.py    the firmware's watchdog, for the day this computer dies
    loop.py         the flight loop: one tick of everything
    status.py       a flight in a few words
    commands.py     commands with answers
    muster.py       who flies: tried again, left behind, or nobody
    ground.py       connect, set up, settle the estimators, check, upload, arm
    talk.py         a conversation with one drone, a packet at a time
    chain.py        legs of one robot's long trajectory: uploaded and started in flight
    legs.py         everybody's
    passages.py     take off, the moves to the starts and back
    manoeuvres.py   start together, search, land
    stops.py        where everybody comes to a stop, and who waits elsewhere
    landing.py      who lands first, and whose motors may be stopped
    touchdown.py    down to the ground, together or in turn
    braking.py      everybody to a stop
    abort.py        how a flight ends early
"""
