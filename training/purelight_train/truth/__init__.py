"""What is true of a lamp, made by no network, and how far a picture is from it."""
