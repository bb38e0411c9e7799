"""Constraints, one idea a file."""
