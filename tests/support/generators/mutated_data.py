"""Mutations of bytes, JSON values and NumPy archives, for tests of readers."""

import io
import json
import random
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np

ODD_VALUES: tuple[Any, ...] = (
    *(None, True, -1, 0, 2**63, 10**400, 1e308, float("nan"), float("inf"), "", "nan", "a/../b"),
    *("\0", "é" * 50, [], {}, [[]], [None], {"": 0}, [0] * 100),
)
BYTES = (
    b"\0",
    b"\xff",
    b"\xef\xbb\xbf",
    b"\r",
    b"\n",
    b'"',
    b"'",
    b"[",
    b"{",
    b"<",
    b"&",
    b"%s",
    b"-",
    b"9" * 400,
)
ODD_SCALARS: tuple[Any, ...] = (None, True, -1, 2**63, 10**400, float("nan"), "", "nan", "\0")
TYPES = ("c16", "i1", "?", "U3", "S2", ">f8", "f2", "M8[s]", "O")
"""Types of arrays."""
MAX_SPAN = 40
"""Maximum number of bytes that a mutation copies or deletes."""
NESTED = 3000
"""Nesting depth beyond Python's recursion limit."""


def mutated_bytes(content: bytes, dice: random.Random, other: bytes = b"") -> bytes:
    """Return bytes with one to four mutations.

    Args:
        content: The original.
        dice: Source of random values.
        other: Bytes from which a mutation may insert a part.
    """
    found = bytearray(content)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(found) + 1)
        end = at + dice.randrange(MAX_SPAN)
        kind = dice.randrange(6)
        if kind == 0 and at < len(found):
            found[at] ^= 1 << dice.randrange(8)
        elif kind == 1:
            found[at:at] = dice.choice(BYTES)
        elif kind == 2:
            del found[at:end]
        elif kind == 3:
            found[at:at] = found[at:end] * dice.randint(1, 3)
        elif kind == 4:
            start = dice.randrange(len(other) + 1)
            found[at:end] = other[start : start + dice.randrange(MAX_SPAN)]
        else:
            found = found[:at] if dice.random() < 0.2 else found
    return bytes(found)


def mutated_json(value: Any, dice: random.Random) -> Any:
    """Return a copy of a JSON value with one to three changed, deleted or repeated parts."""
    found = json.loads(json.dumps(value))
    for _ in range(dice.randint(1, 3)):
        places = list(_places(found))
        if places:
            _change(*dice.choice(places), dice)
    return found


def _places(value: Any) -> list[tuple[Any, Any]]:
    keys = value.keys() if isinstance(value, dict) else range(len(value))
    found = [(value, key) for key in keys]
    inner = [value[key] for key in keys if isinstance(value[key], dict | list)]
    return [*found, *(place for part in inner for place in _places(part))]


def _change(container: Any, key: Any, dice: random.Random) -> None:
    kind = dice.randrange(5)
    if kind == 0:
        del container[key]
    elif kind == 1 and isinstance(container, list):
        container.insert(key, container[key])
    elif kind == 2 and isinstance(container, dict):
        container[f"{key}x"] = container.pop(key)
    elif kind == 3 and container:
        keys = list(container) if isinstance(container, dict) else range(len(container))
        container[key] = json.loads(json.dumps(container[dice.choice(keys)]))
    else:
        container[key] = json.loads(json.dumps(dice.choice(ODD_VALUES)))


def mutated_json_text(text: bytes, dice: random.Random) -> bytes:
    """Return JSON text with mutated values, or rarely with extremely deep nesting."""
    if dice.random() < 0.001:
        return b"[" * NESTED
    return json.dumps(mutated_json(json.loads(text), dice)).encode()


def mutated_archive(content: bytes, dice: random.Random) -> bytes:
    """Return a NumPy archive with mutated arrays, array names or JSON texts."""
    with np.load(io.BytesIO(content)) as arrays:
        found = {name: arrays[name] for name in arrays.files}
    if "facts" in found and dice.random() < 0.5:
        facts = mutated_json(json.loads(str(found["facts"])), dice)
        found["facts"] = np.array(json.dumps(facts))
    for _ in range(dice.randrange(3)):
        name = dice.choice(sorted(found))
        if dice.random() < 0.2:
            array = found.pop(name)
            found |= {f"{name}x": array}
        else:
            found[name] = _mutated_array(found[name], dice)
    return _archive(found, dice)


def _mutated_array(array: np.ndarray[Any, Any], dice: random.Random) -> np.ndarray[Any, Any]:
    kind = dice.randrange(6)
    if kind == 0:
        return array[..., None]
    if kind == 1:
        return array.ravel()[: dice.randrange(array.size + 1)]
    if kind == 2:
        return np.array(dice.choice(ODD_SCALARS), dtype=dice.choice((None, "U", object)))
    if kind == 3 and array.dtype.kind in "fi":
        return array.astype(dice.choice(TYPES))
    if kind == 4:
        return np.concatenate([array.ravel(), array.ravel()])
    changed = array.copy()
    if changed.size and changed.dtype.kind == "f":
        odd = dice.choice((np.nan, np.inf, -np.inf, 1e308, -1.0, 0.0, 5e-324))
        changed.flat[dice.randrange(changed.size)] = odd
    return changed


def _archive(arrays: dict[str, np.ndarray[Any, Any]], dice: random.Random) -> bytes:
    stream = io.BytesIO()
    compression = ZIP_DEFLATED if dice.random() < 0.1 else ZIP_STORED
    with ZipFile(stream, "w", compression) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asanyarray(array), allow_pickle=True)
            content = member.getvalue()
            # The header of a NumPy array file is Python text, which NumPy evaluates.
            content = mutated_bytes(content, dice) if dice.random() < 0.05 else content
            archive.writestr(f"{name}.npy", content)
    return stream.getvalue()
