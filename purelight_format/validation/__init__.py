"""A report on any bytes whatsoever."""
