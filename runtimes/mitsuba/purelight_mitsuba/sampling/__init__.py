"""Directions and points toward one lamp: cap, exit surface, radiance map, far field."""
