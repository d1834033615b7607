"""Lamps drawn from a seed: shapes, finishes and light, and the files they become."""
