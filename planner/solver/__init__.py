"""Solvers: Problem in, Plan out."""
