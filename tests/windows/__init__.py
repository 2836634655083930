"""The wheel for Windows: compiled on Linux, tested under Wine."""
