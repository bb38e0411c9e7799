"""What a log says about a flight."""

from deploy.analysis.analyse import analyse
from deploy.analysis.record import FlightAnalysis

__all__ = ["FlightAnalysis", "analyse"]
