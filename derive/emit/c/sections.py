"""Comments in generated C: the operation counts of a function, and section titles."""

from collections.abc import Iterable, Sequence

from ...program.counting import Operations
from ...program.operations import Compute, Constant, Statement, Store
from ...terms.symbolic_function import Result, SymbolicFunction

_MATRIX = 2


def summary(operations: Operations) -> str:
    """Format operation counts, for example ``35 operations: multiply 12, add 13, trig 10``."""
    kinds = {kind: n for kind, n in operations.as_dict().items() if n and kind != "total"}
    listed = ", ".join(f"{kind} {n}" for kind, n in kinds.items())
    return f"{operations.total} operations" + (f": {listed}" if listed else "")


def iteration_count(function: SymbolicFunction) -> str:
    """Return a text that states the operation count of the solvers called by a function."""
    count = sum(call.operations for call in function.calls)
    return f", after about {count} operations of the loop iteration" if count else ""


def title(statements: Sequence[Statement], results: Sequence[Result]) -> str:
    """Return a section title such as ``intermediate terms`` or ``column 3 of J``."""
    stores = [statement for statement in statements if isinstance(statement, Store)]
    parts = ["intermediate terms"] if any(isinstance(s, Compute) for s in statements) else []
    constant = bool(stores) and all(isinstance(store.value, Constant) for store in stores)
    for k in sorted({store.output for store in stores}):
        entries = _entries(results[k], [s.entry for s in stores if s.output == k])
        parts.append(f"constant entries of {results[k].name}" if constant else entries)
    return ", then ".join(parts)


def _entries(result: Result, entries: Iterable[int]) -> str:
    if len(result.shape) != _MATRIX:
        return result.name
    width = result.shape[-1]
    columns = sorted({entry % width + 1 for entry in entries})
    if len(columns) == width:
        return result.name
    *first, last = map(str, columns)
    listed = f"columns {', '.join(first)} and {last}" if first else f"column {last}"
    return f"{listed} of {result.name}"
