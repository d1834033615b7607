"""What a lamp's maker measured of it, and what that means in words."""
