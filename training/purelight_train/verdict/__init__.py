"""What a trained lamp is worth, measured on fresh light: room, picture and fast mode."""
