"""LuxCoreRender's bidirectional path tracer on the real lamp."""
