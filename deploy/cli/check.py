"""``ergoflie check``: certify a plan file again, from the bytes in it."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser("check", help="certify a plan file again from the bytes in it; exit 1 if it fails")
    parser.add_argument("plan", type=Path, help="plan file")
    parser.add_argument("--json", action="store_true", help="print the certificate as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, certify afresh, print the table."""
    from deploy.cli.console import print_json
    from deploy.cli.planning import print_certificate
    from deploy.planfile import read_plan
    from planner.certificate.certify import certify

    flight_plan = read_plan(args.plan)
    certificate = certify(flight_plan.mission, flight_plan.trajectories)
    if args.json:
        print_json({"passed": certificate.passed, **dataclasses.asdict(certificate)})
    else:
        print_certificate(certificate)
    return 0 if certificate.passed else 1
