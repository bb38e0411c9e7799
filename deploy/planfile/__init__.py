"""Plan files: a flight plan as one MCAP file that cannot be misread, cut or edited unnoticed."""

from deploy.planfile.read import read_plan, read_plan_bytes
from deploy.planfile.write import plan_bytes, write_plan

__all__ = ["plan_bytes", "read_plan", "read_plan_bytes", "write_plan"]
