"""Every topic of a plan file or a flight log, in one table: schema, fields with units, frame, clock, rate.

Names of Foxglove's own schemas are used where one exists, so that Foxglove and Lichtblick draw them without set-up;
everything else is ``ergoflie.*``. All channels are JSON with a JSON Schema. SI units; world frame (z up);
quaternions x, y, z, w, body to world. A value that is not known is null.

Clocks: every record's log time is the *flight clock* (``deploy.clock``), written as nanoseconds since the Unix epoch
(``Clock.epoch + t``). Where a drone stamped the data itself, its own tick stands in the record beside it.
"""

from __future__ import annotations

import functools

from deploy.flightlog.schema import Field, Kind, Topic

WORLD = "world"

_POSITION = Field("position", Kind.VECTOR, "m", "position")
_VELOCITY = Field("velocity", Kind.VECTOR, "m/s", "velocity")
_TICK = Field("tick", Kind.INTEGER, "ms", "the drone's own time stamp; null when it has none")

TOPICS: tuple[Topic, ...] = (
    Topic(
        "/{robot}/pose",
        "foxglove.PoseInFrame",
        (),
        WORLD,
        "flight clock at measurement",
        "flight.pose_rate",
        "pose from the motion capture; identity orientation when only the position is known",
    ),
    Topic(
        "/{robot}/estimate",
        "ergoflie.Estimate",
        (_POSITION, _VELOCITY, Field("attitude", Kind.VECTOR, "rad", "roll, pitch, yaw"), _TICK),
        WORLD,
        "flight clock at reception",
        "flight.log_rate",
        "the drone's own state estimate, by telemetry",
    ),
    Topic(
        "/{robot}/setpoint",
        "ergoflie.Setpoint",
        (_POSITION, _VELOCITY, Field("yaw_rate", Kind.NUMBER, "rad/s", "yaw rate"), _TICK),
        WORLD,
        "flight clock at reception",
        "flight.log_rate",
        "what the drone's commander asks of its controller (ctrltarget), by telemetry",
    ),
    Topic(
        "/{robot}/reference",
        "ergoflie.Reference",
        (_POSITION, _VELOCITY),
        WORLD,
        "flight clock",
        "flight.log_rate, during the mission",
        "where the certified trajectory is at that time",
    ),
    Topic(
        "/{robot}/battery",
        "ergoflie.Battery",
        (
            Field("voltage", Kind.NUMBER, "V", "battery voltage under the present load"),
            Field("level", Kind.NUMBER, "%", "charge level as the firmware sees it"),
            Field("state", Kind.INTEGER, "", "pm.state: 0 battery, 1 charging, 2 charged, 3 low power, 4 shutdown"),
        ),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "battery, by telemetry",
    ),
    Topic(
        "/{robot}/link",
        "ergoflie.Link",
        (
            Field("latency_ms", Kind.NUMBER, "ms", "round trip of a ping"),
            Field("quality", Kind.NUMBER, "%", "share of acknowledged packets"),
            Field("rssi", Kind.NUMBER, "dBm", "received signal strength"),
            Field("sent", Kind.INTEGER, "", "packets sent so far"),
            Field("received", Kind.INTEGER, "", "packets received so far"),
            Field("lost", Kind.INTEGER, "", "packets known to be lost so far"),
        ),
        "",
        "flight clock",
        "1 to 10 Hz",
        "radio link statistics",
    ),
    Topic(
        "/{robot}/supervisor",
        "ergoflie.Supervisor",
        (
            Field("bits", Kind.INTEGER, "", "supervisor.info bit field"),
            Field("names", Kind.TEXTS, "", "names of the bits that are set"),
        ),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "state of the firmware's supervisor",
    ),
    Topic(
        "/{robot}/motors",
        "ergoflie.Motors",
        tuple(Field(f"m{k}", Kind.INTEGER, "0..65535", f"command of motor {k}") for k in (1, 2, 3, 4)),
        "",
        "flight clock at reception",
        "flight.log_rate",
        "motor commands",
    ),
    Topic(
        "/{robot}/light",
        "ergoflie.Light",
        (
            Field("red", Kind.INTEGER, "0..255", "what the ring fades to"),
            Field("green", Kind.INTEGER, "0..255", "what the ring fades to"),
            Field("blue", Kind.INTEGER, "0..255", "what the ring fades to"),
            Field("spread", Kind.NUMBER, "m", "how far the robot saw to each side; 0 once the search is over"),
        ),
        "",
        "flight clock when the drone was heard to have it",
        "2 Hz at most, during the mission",
        "colour of the LED ring of a robot that has one, and a footprint",
    ),
    Topic(
        "/ergodicity",
        "ergoflie.Ergodicity",
        (
            Field("value", Kind.NUMBER, "", "E of everything flown since the search began"),
            Field("certified", Kind.NUMBER, "", "E of the certified bytes at the end of the search"),
        ),
        "",
        "flight clock",
        "5 Hz, during the mission",
        "how well the swarm has covered the map so far, by the planner's own definition",
    ),
    Topic(
        "/events",
        "ergoflie.Event",
        (
            Field("phase", Kind.TEXT, "", "phase of the flight"),
            Field("robot", Kind.TEXT, "", "robot concerned; empty for all"),
            Field("level", Kind.TEXT, "", "info, warning or fault"),
            Field("name", Kind.TEXT, "", "what kind of event: phase, mission_start, mission_end, …"),
            Field("text", Kind.TEXT, "", "one line for a person"),
            Field("value", Kind.NUMBER, "", "a figure, in the unit the text names"),
            Field("kind", Kind.TEXT, "", "of events of one name that mean different things (mocap: swap, teleport, …)"),
        ),
        "",
        "flight clock",
        "as they happen",
        "everything that happened",
    ),
    Topic("/log", "foxglove.Log", (), "", "flight clock", "as they happen", "the events as log lines; drop reports"),
    Topic(
        "/mocap",
        "ergoflie.Mocap",
        (
            Field("rate", Kind.NUMBER, "Hz", "frames per second over the last second"),
            Field("age", Kind.NUMBER, "s", "age of the newest frame"),
            Field("latency_ms", Kind.NUMBER, "ms", "from measurement to use, mean over the frames of the last second"),
            Field("worst_latency_ms", Kind.NUMBER, "ms", "the same at its longest"),
            Field("stale", Kind.INTEGER, "", "frames of the last second that were too old to be sent on"),
            Field("sent", Kind.NUMBER, "Hz", "poses sent over the last second, to all drones together"),
            Field("bodies", Kind.INTEGER, "", "bodies in the newest frame"),
            Field("points", Kind.INTEGER, "", "unlabelled markers in the newest frame"),
            Field("missing", Kind.TEXTS, "", "robots without a pose in it"),
            Field("doubtful", Kind.TEXTS, "", "those of them whose marker could be another's"),
            Field("refused", Kind.TEXTS, "", "robots whose newest poses could not be true and were not sent"),
        ),
        "",
        "flight clock",
        "1 to 10 Hz",
        "health of the motion capture",
    ),
    Topic(
        "/mocap/points",
        "ergoflie.Points",
        (Field("points", Kind.NUMBERS, "m", "x, y, z of one marker after the other, unlabelled"),),
        WORLD,
        "flight clock at measurement",
        "every frame of a flight with unlabelled markers",
        "what the capture system saw; the tracker can be replayed on it",
    ),
    Topic(
        "/tf",
        "foxglove.FrameTransforms",
        (),
        WORLD,
        "flight clock; in plan files time since the start of the search",
        "10 Hz",
        "frames of the robots, which carry what viewers draw of them",
    ),
    Topic("/map", "foxglove.Grid", (), WORLD, "flight clock", "once", "the information map, 255 where it is highest"),
    Topic(
        "/scene/mission",
        "foxglove.SceneUpdate",
        (),
        WORLD,
        "flight clock",
        "once, and again for those who go on without somebody",
        "workspace, obstacles, zones, certified paths",
    ),
    Topic(
        "/scene/drones",
        "foxglove.SceneUpdate",
        (),
        "each robot's own",
        "flight clock",
        "once, and again for those who go on without somebody",
        "a body and a name for every robot",
    ),
    Topic(
        "/scene/links",
        "foxglove.SceneUpdate",
        (),
        WORLD,
        "flight clock; in plan files time since the start of the search",
        "10 Hz, with a connectivity range",
        "lines between robots in the air that are within range",
    ),
    Topic(
        "/plan/{robot}/pose",
        "foxglove.PoseInFrame",
        (),
        WORLD,
        "time since the start of the search",
        "10 Hz",
        "the certified trajectory, in plan files",
    ),
)

