"""Writes a Rust crate that also works without the standard library."""
