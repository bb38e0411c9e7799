"""Connectivity: who can talk to whom, as probabilities and as meetings."""
