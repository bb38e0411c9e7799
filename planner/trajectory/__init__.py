"""Plan to polynomials to bytes, and back."""
