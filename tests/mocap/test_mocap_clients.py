"""The marker clients against servers that speak the real protocols; where the optional packages are installed."""

import contextlib
import socket
import struct
import threading

import pytest

POINTS = ((1.0, 2.0, 0.5), (-0.25, 0.0, 1.5))


@contextlib.contextmanager
def serving(kind, serve):
    """A server on loopback in a thread; its port."""
    with socket.socket(socket.AF_INET, kind) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.settimeout(5.0)
        if kind == socket.SOCK_STREAM:
            listener.listen()
        thread = threading.Thread(target=serve, args=(listener,), daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        thread.join(5.0)


def qualisys_packet(kind, payload):
    return struct.pack("<ii", 8 + len(payload), kind) + payload


def qualisys(listener):
    """QTM RT server protocol 1.25: welcome, version, then data frames of component 2 (3D without labels)."""
    stream, _ = listener.accept()
    with stream:
        stream.settimeout(5.0)
        stream.sendall(qualisys_packet(1, b"QTM RT Interface connected\0"))
        assert b"version 1.25" in stream.recv(1000)
        stream.sendall(qualisys_packet(1, b"Version set to 1.25\0"))
        assert b"streamframes allframes 3dnolabels" in stream.recv(1000)
        for k in range(3):
            markers = b"".join(
                struct.pack("<fffi", 1000.0 * x, 1000.0 * y, 1000.0 * z, i) for i, (x, y, z) in enumerate(POINTS)
            )
            component = struct.pack("<ihh", len(POINTS), 0, 0) + markers
            frame = struct.pack("<Qii", 10_000 * (k + 1), k, 1) + struct.pack("<ii", 8 + len(component), 2) + component
            stream.sendall(qualisys_packet(3, frame))


def test_qualisys_markers_come_in_metres_with_their_times():
    pytest.importorskip("qtm_rt")
    from mocap.clients.qualisys import connect

    with (
        serving(socket.SOCK_STREAM, qualisys) as port,
        contextlib.closing(connect("qualisys", {"hostname": "127.0.0.1", "port": str(port)})) as client,
    ):
        reports = [client.wait() for _ in range(3)]
        assert [report.stamp for report in reports] == pytest.approx([0.01, 0.02, 0.03])
        for report in reports:
            assert report.points == tuple(pytest.approx(point) for point in POINTS)
        with pytest.raises(OSError, match="closed the connection"):
            client.wait()


def test_a_qualisys_server_that_is_not_there():
    pytest.importorskip("qtm_rt")
    from mocap.clients.qualisys import connect

    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
        with pytest.raises(OSError, match=f"no Qualisys server at 127.0.0.1:{port}"):
            connect("qualisys", {"port": str(port)})


def motive_message(kind, payload):
    return struct.pack("<HH", kind, len(payload)) + payload


def motive_frame(k):
    """A frame of NatNet 3.1 with unlabelled markers only."""
    unlabelled = struct.pack("<I", len(POINTS)) + b"".join(struct.pack("<fff", *point) for point in POINTS)
    nothing = struct.pack("<I", 0)
    suffix = struct.pack("<IIdQQQH", 0, 0, 0.01 * (k + 1), 0, 0, 0, 0)
    parts = [struct.pack("<I", k), nothing, unlabelled, nothing, nothing, nothing, nothing, nothing, suffix]
    return motive_message(7, b"".join(parts))


def test_optitrack_markers_come_with_their_times(capfd):
    natnet = pytest.importorskip("natnet")
    from mocap.clients.optitrack import _Markers

    client = natnet.NatNetClient(use_multicast=False)
    info = motive_message(1, b"Motive".ljust(256, b"\0") + bytes([3, 0, 0, 0]) + bytes([3, 1, 0, 0]))
    process = client._NatNetClient__process_message
    process(natnet.packet_buffer.PacketBuffer(info))
    client.run_async = lambda: None
    markers = _Markers(client)
    process(natnet.packet_buffer.PacketBuffer(motive_frame(4)))
    report = markers.wait()
    assert report.points == tuple(pytest.approx(point) for point in POINTS)
    assert report.stamp == pytest.approx(0.05)
    assert not capfd.readouterr().out
    markers.close()


def test_a_motive_that_is_not_there(monkeypatch):
    pytest.importorskip("natnet")
    from mocap.clients import optitrack

    monkeypatch.setattr(optitrack, "_TIMEOUT", 0.1)
    with pytest.raises(OSError, match=r"no answer from Motive at 127\.0\.0\.1"):
        optitrack.connect("optitrack", {"multicast": "false", "port_command": "9"})
