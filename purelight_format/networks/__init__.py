"""What a network of a bundle may be, how it is evaluated by the book, and its golden vectors."""
