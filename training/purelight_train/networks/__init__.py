"""The networks that stand for a lamp, and what they are made of."""
