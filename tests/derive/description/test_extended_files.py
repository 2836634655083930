"""Robot files that extend others."""

import pytest
import sympy as sp

from chasles.derive import DescriptionError, load
from chasles.derive.build import freshness

# --- files that extend others ---

PARENT = """\
name = "short"
title = "Short arm"
source = "our shop"
convention = "dh"
units = { length = "mm" }

[parameters]
l = { value = 300, meaning = "arm" }
h = 20
n = { value = 2, unit = "1" }

[[joints]]
a = "n*l"
d = "h"
"""


def extended(tmp_path, text, parent=PARENT):
    (tmp_path / "short.toml").write_text(parent)
    child = tmp_path / "long.toml"
    child.write_text(text)
    return child


def test_a_file_that_extends_another(tmp_path):
    text = (
        'extends = "short.toml"\nname = "long"\ntitle = "Long arm"\n'
        "[parameters]\nl = { value = 450 }\nh = 25\nn = 3\n"
    )
    robot = load(extended(tmp_path, text))
    short = load(tmp_path / "short.toml")
    assert (robot.name, robot.title, robot.source) == ("long", "Long arm", "our shop")
    assert [p.value for p in robot.parameters] == [sp.Rational(9, 20), sp.Rational(1, 40), 3]
    assert [p.kind for p in robot.parameters] == [p.kind for p in short.parameters]
    assert robot.parameters[0].meaning == "arm"
    assert robot.joints == short.joints
    assert [p.value for p in short.parameters] == [sp.Rational(3, 10), sp.Rational(1, 50), 2]


@pytest.mark.parametrize(
    ("text", "line", "field", "words"),
    [
        ('extends = "short.toml"\n', None, "name", "it is missing"),
        ('name = "l"\nextends = 5\n', 2, "extends", "one line of text"),
        ('name = "l"\nextends = "no.toml"\n', 2, "extends", "no.toml: expected a readable file"),
        ('name = "l"\nextends = "long.toml"\n', 2, "extends", "a file that extends no other"),
        ('extends = "short.toml"\nname = "2"\n', 2, "name", "a letter"),
        ('extends = "short.toml"\nname = "l"\njoints = []\n', 3, "joints", "one of the fields"),
        ('extends = "short.toml"\nname = "l"\nparameters = 1\n', 3, "parameters", "a table"),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nm = 1\n',
            *(4, "parameters.m", "one of the parameters of"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nh = { value = 1, unit = "m" }\n',
            *(4, "parameters.h.unit", "one of the fields value"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\n\nl = "x"\n',
            *(5, "parameters.l.value", "a number"),
        ),
        (
            'extends = "short.toml"\nname = "l"\n[parameters]\nl = {}\n',
            *(4, "parameters.l.value", "the parameter's value"),
        ),
    ],
)
def test_a_wrong_extension(tmp_path, text, line, field, words):
    child = extended(tmp_path, text)
    with pytest.raises(DescriptionError) as caught:
        load(child)
    assert (caught.value.line, caught.value.field) == (line, field)
    assert caught.value.file == str(child)
    assert words in str(caught.value)


def test_what_is_wrong_with_the_extended_file_is_said_of_it(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "l"\n', PARENT + "alpha = true\n")
    with pytest.raises(DescriptionError, match=r"short.toml:15: joints\[1\].alpha"):
        load(child)


def test_an_extension_is_due_where_the_other_file_changed(tmp_path):
    child = extended(tmp_path, 'extends = "short.toml"\nname = "long"\n')
    folder = tmp_path / "out" / "long"
    folder.mkdir(parents=True)
    job = freshness.Job(child, folder.parent)
    assert not freshness.is_up_to_date(job)
    freshness.stamp(job, folder)
    assert freshness.is_up_to_date(job)
    (tmp_path / "short.toml").write_text(PARENT + "alpha = 1\n")
    assert not freshness.is_up_to_date(job)
    for broken in ('extends = "gone.toml"\n', "extends = 5\n", "extends = \n"):
        child.write_text(broken)
        assert not freshness.is_up_to_date(job)
