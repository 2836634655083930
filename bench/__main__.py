"""``python -m bench``: every benchmark, its tables printed and saved in bench/results/."""

from . import calls, derivation

derivation.run()
calls.run()
