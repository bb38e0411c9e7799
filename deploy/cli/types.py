"""Types shared by the commands; imported by type checkers only."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # argparse gives the return type of add_subparsers() no public name.
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]
