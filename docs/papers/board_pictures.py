def drawn(*a): return {}
