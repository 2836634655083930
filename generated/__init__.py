"""The robots that the compiler wrote, one package each."""
