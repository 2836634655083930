"""The contract with the generated code: facts, manifest, compiler and compiled library."""
