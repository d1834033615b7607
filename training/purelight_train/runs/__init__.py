"""A training run: its stages, its directory, and what is measured of it."""
