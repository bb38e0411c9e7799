"""What a log says about a flight."""

from deploy.analysis.analyse import analyse
from deploy.analysis.record import FlightAnalysis
from deploy.flightlog.reader import read_log as load

__all__ = ["FlightAnalysis", "analyse", "load"]
