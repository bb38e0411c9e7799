"""The ergodic metric: basis, information map, E and its gradient."""
