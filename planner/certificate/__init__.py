"""Independent check of the encoded bytes against the mission."""
