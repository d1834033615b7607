"""The far field of a lamp as IES LM-63 text, both ways."""
