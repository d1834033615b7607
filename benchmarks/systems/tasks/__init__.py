"""What systems are asked for: scenes with a lamp, their truths, and what is judged of them."""
