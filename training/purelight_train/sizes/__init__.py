"""Right size: the smallest networks that a lamp needs."""
