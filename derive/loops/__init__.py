"""Robots with loops: their equations, closed-form solution, assembly modes, rates and mobility.

A robot without loops needs none of these files: its derivation uses :mod:`chasles.derive.chain`.
"""