_BY_SHAPE = {topic.pattern: topic for topic in TOPICS}


@functools.lru_cache(maxsize=4096)
def find_topic(name: str) -> tuple[Topic, str]:
    """The row a topic name belongs to, and its robot (empty for topics without one).

    Raises:
        ValueError: no row has this name.
    """
    parts = name.split("/")
    if name in _BY_SHAPE and "{robot}" not in name:
        return _BY_SHAPE[name], ""
    for at in (1, 2):
        if at < len(parts) and parts[at]:
            shape = "/".join([*parts[:at], "{robot}", *parts[at + 1 :]])
            if shape in _BY_SHAPE:
                return _BY_SHAPE[shape], parts[at]
    raise ValueError(f"unknown topic '{name}'; known: {', '.join(_BY_SHAPE)}")


def markdown() -> str:
    """The table as a document: every topic, then every field of ours with its unit."""
    lines = ["| topic | schema | frame | clock | rate | what |", "|---|---|---|---|---|---|"]
    lines += [f"| `{t.pattern}` | `{t.schema}` | {t.frame or '–'} | {t.clock} | {t.rate} | {t.doc} |" for t in TOPICS]
    for topic in TOPICS:
        if topic.fields:
            lines += [
                "",
                f"`{topic.pattern}`, `{topic.schema}`",
                "",
                "| field | shape | unit | what |",
                "|---|---|---|---|",
            ]
            lines += [f"| {f.name} | {f.kind.value} | {f.unit or '–'} | {f.doc} |" for f in topic.fields]
    return "\n".join(lines)
