"""Every system that can light a scene by a lamp, on the same work: speed against error."""
