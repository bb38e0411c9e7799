"""A stand-in for the motioncapture package: the system's name says how it behaves."""

import os
import time
from types import SimpleNamespace


class _Source:
    def __init__(self, behaviour):
        self.behaviour, self.count = behaviour, 0
        self.rigidBodies = {}

    def waitForNextFrame(self):
        self.count += 1
        if self.count > 3 and self.behaviour == "falls silent":
            time.sleep(3600.0)
        if self.count > 3 and self.behaviour == "dies":
            os._exit(7)
        if self.count > 3 and self.behaviour == "breaks":
            raise RuntimeError("the stream broke")
        time.sleep(0.005)
        rotation = SimpleNamespace(x=0.0, y=0.0, z=0.6, w=0.8)
        self.rigidBodies = {"cf1": SimpleNamespace(position=[0.1, 0.2, 0.3 + self.count], rotation=rotation)}
        if self.count % 2:
            self.rigidBodies["cf2"] = SimpleNamespace(position=[1.0, 2.0, 3.0], rotation=rotation)


def connect(kind, options):
    if kind == "refuses":
        raise RuntimeError(f"no route to {options['hostname']}")
    if kind == "hangs":
        time.sleep(3600.0)
    if kind == "dies at once":
        os._exit(3)
    return _Source(kind)
