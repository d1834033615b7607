"""Light out of a lamp: traced, recorded, and counted."""
