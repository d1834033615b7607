"""Pictures: passes, light groups, first hits."""
