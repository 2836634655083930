"""A crate in Rust without dependencies, which also compiles without Rust's standard library."""
