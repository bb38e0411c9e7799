"""``ergoflie check``: certify a plan file again, from the bytes in it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.cli.types import Subparsers
    from planner.certificate.record import Certificate


def add_parser(commands: Subparsers) -> None:
    """Add this command."""
    parser = commands.add_parser(
        "check",
        help="certify a plan file again from the bytes in it; exit 1 if it fails",
        description="Certifies a plan file again, from nothing but the bytes and the mission in it, and compares the "
        "result with the certificate in the file. Exit 0: it holds; 1: a check fails, or the file's own certificate "
        "says something else; 2: not an intact plan file.",
    )
    parser.add_argument("plan", type=Path, help="plan file")
    parser.add_argument("--json", action="store_true", help="print the certificate as JSON")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read, certify afresh, print the tables."""
    from deploy.cli.certificate import certificate_json
    from deploy.cli.console import err, print_json
    from deploy.planfile import read_plan
    from planner.certificate.certify import certify
    from planner.certificate.compare import differences

    flight_plan = read_plan(args.plan)
    certificate = certify(flight_plan.mission, flight_plan.trajectories, flight_plan.transfers)
    differing = differences(flight_plan.certificate, certificate)
    if args.json:
        print_json({**certificate_json(certificate), "differs_from_file": list(differing)})
    else:
        _print(certificate, [robot.name for robot in flight_plan.mission.robots])
    if differing:
        listing = ", ".join(differing[:5])
        err.print(
            f"ergoflie: {args.plan}: the certificate in the file does not follow from its bytes: {listing}",
            markup=False,
            soft_wrap=True,
        )
    return 0 if certificate.passed and not differing else 1


def _print(certificate: Certificate, names: list[str]) -> None:
    """Tables, and a line that sums them up."""
    from deploy.cli.certificate import print_certificate, print_connections, print_forwarding
    from deploy.cli.console import number, out

    print_certificate(certificate)
    print_connections(certificate.indicators)
    print_forwarding(certificate.indicators, names)
    failures, warnings = len(certificate.failures), len(certificate.warnings)
    verdict = "[green]PASS[/]" if certificate.passed else "[red]FAIL[/]"
    counts = f"{len(certificate.checks)} checks, {failures} failed, {warnings} warnings"
    out.print(f"{verdict}: {counts}; ergodicity E {number(certificate.indicators.ergodicity)}")
