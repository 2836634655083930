"""Evaluates xacro expressions without Python's ``eval``.

This prevents a file from running commands.

Xacro itself passes ``${...}`` and ``$(eval ...)`` to ``eval``, so that a file can call any Python
function. chasles uses Python only to parse the expression, and computes the value with its own
evaluator. The evaluator supports numbers, strings, lists, tuples, dictionaries, operators,
comprehensions and the documented functions of xacro. The evaluator rejects ``lambda``, ``type``,
``vars``, ``str.format`` and names that start with an underscore. No accepted symbol may call a
rejected function. For example, ``map`` is rejected because it can call any function.
"""

import ast
import operator
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

MAX_STEPS = 1_000_000
"""Maximum number of evaluated nodes per expression."""
MAX_SIZE = 1_000_000
"""Maximum length of ``text * n`` or ``list * n``, and maximum bit length of an integer."""
REFUSED_FUNCTIONS = ("type", "vars", "complex", "issubclass", "hash")
"""Functions of xacro that the evaluator rejects. These functions only inspect Python objects."""
METHODS: Mapping[type, Collection[str]] = {
    str: (
        *("capitalize", "count", "endswith", "find", "index", "isalnum", "isalpha", "isdigit"),
        *("join", "lower", "lstrip", "partition", "removeprefix", "removesuffix", "replace"),
        *("rfind", "rpartition", "rsplit", "rstrip", "split", "splitlines", "startswith", "strip"),
        *("title", "upper"),
    ),
    dict: ("copy", "get", "items", "keys", "values"),
    list: ("append", "copy", "count", "extend", "index", "insert", "pop", "remove", "reverse"),
    tuple: ("count", "index"),
    set: ("add", "union", "intersection", "difference", "issubset"),
    frozenset: ("union", "intersection", "difference", "issubset"),
}
"""Methods that an expression may call, by the type of the object."""
BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}
UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
}
COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda item, items: item in items,
    ast.NotIn: lambda item, items: item not in items,
}


class RefusedExpressionError(ValueError):
    """An expression is outside the supported subset of xacro, or is too large."""


@contextmanager
def replaced(module: Any, **values: Any) -> Iterator[None]:
    """Context manager that temporarily replaces attributes of a module."""
    before = dict(vars(module))
    try:
        vars(module).update(values)
        yield
    finally:
        for name in values:
            # An attribute that did not exist before is deleted. A built-in function of the same
            # name then becomes visible again.
            if name in before:
                setattr(module, name, before[name])
            else:
                delattr(module, name)


def allowed_symbols(symbols: Mapping[str, Any]) -> Any:
    """Return a copy of the symbols of xacro without ``REFUSED_FUNCTIONS``."""
    copy: Any = type(symbols)()
    for name, value in symbols.items():
        if name not in REFUSED_FUNCTIONS:
            own = allowed_symbols(value) if isinstance(value, Mapping) else value
            # The item assignment of a xacro namespace evaluates strings, so dict.__setitem__ stores
            # the value unchanged.
            dict.__setitem__(copy, name, own)
    return copy


def expression_evaluator(symbols: Mapping[str, Any]) -> Callable[..., Any]:
    """Return the function that evaluates ``${...}``.

    Args:
        symbols: The result of ``allowed_symbols``.
    """
    functions = set(_functions(symbols))

    def evaluated(text: str, known: Any, _: Any = None) -> Any:
        return evaluate(text, known, functions)

    return evaluated


def substitution_evaluator(substitution_args: Any) -> Callable[..., str]:
    """Return the function that evaluates ``$(eval ...)``."""
    convert, read_argument = substitution_args.convert_value, substitution_args._eval_arg

    def evaluated(text: str, context: dict[str, Any]) -> str:
        arguments = context.setdefault("arg", {})

        def arg(name: str) -> Any:
            return convert(read_argument(name, args=arguments), "auto")

        def dirname() -> Any:
            return substitution_args._eval_dirname(context["filename"])

        builtins = {kind.__name__: kind for kind in (list, dict, map, str, float, int)}
        own = {**builtins, **substitution_args._eval_dict, "arg": arg, "dirname": dirname}
        known = {name: convert(str(value), "auto") for name, value in arguments.items()}
        return str(evaluate(text, {**known, **own}, set(_functions(own))))

    return evaluated


def _functions(symbols: Mapping[str, Any]) -> Iterator[Callable[..., Any]]:
    for name, value in symbols.items():
        if isinstance(value, Mapping):
            yield from _functions(value)
        elif callable(value) and not name.startswith("_"):
            yield value


