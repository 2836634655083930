"""The contract with the generated code: manifest, compiled library, compiler and package."""
