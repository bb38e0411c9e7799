"""The paper's Algorithm 1 (iterative MEC: augmented Lagrangian and iLQR): the reference the default is held against."""
