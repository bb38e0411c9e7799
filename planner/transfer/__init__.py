"""The way to the search and back: prisms (what is in the way), paths (around it), waves (who moves when), plan."""
