"""What the networks learn from, and by which loss."""
