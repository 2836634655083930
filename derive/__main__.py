"""``python -m chasles.derive`` is ``chasles-derive``."""

from .cli import main

main()
