"""ONNX networks as Dr.Jit operations."""
