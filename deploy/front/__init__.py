"""The page of a Pareto front: what there is to choose from, for the people who choose."""
