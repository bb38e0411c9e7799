"""The high-level commander: from commands and trajectory memory to a goal, 100 times a second."""
