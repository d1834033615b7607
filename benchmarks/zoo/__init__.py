"""Lamps that nobody made by hand: drawn from a seed, trained unattended, and measured."""
