"""Whether the Mitsuba runtime is right, and how fast, on an NVIDIA GPU."""
