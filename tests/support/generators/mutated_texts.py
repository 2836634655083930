"""Robot files with random mutations."""

import random
import re
from collections.abc import Callable

TOKEN = re.compile(r"[A-Za-z_]\w*|\d+\.?\d*(?:[eE][+-]?\d+)?|\s+|.", re.DOTALL)
NUMBER = re.compile(r"\d+\.?\d*(?:[eE][+-]?\d+)?")
WORD = re.compile(r"[A-Za-z_]\w*")
UNITS = {"mm": "m", "m": "mm", "deg": "rad", "rad": "deg", "cm": "inch"}
ODD_NUMBERS = (
    *("nan", "inf", "-inf", "NaN", "0", "-0.0", "1e30", "1e31", "1e-300", "1e999", "1e-999"),
    *("1.5707963267948966", "1.5708", "90", "-180", "3.14159", "0.1" + "0" * 58 + "1", "7" * 70),
)
FUNCTIONS = ("sin", "cos", "tan", "atan", "sqrt", "1/", "-", "2*")
MAX_NESTED = 40
GENTLE = 0.6
"""Fraction of mutations that change only a number."""
Tokens = list[str]


def mutated(text: str, dice: random.Random) -> str:
    for _ in range(dice.randint(1, 3)):
        wounds = NUMBERS_CHANGED if dice.random() < GENTLE else WOUNDS
        text = dice.choice(wounds)(text, dice) or text
    return text


def _on_tokens(change: Callable[[Tokens, int, random.Random], None]) -> "Wound":
    def wound(text: str, dice: random.Random) -> str:
        tokens = TOKEN.findall(text)
        change(tokens, dice.randrange(len(tokens)), dice)
        return "".join(tokens)

    return wound


def _on_lines(change: Callable[[Tokens, int, random.Random], None]) -> "Wound":
    def wound(text: str, dice: random.Random) -> str:
        lines = text.splitlines(keepends=True)
        change(lines, dice.randrange(len(lines)), dice)
        return "".join(lines)

    return wound


def _replaced(pattern: re.Pattern[str], new: Callable[[str, random.Random], str]) -> "Wound":
    def wound(text: str, dice: random.Random) -> str:
        found = list(pattern.finditer(text))
        if not found:
            return text
        match = dice.choice(found)
        return text[: match.start()] + new(match.group(), dice) + text[match.end() :]

    return wound


def _deleted(parts: Tokens, k: int, _: random.Random) -> None:
    del parts[k]


def _doubled(parts: Tokens, k: int, dice: random.Random) -> None:
    parts.insert(dice.randrange(len(parts) + 1), parts[k])


def _swapped(parts: Tokens, k: int, dice: random.Random) -> None:
    other = dice.randrange(len(parts))
    parts[k], parts[other] = parts[other], parts[k]


def _cut(parts: Tokens, k: int, dice: random.Random) -> None:
    at = dice.randrange(len(parts[k]) + 1)
    parts[k] = parts[k][:at] + chr(dice.randrange(1, 0x2FF)) + parts[k][at:]


def _nested(number: str, dice: random.Random) -> str:
    depth, function = dice.randint(1, MAX_NESTED), dice.choice(FUNCTIONS)
    return '"' + f"{function}(" * depth + number + ")" * depth + '"'


def _digit(number: str, dice: random.Random) -> str:
    k = dice.randrange(len(number))
    return number[:k] + dice.choice("0123456789.-e") + number[k + 1 :]


def _longer(number: str, dice: random.Random) -> str:
    point = "" if "." in number or "e" in number else "."
    return number + point + str(dice.randrange(10**17))


def _renamed(word: str, dice: random.Random) -> str:
    return dice.choice((f"{word}__x", f"{word}_", f"_{word}", word[:-1], word.upper(), "class"))


Wound = Callable[[str, random.Random], str]
NUMBERS_CHANGED: tuple[Wound, ...] = (
    _replaced(NUMBER, _digit),
    _replaced(NUMBER, _longer),
    _replaced(NUMBER, _nested),
    _replaced(NUMBER, lambda number, _: f"-{number}"),
    _replaced(NUMBER, lambda _, dice: dice.choice(ODD_NUMBERS)),
)
WOUNDS: tuple[Wound, ...] = (
    *(_on_tokens(change) for change in (_deleted, _doubled, _swapped)),
    *(_on_lines(change) for change in (_deleted, _doubled, _swapped, _cut)),
    _replaced(WORD, _renamed),
    _replaced(re.compile(r"\b(mm|m|cm|deg|rad)\b"), lambda unit, _: UNITS[unit]),
    _replaced(re.compile(r"units = .*\n"), lambda _line, _: ""),
    lambda text, dice: text[: dice.randrange(len(text) + 1)] or text,
)
