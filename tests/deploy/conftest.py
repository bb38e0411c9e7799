"""What the flight tests share."""

import pytest


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    """Tables of contents are fetched once for all tests of a process."""
    return tmp_path_factory.mktemp("toc")
