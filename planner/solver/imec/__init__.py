"""The paper's Algorithm 1 (iterative MEC: augmented Lagrangian and iLQR), as the reference the default is held against."""
