"""Paths of light in the room and among the lamps."""