def evaluate(text: str, symbols: Any, functions: Collection[Callable[..., Any]]) -> Any:
    """Return the value of an expression.

    Args:
        text: A Python expression in the documented subset.
        symbols: Values by name.
        functions: The functions that may be called.

    Raises:
        RefusedExpressionError: The expression is too large, or uses Python beyond the documented
            subset.
        NameError: A name has no value.
        SyntaxError: The text is not an expression.
    """
    return _Evaluator(symbols, frozenset(functions)).value(ast.parse(text.strip(), mode="eval"))


class _Evaluator:
    """Evaluates the nodes of one expression."""

    def __init__(self, symbols: Any, functions: Collection[Callable[..., Any]]) -> None:
        self.symbols = symbols
        self.functions = functions
        self.scopes: list[dict[str, Any]] = []
        self.steps = 0

    def value(self, node: ast.AST) -> Any:
        self.steps += 1
        if self.steps > MAX_STEPS:
            raise RefusedExpressionError(f"an expression takes more than {MAX_STEPS} steps")
        evaluator = getattr(self, f"_{type(node).__name__.lower()}", None)
        if evaluator is None:
            raise RefusedExpressionError(f"an expression must not contain {type(node).__name__}")
        found = evaluator(node)
        # Methods of strings and lists are not in the symbols of xacro. The function `_attribute`
        # has already checked the methods.
        return found if isinstance(node, ast.Attribute) else self._checked(node, found)

    def _expression(self, node: ast.Expression) -> Any:
        return self.value(node.body)

    def _constant(self, node: ast.Constant) -> Any:
        if isinstance(node.value, bytes):
            raise RefusedExpressionError("bytes are not allowed in an expression")
        return node.value

    def _name(self, node: ast.Name) -> Any:
        for scope in reversed(self.scopes):
            if node.id in scope:
                return scope[node.id]
        _check_name(node.id)
        try:
            return self.symbols[node.id]
        except KeyError:
            raise NameError(f"name {node.id!r} is not defined") from None

    def _checked(self, node: ast.AST, found: Any) -> Any:
        """Return a value.

        If the value is a function, the function must be in the set of allowed functions.
        """
        if callable(found) and not (_is_hashable(found) and found in self.functions):
            name = ast.unparse(node)
            raise RefusedExpressionError(f"an expression must not call the function {name!r}")
        return found

    def _attribute(self, node: ast.Attribute) -> Any:
        _check_name(node.attr)
        owner = self.value(node.value)
        if isinstance(owner, dict) and node.attr not in METHODS[dict]:
            # Namespaces and YAML dictionaries allow access by dots.
            return self._checked(node, getattr(owner, node.attr))
        allowed = next((names for kind, names in METHODS.items() if isinstance(owner, kind)), ())
        if node.attr not in allowed:
            raise RefusedExpressionError(f"the attribute {node.attr!r} is not allowed")
        return getattr(owner, node.attr)

    def _call(self, node: ast.Call) -> Any:
        function = self.value(node.func)
        if not callable(function):
            raise TypeError(f"expected a function, got {ast.unparse(node.func)}")
        if any(keyword.arg is None for keyword in node.keywords):
            raise RefusedExpressionError("** is not allowed in a call")
        named = {str(keyword.arg): self.value(keyword.value) for keyword in node.keywords}
        return function(*self._items(node.args), **named)

    def _items(self, nodes: list[ast.expr]) -> Iterator[Any]:
        for node in nodes:
            if isinstance(node, ast.Starred):
                yield from self.value(node.value)
            else:
                yield self.value(node)

    def _list(self, node: ast.List) -> list[Any]:
        return list(self._items(node.elts))

    def _tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self._items(node.elts))

    def _set(self, node: ast.Set) -> set[Any]:
        return set(self._items(node.elts))

    def _dict(self, node: ast.Dict) -> dict[Any, Any]:
        if None in node.keys:
            raise RefusedExpressionError("** is not allowed in a dictionary")
        keys = [self.value(key) for key in node.keys if key is not None]
        return dict(zip(keys, map(self.value, node.values), strict=True))

    def _unaryop(self, node: ast.UnaryOp) -> Any:
        return UNARY[type(node.op)](self.value(node.operand))

    def _binop(self, node: ast.BinOp) -> Any:
        compute = BINARY.get(type(node.op))
        if compute is None:
            raise RefusedExpressionError(f"{type(node.op).__name__} is not allowed")
        left, right = self.value(node.left), self.value(node.right)
        _check_size(node.op, left, right)
        return compute(left, right)

    def _boolop(self, node: ast.BoolOp) -> Any:
        stops = isinstance(node.op, ast.Or)
        found = None
        for part in node.values:
            found = self.value(part)
            if bool(found) is stops:
                break
        return found

    def _compare(self, node: ast.Compare) -> bool:
        left = self.value(node.left)
        for kind, part in zip(node.ops, node.comparators, strict=True):
            right = self.value(part)
            if not COMPARISONS[type(kind)](left, right):
                return False
            left = right
        return True

    def _ifexp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _subscript(self, node: ast.Subscript) -> Any:
        return self.value(node.value)[self.value(node.slice)]

    def _slice(self, node: ast.Slice) -> slice:
        ends = (node.lower, node.upper, node.step)
        return slice(*(None if end is None else self.value(end) for end in ends))

    def _joinedstr(self, node: ast.JoinedStr) -> str:
        return "".join(str(self.value(part)) for part in node.values)

    def _formattedvalue(self, node: ast.FormattedValue) -> str:
        value = self.value(node.value)
        if not isinstance(value, str | int | float):
            value = str(value)
        shown = {114: repr, 97: ascii}.get(node.conversion, lambda same: same)(value)
        spec = "" if node.format_spec is None else self.value(node.format_spec)
        _check_widths(spec)
        return format(shown, spec)

    def _listcomp(self, node: ast.ListComp) -> list[Any]:
        return list(self._produced(node.elt, node.generators))

    def _setcomp(self, node: ast.SetComp) -> set[Any]:
        return set(self._produced(node.elt, node.generators))

    def _generatorexp(self, node: ast.GeneratorExp) -> list[Any]:
        return list(self._produced(node.elt, node.generators))

    def _dictcomp(self, node: ast.DictComp) -> dict[Any, Any]:
        pair = ast.Tuple([node.key, node.value], ast.Load())
        return dict(self._produced(pair, node.generators))

    def _produced(self, item: ast.expr, generators: list[ast.comprehension]) -> Iterator[Any]:
        if not generators:
            yield self.value(item)
            return
        first, *rest = generators
        for element in self.value(first.iter):
            self.scopes.append(_assigned(first.target, element))
            if all(self.value(condition) for condition in first.ifs):
                yield from self._produced(item, rest)
            self.scopes.pop()


