"""A Rust crate without dependencies, which also compiles without the standard library of Rust."""
