"""What becomes of a lamp's parts: chosen by name, made to shine, turned the right way round."""
