"""A robot as plain data: joints, mechanisms, and the exact numbers that they hold."""
