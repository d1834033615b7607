"""Systems of other people, and of the paper, on our lamps; each says what it is."""
