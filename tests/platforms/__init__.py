"""Wheels for other platforms: compiled on Linux, tested under Wine or QEMU."""
