"""Formats a count with its noun in the singular or plural."""


def counted(count: int, noun: str) -> str:
    """Return a number with a noun, for example ``1 slot`` or ``2 slots``."""
    return f"{count} {noun}{'s' if count != 1 else ''}"
