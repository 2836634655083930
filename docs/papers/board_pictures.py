def drawn(*a):
    return {}
