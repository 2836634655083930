"""Measurement tables from practice: column headings, orientation formats, missing headers."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from chasles.calibration import read_measurements
from chasles.errors import InputValueError

ROBOT = SimpleNamespace(
    n=6,
    coordinates=[
        SimpleNamespace(name=name, unit="rad")
        for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    ],
)
RANDOM = np.random.default_rng(0)
Q = RANDOM.uniform(-2.5, 2.5, (7, 6))
TOOLS = Rotation.random(7, random_state=0)
TARGETS = RANDOM.normal(size=(3, 3)) / 10
POINTS = np.stack([TOOLS.apply(t) for t in TARGETS], 1) + RANDOM.normal(size=(7, 1, 3))

JOINTS = (
    "q{}",
    "q{} [deg]",
    "J{}",
    "j{} (deg)",
    "J{}deg",
    "theta_{}[deg]",
    "Theta{} (°)",
    "Joint {} (deg)",
    "joint_{}",
    "joint_{}_deg",
    "JOINT{}_POS [degrees]",
    "Axis {} [deg]",
    "A{}",
    "a{}_deg",
    "Achse {} [Grad]",
    "rax_{}",
    "θ{} [deg]",
    "joint{}_angle_deg",
    "Joint Angle {} (deg)",
    "actual q{} [deg]",
    "q[{}]",
    "q({}) [deg]",
    "jointAngle{}",
    "meas_q{}",
    "motor {} deg",
    "Joint_{}_actual (degrees)",
)
PLACES = (
    "{0}{1}",
    "{0}{1} [mm]",
    "{2}{1} (mm)",
    "{0}_{1}_mm",
    "P{1}_{0} [mm]",
    "p{1}{0}",
    "target_{1}_{0} [mm]",
    "SMR{1}.{2} (mm)",
    "Target {1} {2} [millimeters]",
    "{0}_meas_{1}",
    "Marker{1}{2}",
    "T{1}_{0}",
    "tracker_{0}{1}_mm",
    "Nest {1} {2} [mm]",
    "{2}_SMR{1}",
    "ball{1} {0} mm",
    "measured {0}{1} (mm)",
)


def written(path, header, values, separator=",", decimal=".", before=()):
    rows = [[f"{v:.12f}".replace(".", decimal) for v in row] for row in values]
    lines = [*before, *([separator.join(header)] if header else []), *map(separator.join, rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


PAIRS = [(JOINTS[k % 26], PLACES[(k + k // 26) % 17]) for k in range(52)]
"""Each pair consists of a joint name and a target name."""


@pytest.mark.parametrize(("joints", "places"), PAIRS)
def test_joint_and_target_headings_are_recognized_in_any_column_order(tmp_path, joints, places):
    random = np.random.default_rng(len(joints) + 100 * len(places))
    header = [joints.format(k + 1) for k in range(6)]
    header += [places.format(a, j + 1, a.upper()) for j in range(3) for a in "xyz"]
    values = np.concatenate([np.degrees(Q), 1e3 * POINTS.reshape(7, 9)], 1)
    order = random.permutation(15)
    separator, decimal = [(",", "."), (";", ","), ("\t", "."), (" ; ", ".")][random.integers(4)]
    path = written(
        tmp_path / "t.csv", [header[k] for k in order], values[:, order], separator, decimal
    )
    measured = read_measurements(path, ROBOT)
    assert_allclose(measured.q, Q, atol=1e-12)
    assert_allclose(measured.measurements.points, POINTS, atol=1e-12)
    assert all("have no unit" in sentence for sentence in measured.assumptions)


NUMBERS = np.concatenate([np.degrees(Q), 1e3 * POINTS.reshape(7, 9)], 1)
NAMES = [f"J{k}" for k in range(1, 7)]
XYZ = ["x", "y", "z"]


@pytest.mark.parametrize(
    ("places", "said"),
    [
        ([*XYZ, *XYZ, *XYZ], "x, y and z occur 3 times"),
        ([*XYZ, *(f"{a}.{k}" for k in (1, 2) for a in "xyz")], ""),
        (
            [f"{name}_{a} [mm]" for name in ("left", "right", "top") for a in "xyz"],
            "1 left, 2 right",
        ),
        ([f"{a.upper()} {name}" for name in ("A", "B", "C") for a in "xyz"], "1 a, 2 b, 3 c"),
    ],
    ids=["repeated xyz", "dotted number", "named targets", "letter suffix"],
)
def test_targets_without_number_suffix_are_recognized(tmp_path, places, said):
    measured = read_measurements(written(tmp_path / "t.csv", [*NAMES, *places], NUMBERS), ROBOT)
    assert_allclose(measured.measurements.points, POINTS, atol=1e-12)
    assert said in " ".join(measured.assumptions)


@pytest.mark.parametrize(
    ("header", "place"),
    [
        (["S", "L", "U", "R", "B", "T"], "x"),
        ([c.name for c in ROBOT.coordinates], "X [mm]"),
        ([f"{c.name}_joint [deg]" for c in ROBOT.coordinates], "pos_x"),
        ([f"actual_q_{k}" for k in range(6)], "px"),
        ([f"q{k}" for k in range(6)], "tcp.x (mm)"),
    ],
    ids=["S L U R B T", "coordinate names", "_joint suffix", "actual_q_k", "q0 to q5"],
)
def test_manufacturer_joint_and_position_names_are_recognized(tmp_path, header, place):
    places = [place.replace("x", a).replace("X", a) for a in "xyz"]
    path = written(tmp_path / "t.csv", [*header, *places], NUMBERS[:, :9])
    table = read_measurements(path, ROBOT)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=1e-12)
    assert_allclose(found.points, POINTS[:, :1], atol=1e-12)


def test_commanded_or_computed_columns_are_not_read_as_measurements(tmp_path):
    aims, fk = [f"target_q_{k}" for k in range(6)], [f"{a}_nominal" for a in "xyz"]
    errors = ["error_x [mm]", "std x"]
    off = 7 + NUMBERS[:, :9]
    table = np.concatenate([off, off[:, :2], NUMBERS[:, :9]], 1)
    header = [*aims, *fk, *errors, *NAMES, *XYZ]
    table = read_measurements(written(tmp_path / "t.csv", header, table), ROBOT)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=1e-12)
    assert_allclose(found.points, POINTS[:, :1], atol=1e-12)
    alone = written(tmp_path / "t.csv", [*aims, *XYZ], NUMBERS[:, :9])
    measured = read_measurements(alone, ROBOT)
    assert_allclose(measured.q, Q, atol=1e-12)
    assert "commanded, not measured" in " ".join(measured.assumptions)
    with pytest.raises(InputValueError, match="no positions"):
        read_measurements(written(tmp_path / "t.csv", [*NAMES, *fk], NUMBERS[:, :9]), ROBOT)


R = TOOLS.as_matrix()
wxyz = TOOLS.as_quat(scalar_first=True)
ORIENTATIONS = {
    "ABB": ([f"q{k}" for k in range(1, 5)], wxyz),
    "from 0": ([f"q{k}" for k in range(4)], wxyz),
    "w last": (["qx", "qy", "qz", "qw"], np.roll(wxyz, -1, 1)),
    "ROS": ([f"pose.orientation.{c}" for c in "xyzw"], np.roll(wxyz, -1, 1)),
    "vector": (["Rx [rad]", "Ry [rad]", "Rz [rad]"], TOOLS.as_rotvec()),
    "vector in degrees": (["rx", "ry", "rz"], TOOLS.as_rotvec(degrees=True)),
    "roll": (["Roll (deg)", "Pitch (deg)", "Yaw (deg)"], TOOLS.as_euler("xyz", degrees=True)),
    "FANUC": (["W", "P", "R"], TOOLS.as_euler("xyz", degrees=True)),
    "KUKA": (["A", "B", "C"], TOOLS.as_euler("ZYX", degrees=True)),
    "matrix": ([f"r{i}{j}" for i in "123" for j in "123"], R.reshape(7, 9)),
    "matrix from 0": ([f"m_{i}_{j}" for i in "012" for j in "012"], R.reshape(7, 9)),
    "brackets": ([f"R[{i}][{j}]" for i in "012" for j in "012"], R.reshape(7, 9)),
    "Paul": ([f"{c}{a}" for c in "noa" for a in "xyz"], R.swapaxes(1, 2).reshape(7, 9)),
}


@pytest.mark.parametrize("form", ORIENTATIONS)
@pytest.mark.parametrize("separator", [",", ";"])
def test_orientation_columns_match_scipy_in_every_format(tmp_path, form, separator):
    header, values = ORIENTATIONS[form]
    table = np.concatenate([values, NUMBERS[:, :9]], 1)
    path = written(tmp_path / "t.csv", [*header, *NAMES, *XYZ], table, separator)
    measured = read_measurements(path, ROBOT)
    assert_allclose(measured.measurements.T[:, :3, :3], R, atol=1e-10)
    assert_allclose(measured.measurements.T[:, :3, 3], POINTS[:, 0], atol=1e-12)
    assert_allclose(measured.q, Q, atol=1e-12)
    assert "are interpreted as" in " ".join(measured.assumptions)


def test_flattened_4x4_matrix_rows_are_read_and_checked(tmp_path):
    T = np.zeros((7, 4, 4))
    T[:, :3, :3], T[:, :3, 3], T[:, 3, 3] = R, 1e3 * POINTS[:, 0], 1
    header = [*(f"T{i}{j}" for i in range(1, 5) for j in range(1, 5)), *NAMES]
    path = written(tmp_path / "t.csv", header, np.concatenate([T.reshape(7, 16), np.degrees(Q)], 1))
    found = read_measurements(path, ROBOT).measurements
    assert_allclose(found.T[:, :3, 3], POINTS[:, 0], atol=1e-12)
    assert_allclose(found.T[:, :3, :3], R, atol=1e-10)
    T[3, 0, 0] += 0.1
    path = written(tmp_path / "t.csv", header, np.concatenate([T.reshape(7, 16), np.degrees(Q)], 1))
    with pytest.raises(InputValueError, match="line 5: the matrix is not a rotation"):
        read_measurements(path, ROBOT)


@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_missing_units_are_inferred_from_magnitude(tmp_path, unit):
    q = np.degrees(Q) if unit == "deg" else Q
    path = written(tmp_path / "t.csv", [*NAMES, *XYZ], np.concatenate([q, NUMBERS[:, 6:9]], 1))
    measured = read_measurements(path, ROBOT)
    assert_allclose(measured.q, Q, atol=1e-12)
    assert f"joint angles have no unit; their values suggest {unit}" in measured.assumptions
    assert "positions have no unit; their values suggest mm" in measured.assumptions


def test_ambiguous_unit_is_rejected(tmp_path):
    path = written(
        tmp_path / "t.csv", [*NAMES, *XYZ], np.concatenate([Q / 100, NUMBERS[:, 6:9]], 1)
    )
    with pytest.raises(
        InputValueError,
        match=r"'J1' has no unit; expected one of the units rad, mrad, deg, °, as in 'J1 .rad.'",
    ):
        read_measurements(path, ROBOT)
    path = written(tmp_path / "t.csv", [*NAMES, *XYZ], np.concatenate([Q, POINTS[:, 0]], 1))
    with pytest.raises(
        InputValueError,
        match=r"'x' has no unit; expected one of the units m, mm, cm, um, inch, as in 'x .m.'",
    ):
        read_measurements(path, ROBOT)


INDEX = np.arange(1.0, 8)[:, None]


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("first", ["joints", "places"])
@pytest.mark.parametrize("numbered", [False, True])
@pytest.mark.parametrize("separator", [",", " ", "\t"])
def test_table_without_header_is_read(tmp_path, count, first, numbered, separator):
    q, places = np.degrees(Q), 1e3 * POINTS[:, :count].reshape(7, -1)
    parts = [q, places] if first == "joints" else [places, q]
    table = np.concatenate([*([INDEX] if numbered else []), *parts], 1)
    measured = read_measurements(written(tmp_path / "t.csv", [], table, separator), ROBOT)
    assert_allclose(measured.q, Q, atol=1e-12)
    assert_allclose(measured.measurements.points, POINTS[:, :count], atol=1e-12)
    assert "there is no header; the columns are assumed to be " in measured.assumptions[0]


@pytest.mark.parametrize(
    "table",
    [
        np.concatenate([np.degrees(Q), 1e3 * POINTS[:, 0], TOOLS.as_rotvec(degrees=True)], 1),
        np.concatenate([np.degrees(Q), 1e3 * POINTS[:, 0], wxyz], 1),
        NUMBERS[:, :8],
        NUMBERS[:2],
    ],
    ids=["rotation vector", "quaternion", "missing column", "two rows"],
)
def test_ambiguous_table_without_header_is_rejected(tmp_path, table):
    """The tables lack a column or have too few rows."""
    with pytest.raises(InputValueError, match=r"contains numbers.*write a header with"):
        read_measurements(written(tmp_path / "t.csv", [], table), ROBOT)


@pytest.mark.parametrize(
    "before",
    [
        ["Laser tracker report", "Date; 1 May", ""],
        ["# remarks", "\ufeff# more"],
        ["Robot: arm no. 7", "Operator: nobody"],
    ],
    ids=["title lines", "hash comments", "colon lines"],
)
def test_titles_and_comments_before_header_are_skipped(tmp_path, before):
    path = written(tmp_path / "t.csv", [*NAMES, *XYZ], NUMBERS[:, :9], before=before)
    assert_allclose(read_measurements(path, ROBOT).q, Q, atol=1e-12)


def test_header_written_by_numpy_savetxt_is_read(tmp_path):
    path = tmp_path / "t.txt"
    np.savetxt(path, NUMBERS[:, :9], header=" ".join([*NAMES, *XYZ]))
    assert_allclose(read_measurements(path, ROBOT).measurements.points, POINTS[:, :1], atol=1e-12)


@pytest.mark.parametrize(
    ("cell", "value"),
    [
        ("1,234.5", 1234.5),
        ("1.234,5", 1234.5),
        ("\u221212,5", -12.5),
        (" +3.5e1 ", 35.0),
        (".5", 0.5),
    ],
)
def test_decimal_and_thousands_separators_are_parsed(tmp_path, cell, value):
    rows = [[*map(str, np.degrees(q)), cell, "250", "30"] for q in Q]
    path = tmp_path / "t.csv"
    path.write_text("\n".join(map(";".join, [[*NAMES, "x [mm]", "y [mm]", "z [mm]"], *rows])))
    points = read_measurements(path, ROBOT).measurements.points
    assert_allclose(points[:, 0, 0], value / 1e3, rtol=1e-15)


@pytest.mark.parametrize(
    "cell", ["1,2,3", "12a", "1.2.3", "12,34.5", "0x10", "1e", "--5", "1_000", "5,"]
)
def test_malformed_number_error_names_line_and_column(tmp_path, cell):
    rows = [[*map(str, np.degrees(q)), "100", "250", "30"] for q in Q]
    rows[4][6] = cell
    path = tmp_path / "t.csv"
    path.write_text("\n".join(map(";".join, [[*NAMES, "x [mm]", "y [mm]", "z [mm]"], *rows])))
    with pytest.raises(InputValueError, match=r"t.csv, line 6: 'x': expected a number, got"):
        read_measurements(path, ROBOT)


@pytest.mark.parametrize("heading", ["y (mm)³", "y² [mm]", "[²]"])
def test_superscripts_in_a_heading_are_no_numbers(tmp_path, heading):
    path = tmp_path / "t.csv"
    header = [*NAMES, "x [mm]", heading, "z [mm]"]
    rows = [[*map(str, np.degrees(q)), "100", "250", "30"] for q in Q]
    path.write_text("\n".join(map(";".join, [header, *rows])), encoding="utf-8")
    with pytest.raises(InputValueError, match=r"t\.csv"):
        read_measurements(path, ROBOT)


def test_damaged_table_raises_only_input_value_error(tmp_path):
    random, refused = np.random.default_rng(5), 0
    for k in range(52):
        header = [JOINTS[k % 26].format(i + 1) for i in range(6)]
        header += [PLACES[k % 17].format(a, j + 1, a.upper()) for j in range(3) for a in "xyz"]
        separator = ",;\t |"[random.integers(5)]
        path = written(tmp_path / "t.csv", header if k % 5 else [], NUMBERS, separator)
        text = list(path.read_text(encoding="utf-8"))
        for _ in range(random.choice([1, 2, 20])):
            at = int(random.integers(len(text)))
            text[at] = random.choice(
                ["", "x", ",", ";", '"', "\n", "#", "[", ")", ".", "-", " ", "\0"]
            )
            if random.random() < 0.1:
                del text[at : at + int(random.integers(300))]
        path.write_text("".join(text) or "x", encoding="utf-8")
        try:
            read_measurements(path, ROBOT)
        except InputValueError as error:
            refused += "t.csv" in str(error)
    assert 26 < refused < 52


def test_spreadsheet_file_is_rejected_with_hint(tmp_path):
    path = tmp_path / "t.xlsx"
    path.write_bytes(b"PK\x03\x04rest")
    with pytest.raises(InputValueError, match="a spreadsheet; save the table as text"):
        read_measurements(path, ROBOT)
