"""Motion in velocity space: rates, tracking, manipulability and singularities."""
