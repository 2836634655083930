"""Programs in single precision, and their errors against double precision."""
