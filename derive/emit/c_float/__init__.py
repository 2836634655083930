"""Generates C in single precision for microcontrollers, with measured errors and a stack bound."""
