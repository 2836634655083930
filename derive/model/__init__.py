"""Robots as plain data: joints, mechanisms and exact numbers."""
