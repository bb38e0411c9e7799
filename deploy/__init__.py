"""From certified polynomials to a flight, its log and its report."""
