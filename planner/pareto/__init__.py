"""Several information maps at once: plans that trade one map's ergodicity for another's, and the front they form."""