def _assigned(target: ast.expr, element: Any) -> dict[str, Any]:
    if isinstance(target, ast.Name):
        _check_name(target.id)
        return {target.id: element}
    if not isinstance(target, ast.Tuple | ast.List):
        raise RefusedExpressionError("a comprehension must assign to names")
    pairs = zip(target.elts, element, strict=True)
    return {name: value for part, item in pairs for name, value in _assigned(part, item).items()}


def _check_name(name: str) -> None:
    if name.startswith("_"):
        raise RefusedExpressionError(f"a name must not start with an underscore: {name!r}")


def _is_hashable(found: Any) -> bool:
    return type(found).__hash__ is not None


def _check_size(kind: ast.operator, left: Any, right: Any) -> None:
    """Reject an operation whose result would fill the memory."""
    if isinstance(kind, ast.Mod) and isinstance(left, str):
        _check_widths(left, right if isinstance(right, tuple) else (right,))
    size = 0
    if isinstance(kind, ast.Pow) and isinstance(left, int) and isinstance(right, int):
        size = left.bit_length() * right
    elif isinstance(kind, ast.LShift) and isinstance(right, int):
        size = right
    elif isinstance(kind, ast.Mult):
        lengths = [len(side) for side in (left, right) if isinstance(side, str | list | tuple)]
        counts = [side for side in (left, right) if isinstance(side, int)]
        size = lengths[0] * counts[0] if lengths and counts else 0
    if size > MAX_SIZE:
        raise RefusedExpressionError(f"a result is larger than {MAX_SIZE}")


def _check_widths(text: str, values: Iterable[Any] = ()) -> None:
    widths = [int(digits) for digits in re.findall(r"\d+", text)]
    if "*" in text:
        widths += [abs(value) for value in values if isinstance(value, int)]
    if sum(widths) > MAX_SIZE:
        raise RefusedExpressionError(f"a result is larger than {MAX_SIZE}")
