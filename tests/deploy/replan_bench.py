"""Four drones whose map changes three times in 32 s: the smallest mission that is planned anew in flight."""

from missions.loader import parse_mission

JOINTS = (8.0, 16.0, 24.0)
TEXT = """
schema_version: 1
name: anew
workspace: {lower: [0.0, 0.0], upper: [3.0, 2.5]}
horizon: {duration: 32.0, dt: 0.25}
information: {type: gaussians, components: [{mean: [0.8, 1.8], covariance: 0.1}]}
basis: {functions_per_axis: 6}
robots:
  - {name: cf1, start: [0.5, 0.5]}
  - {name: cf2, start: [2.5, 0.5]}
  - {name: cf3, start: [2.5, 2.0]}
  - {name: cf4, start: [0.5, 2.0]}
limits: {acceleration: 0.5, speed: 0.5, separation: 0.25}
solver: {starts: 2}
radio: {packet_rate: 900.0}
flight: {takeoff_duration: 1.2, landing_duration: 1.2, settle_time: 0.5}
safety: {min_robots: 4}
replanning:
  joints: [8.0, 16.0, 24.0]
  budget: 3.0
  changes:
    - {time: 2.0, information: {type: gaussians, components: [{mean: [2.2, 0.7], covariance: 0.1}]}}
    - {time: 10.0, information: {type: gaussians, components: [{mean: [2.2, 1.9], covariance: 0.2}]}}
    - {time: 18.0, information: {type: uniform}}
"""


def mission(text=TEXT):
    return parse_mission(text, path="anew.yaml", read_file={}.__getitem__)
