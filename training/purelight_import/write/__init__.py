"""A lamp as files: a Mitsuba scene with its meshes and pictures, a list of parts, a portrait."""
