"""The way to the search and back.

::

    prisms.py    what is in the way, as convex sets
    scene.py     all of it, and the distances between robots
    paths.py     one robot's way around what is in the way
    delays.py    who leaves when, everybody at his own pace
    waves.py     all at once; or, where no delays work out, one group after another
    plan.py      from the mission and the ends of the search to moves
    descent.py   where to come down after an abort
"""
