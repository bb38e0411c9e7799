"""Settings of the whole suite: one BLAS thread, hardware and chaos only when asked for, seeded hypothesis."""

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is imported: the matrices are small, threads only get in the way

import hypothesis  # noqa: E402

hypothesis.settings.register_profile(
    "repeatable", derandomize=True, deadline=None, suppress_health_check=[hypothesis.HealthCheck.too_slow]
)
hypothesis.settings.load_profile("repeatable")


def pytest_collection_modifyitems(config, items):
    """Who needs a Crazyradio and a drone runs only under ``-m hardware``, the whole fault matrix under ``-m chaos``."""
    asked = config.option.markexpr or ""
    kept = {name for name in ("hardware", "chaos") if name not in asked}
    unwanted = [item for item in items if any(item.get_closest_marker(name) for name in kept)]
    if unwanted:
        config.hook.pytest_deselected(items=unwanted)
        items[:] = [item for item in items if item not in set(unwanted)]
