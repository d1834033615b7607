"""The languages that a lamp can be written in."""
