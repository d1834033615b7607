"""The USD layer of a bundle, and the one beside it: written, and checked word by word."""
