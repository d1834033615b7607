"""The same small lamp, written by hand in every format that lamps are imported from."""
