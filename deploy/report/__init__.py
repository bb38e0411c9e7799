"""The post-flight report and the comparison of flights, one HTML file each."""

from deploy.report.build import build_report
from deploy.report.compare import build_comparison

__all__ = ["build_comparison", "build_report"]
