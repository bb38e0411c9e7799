"""``ergoflie``: one console script, one subcommand a file.

Exit codes: 0 done; 1 the answer is no (infeasible, certificate fails, verdict FAIL); 2 the input cannot be used (one
line on stderr says why); 130 interrupted. Subcommands import what they need when they run, so ``--help`` is instant.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import sys
from collections.abc import Sequence

from deploy.cli import check, control, dry_run, export, fly, import_, log, pareto, plan, report, schema, sim, study
from deploy.cli.console import fail

COMMANDS = (plan, pareto, check, import_, export, dry_run, fly, control, report, log, schema, sim, study)


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = argparse.ArgumentParser(
        prog="ergoflie",
        description="Ergodic search with connectivity for Crazyflie swarms: plan, certify, rehearse, fly, report.",
    )
    top.add_argument("--version", action="version", version=f"ergoflie {importlib.metadata.version('ergoflie')}")
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS:
        command.add_parser(commands)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; errors a user can cause become one line and exit code 2."""
    args = parser().parse_args(argv)
    # The matrices are small: BLAS threads cost more than they give, unless the user asks for them.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")

    from deploy.errors import DeployError
    from missions.errors import MissionError
    from mocap.errors import MocapError
    from planner.errors import PlannerError

    try:
        return int(args.run(args))
    except (MissionError, DeployError, PlannerError, MocapError) as error:
        return fail(error)
    except BrokenPipeError:
        # The reader of our output went away (e.g. `| head`): not our failure, and nothing left to say.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        return fail("interrupted", code=130)
    except OSError as error:
        return fail(f"{error.filename or 'file system'}: {error.strerror or error}")


if __name__ == "__main__":
    sys.exit(main())
