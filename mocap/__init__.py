"""Where the drones are: motion capture."""
