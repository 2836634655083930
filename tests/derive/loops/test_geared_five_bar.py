"""Tests a geared five-bar linkage: file reader, LaTeX article, mobility and calibration."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import chasles
from chasles.calibration.calibrated_file import mechanism_text
from chasles.contract import keeps_full_turns
from chasles.derive import Coupling, DescriptionError, derive, mobility, read_text, write
from chasles.derive.description.chain_between import between
from chasles.derive.emit.seeds import wraps_of
from chasles.derive.inverse.explanation import mechanism_in_words
from chasles.derive.latex import fragments
from tests.support.compiling import compiled_quickly
from tests.support.loops.closed_in_numbers import Model

FILE = Path(__file__).with_name("geared_five_bar.toml")
TEXT = FILE.read_text(encoding="utf-8")
COUPLING = 'crank2 = { crank = "-z_left / z_right", offset = 30 }'
BEFORE_RIGHT = 'axis = [0, 0, 1]\n\n[[joints]]\nname = "right"'
MIMIC = 'mimic = { joint = "crank", multiplier = "-1/2", offset = 30 }'


def test_mimic_of_a_joint_is_the_same_coupling():
    other = TEXT.replace(f"[couplings]\n{COUPLING}", "").replace(
        BEFORE_RIGHT, BEFORE_RIGHT.replace("]\n\n", f"]\n{MIMIC}\n\n")
    )
    assert read_text(other).couplings == read_text(TEXT).couplings
    assert other.count("mimic") == 1


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ("crank3 = { crank = 2 }", r"couplings.crank3: expected a moving joint or a cylinder"),
        ("crank2 = { motor = 2 }", r"a gear or a shaft with its own angle is a revolute joint"),
        ("crank2 = { crank2 = 1, crank = 2 }", r"a joint has no coordinate of its own"),
        ("crank2 = { crank = 0 }", r"couplings.crank2.crank: expected a nonzero ratio"),
        (
            "left = { right = 1 }\ncrank2 = { crank = 3 }\ncrank = { crank2 = '1/3', offset = 10 }",
            ":46: couplings.crank: expected equations with a solution .no joint values "
            "fulfill the couplings of crank2, crank at the same time; correct or delete one",
        ),
    ],
)
def test_wrong_coupling_is_refused_by_name(changed, words):
    with pytest.raises(DescriptionError, match=words):
        read_text(TEXT.replace(COUPLING, changed))


def test_coupling_that_repeats_the_actuation_is_refused():
    two = TEXT.replace('actuated = ["crank"]', 'actuated = ["crank", "crank2"]')
    with pytest.raises(DescriptionError, match="crank and crank2 depend on each other"):
        derive(read_text(two), functions=("fk",))
    impossible = TEXT.replace(COUPLING, f"{COUPLING}\nright = {{ left = 1 }}")
    with pytest.raises(DescriptionError, match="0 degrees of freedom"):
        derive(read_text(impossible), functions=("fk",))


def test_article_and_explanation_state_the_coupling():
    derivation = derive(read_text(TEXT), functions=("fk", "constraint"))
    assert derivation.hybrid.forward.coupled == ("crank2",)
    pages = fragments(derivation)
    assert any("Couplings between joints are" in page for page in pages.values())
    assert "With the couplings, these are 3 equations" in pages["loops.tex"]
    assert "crank2 (coupling, 1 equation): crank2, crank" in mechanism_in_words(derivation.hybrid)


def test_gear_pair_counts_as_a_joint_of_the_mobility_formulas():
    found = mobility(read_text(TEXT))
    assert (found.true, found.kutzbach, found.by_loops) == (1, 1, 1)
    assert found.disagreements == ()


def test_chain_between_links_keeps_the_gears_of_its_loops():
    whole = read_text(TEXT)
    assert between(whole, "0", "right", "").couplings == whole.couplings
    assert between(whole, "0", "crank", "").couplings == whole.couplings


def test_full_turn_of_a_coordinate_turns_its_followers_in_part():
    half, whole = read_text(TEXT), read_text(TEXT.replace("/ z_right", "/ 20"))
    wraps = [derive(robot, functions=("fk",)) for robot in (half, whole)]
    assert [wraps_of(derivation) for derivation in wraps] == [[False], [True]]


@pytest.mark.parametrize(
    ("rows", "turning"),
    [
        ([[-2.0, 1.0, 0.0]], True),
        ([[3.0, 1.0, 0.0]], True),
        ([[1.0, -1 / 49, 0.0]], True),
        ([[1.0, 2.0, 0.0]], False),
        ([[-2.0, 1.0, 0.0], [0.0, 1.0, -2.0]], True),
        ([[-3.0, 1.0, 0.0], [0.0, 1.0, -2.0]], False),
    ],
)
def test_full_turn_is_kept_by_whole_numbers_of_turns(rows, turning):
    """Each row contains the factors of a weighted sum of joint angles that stays constant."""
    assert keeps_full_turns(0, rows, (True,) * 3) == turning


def test_contradictory_couplings_in_python_are_refused():
    robot = read_text(TEXT)
    back = Coupling("crank", (("crank2", -2),))
    repeated = Coupling("crank", (("crank2", -2),), sp.pi / 3)
    assert replace(robot, couplings=(*robot.couplings, repeated)).couplings[-1] is repeated
    message = "robot 'geared_five_bar': no joint values fulfill the couplings of crank2, crank at"
    with pytest.raises(DescriptionError, match=message):
        replace(robot, couplings=(*robot.couplings, back))


def test_joint_named_offset_is_refused():
    text = TEXT.replace('"left"', '"offset"').replace("offset = 30", "crank2 = 1")
    with pytest.raises(DescriptionError, match="another name for the joint 'offset'"):
        read_text(text)


def test_calibrated_file_of_geared_linkage_moves_like_its_parameters(tmp_path):
    """A NumPy model of the calibrated robot file gives the same tool poses as ``fk_p``."""
    write(read_text(TEXT), tmp_path / "r", functions=("fk",), parametric=True, languages=("c",))
    with compiled_quickly():
        robot = chasles.load(tmp_path / "r")
        names = [item.name for item in robot.geometry]
        assert {"crank_offset", "crank2_offset"} <= {*names}
        out_of_plane = ("rpy_x", "rpy_y", "xyz_z")
        varies = [
            item.part != "transmission" and not item.name.endswith(out_of_plane)
            for item in robot.geometry
        ]
        nominal = np.array([item.value for item in robot.geometry])
        p = nominal + 2e-3 * np.array(varies) * np.random.default_rng(0).uniform(
            -1, 1, len(nominal)
        )
        text = mechanism_text(robot, p, "built", "test", "")
        model = Model(read_text(text))
        for angle in (0.0, 0.2, -0.3):
            q = model.q + angle
            T = model.tip(q, model.followed(q)[0])
            assert np.abs(robot.fk_p(q, p) - T).max() < 1e-11
