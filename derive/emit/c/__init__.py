"""The C of a robot: one pose a call, batches on lanes, branches side by side."""
