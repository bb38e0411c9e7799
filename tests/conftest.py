"""Settings of the whole suite: one BLAS thread, hardware tests only when asked for, seeded hypothesis."""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is imported: the matrices are small, threads only get in the way

import hypothesis  # noqa: E402

hypothesis.settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("repeatable")


def pytest_collection_modifyitems(config, items):
    """Tests that need a Crazyradio and a drone run only under ``-m hardware``."""
    if "hardware" in (config.option.markexpr or ""):
        return
    wanted = [item for item in items if item.get_closest_marker("hardware") is None]
    unwanted = [item for item in items if item.get_closest_marker("hardware") is not None]
    if unwanted:
        config.hook.pytest_deselected(items=unwanted)
        items[:] = wanted
