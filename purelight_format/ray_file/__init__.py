"""Ray files: light as rays with a position, a direction and a flux, both ways."""
