"""The post-flight report, one HTML file."""

from deploy.report.build import build_report

__all__ = ["build_report"]
