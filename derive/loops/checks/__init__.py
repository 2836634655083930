"""Questions that a description raises before its loops are solved, answered in numbers."""
