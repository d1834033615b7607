"""What a lamp is, in whichever file it came: parts, materials, light, and what was not taken."""
