"""Lamps of a scene: their bundles, where they hang, which one to choose."""
