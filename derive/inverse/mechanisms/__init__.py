"""Inverses of robots with loops: of their main chain, of shorter chains with slides, of legs."""
