"""Malformed robot files raise a clear error without a traceback or output files."""

import random

import pytest

from chasles.derive import DescriptionError, read
from chasles.derive.build.time_limit import at_most
from tests.support.command_line import run
from tests.support.derivations import NAMES, ROBOTS

MALFORMED = 150
COMMANDS = 30
ENDLESS_SECONDS = 60.0
JUNK = (
    "",
    "=",
    "[",
    "]]",
    '"',
    "nan",
    "-inf",
    "1e999999999",
    "9" * 5000,
    "0x10",
    "0x" + "f" * 5000,
    "1e" + "9" * 30,
    "true",
    "1979-05-27",
    "[[[]]]",
    "{}",
    "{ a = { b = 1 } }",
    '"9**9**9"',
    '"1/0"',
    '"..."',
    '"1/(sqrt(2)-sqrt(2))"',
    '"1e30**12"',
    '"a" * 3',
    '"' + "(" * 190 + '"',
    '"__import__(\\"os\\")"',
    '"lambda: 0"',
    '"\\u0000"',
    '"é"',
    '"' + "x" * 10_000 + '"',
    "[" * 2000,
    "[" + "1," * 5000 + "]",
    "'''",
)


def mutated(text: str, dice: random.Random) -> bytes:
    content = text
    for _ in range(dice.randint(1, 3)):
        lines = content.splitlines()
        k = dice.randrange(len(lines))
        wound = dice.randrange(9)
        if wound == 0:
            del lines[k]
        elif wound == 1:
            lines.insert(dice.randrange(len(lines)), lines[k])
        elif wound == 2:
            lines = lines[:k] or [""]
        elif wound == 3:
            lines[k] = f"{lines[k].split('=')[0]}= {dice.choice(JUNK)}"
        elif wound == 4:
            lines[k] = lines[k].replace("a", dice.choice("bxq_"), 1)
        elif wound == 5:
            lines[k] = dice.choice(JUNK)
        elif wound == 6:
            lines[k] = lines[k].replace('"', "", 1)
        elif wound == 7:
            other = dice.randrange(len(lines))
            lines[k], lines[other] = lines[other], lines[k]
        else:
            cut = dice.randrange(len(lines[k]) + 1)
            lines[k] = lines[k][:cut] + chr(dice.randrange(1, 0x2FF)) + lines[k][cut:]
        content = "\n".join(lines) or "\n"
    encoded = bytearray(content.encode())
    if dice.random() < 0.1:
        encoded[dice.randrange(len(encoded))] = dice.randrange(256)
    return bytes(encoded)


def test_malformed_files_raise_short_errors_quickly(tmp_path):
    dice = random.Random(20_240_607)
    texts = [(ROBOTS / f"{name}.toml").read_text() for name in NAMES]
    path = tmp_path / "wounded.toml"
    refused = survived = 0
    while refused < MALFORMED:
        path.write_bytes(mutated(dice.choice(texts), dice))
        try:
            with at_most(ENDLESS_SECONDS):
                read(path)
            survived += 1
        except DescriptionError as error:
            refused += 1
            message = str(error)
            assert message.startswith(str(path))
            assert "expected" in message
            assert "Traceback" not in message
            assert len(message) < 1000
    assert refused == MALFORMED
    assert survived > 0
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("verb", [("check",), ("derive", "--to", "out")])
@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("joints = " + "[" * 100_000, "fewer brackets in brackets"),
        (".".join("a" * 1000) + " = 1", "keys of at most 20 parts"),
        ("[" + " . ".join(["a", "-1", '"b.c"', "'d e'"] * 6) + "]", "keys of at most 20 parts"),
        (f"parameters = {{ L = {'9' * 10_000} }}", "a number with fewer digits"),
    ],
    ids=["brackets", "dotted key", "header", "digits"],
)
def test_nested_files_are_refused_at_their_line(line, expected, verb, tmp_path):
    path = tmp_path / "nested.toml"
    path.write_text(f'name = "nested"\n{line}\n')
    done = run(verb[0], path, *verb[1:])
    assert done.exit_code == 1
    assert f"{path}:2: expected {expected}\n" in done.output
    assert "Traceback" not in done.output


def test_the_command_writes_nothing_for_a_malformed_file(tmp_path):
    dice = random.Random(5)
    text = (ROBOTS / "ur5e.toml").read_text()
    path, to = tmp_path / "wounded.toml", tmp_path / "out"
    refused = 0
    while refused < COMMANDS:
        path.write_bytes(mutated(text, dice))
        try:
            read(path)
        except DescriptionError:
            done = run("derive", path, "--to", to)
            assert done.exit_code == 1
            assert "Traceback" not in done.output
            assert "nothing was written" in done.output
            refused += 1
    assert refused == COMMANDS
    assert not to.exists()
