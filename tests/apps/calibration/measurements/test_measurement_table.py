"""Measurement tables with every form of header. Wrong tables raise errors."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chasles import se3, so3
from chasles.calibration import Poses, Positions, read_measurements
from chasles.errors import InputValueError


@pytest.fixture
def write(tmp_path):
    def written(header, rows, delimiter=","):
        path = tmp_path / "measured.csv"
        with path.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, delimiter=delimiter).writerows([header, *rows])
        return path

    return written


Q = np.random.default_rng(0).uniform(-2, 2, (5, 6))
HEADER = [f"q{k + 1} [deg]" for k in range(6)]


def test_missing_targets_are_read_as_nan(arm, write):
    points = np.random.default_rng(1).normal(size=(5, 2, 3))
    header = [*HEADER, *(f"{axis}{j} (mm)" for j in (1, 2) for axis in "xyz"), "remark"]
    rows = [[*q, *y.ravel(), "good"] for q, y in zip(np.degrees(Q), 1e3 * points, strict=True)]
    rows[2][6:9] = ["", "", ""]
    table = read_measurements(write(header, rows), arm)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=1e-15)
    assert isinstance(found, Positions)
    points[2, 0] = np.nan
    assert_allclose(found.points, points, atol=1e-15)
    assert found.labels[4] == "measurement 3, target 2"


def test_one_row_per_target_table_accepts_robot_coordinate_names(arm, write):
    points = np.random.default_rng(1).normal(size=(5, 3, 3))
    header = [*(f"{c.name} [rad]" for c in arm.coordinates), "target", "x [m]", "y [m]", "z [m]"]
    rows = [
        [*map(repr, map(float, q)), name, *map(repr, map(float, y))]
        for q, own in zip(Q, points, strict=True)
        for name, y in zip("ABC", own, strict=True)
    ]
    table = read_measurements(write(header, rows, ";"), arm)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=0)
    assert_allclose(found.points, points, atol=0)


def turns(R, form):
    if form == "rotation vector":
        return ["rx [deg]", "ry [deg]", "rz [deg]"], np.degrees(so3.log(R))
    if form == "roll, pitch and yaw":
        pitch = np.arcsin(-R[2, 0])
        roll, yaw = np.arctan2(R[2, 1], R[2, 2]), np.arctan2(R[1, 0], R[0, 0])
        return ["roll [mrad]", "pitch [mrad]", "yaw [mrad]"], 1e3 * np.array([roll, pitch, yaw])
    vector = so3.log(R)
    angle = np.linalg.norm(vector)
    axis = vector / angle if angle else vector
    return ["qw", "qx", "qy", "qz"], -2 * np.array([np.cos(angle / 2), *np.sin(angle / 2) * axis])


@pytest.mark.parametrize("form", ["rotation vector", "roll, pitch and yaw", "quaternion"])
def test_pose_orientation_formats_are_read(arm, write, form):
    T = se3.exp(np.random.default_rng(2).normal(size=(5, 6)))
    T[0, :3, :3] = np.eye(3)
    rows = []
    for q, pose in zip(Q, T, strict=True):
        names, values = turns(pose[:3, :3], form)
        rows.append([*np.degrees(q), *pose[:3, 3], *values])
    table = read_measurements(write([*HEADER, "x [m]", "y [m]", "z [m]", *names], rows), arm)
    q, found = table.q, table.measurements
    assert isinstance(found, Poses)
    assert_allclose(found.T, T, atol=1e-14)


def test_quaternion_headings_are_recognized_and_norms_are_checked(arm, write):
    T = se3.exp(np.random.default_rng(2).normal(size=(5, 6)))
    rows = [
        [*np.degrees(q), *pose[:3, 3], *turns(pose[:3, :3], "")[1]]
        for q, pose in zip(Q, T, strict=True)
    ]
    names = ["Quat_w", "quaternion x", "q_y", "qz"]
    header = [*HEADER, "x [m]", "y [m]", "z [m]", *names]
    assert_allclose(read_measurements(write(header, rows), arm).measurements.T, T, atol=1e-14)
    rows[3][-1] = 7.0
    with pytest.raises(
        InputValueError,
        match="line 5: the quaternion has another length than the quaternions in other rows: "
        r"7.* instead of 2;",
    ):
        read_measurements(write(header, rows), arm)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda h, r: (h[1:], r),
            "no column for coordinate 'shoulder_pan'; expected 'shoulder_pan",
        ),
        (
            lambda h, r: (["q1", *h[1:]], r),
            "'q1' has no unit; expected one of the units rad, mrad, deg, °, as in 'q1 .rad.'",
        ),
        (
            lambda h, r: (["q1 [mm]", *h[1:]], r),
            "'q1' has unit 'mm'; expected one of the units rad, mrad, deg, °, as in 'q1 .rad.'",
        ),
        (lambda h, r: ([*h[:-1], "height [m]"], r), "no positions; expected columns x, y, z"),
        (lambda h, r: (h, [["x", *r[0][1:]]]), "line 2: 'q1': expected a number, got 'x'"),
        (
            lambda h, r: (h, [r[0], ["inf", *r[0][1:]]]),
            "line 3: 'q1': expected a number, got 'inf'",
        ),
        (lambda h, r: (["q2 [deg]", *h[1:]], r), "two columns have the name 'q2'"),
    ],
    ids=[
        "missing joint",
        "no unit",
        "wrong unit",
        "no positions",
        "text cell",
        "infinite cell",
        "duplicate column",
    ],
)
def test_invalid_table_error_names_column_and_expectation(arm, write, change, message):
    header, rows = change([*HEADER, "x [m]", "y [m]", "z [m]"], [[1.0] * 9])
    with pytest.raises(InputValueError, match=message):
        read_measurements(write(header, rows), arm)


POINTS = np.random.default_rng(3).normal(size=(5, 2, 3))
TARGET = [f"{axis}{j} [mm]" for j in (1, 2) for axis in "xyz"]
HEADERS = {
    "units behind underscores": (
        [f"q{k}_deg" for k in range(1, 7)],
        [t[:2] + "_mm" for t in TARGET],
    ),
    "theta": ([f"theta{k} (deg)" for k in range(1, 7)], [f"{t[0]}_{t[1]} (mm)" for t in TARGET]),
    "points": ([f"Joint {k} [deg]" for k in range(1, 7)], [f"P{t[1]}_{t[0]} [mm]" for t in TARGET]),
    "targets": ([f"J{k} [°]" for k in range(1, 7)], [f"target_{t[1]}_{t[0]}_mm" for t in TARGET]),
    "from zero": ([f"q{k} deg" for k in range(6)], [f"{t[0].upper()}{t[1]} mm" for t in TARGET]),
}


@pytest.mark.parametrize("style", HEADERS)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_headers_of_other_programs_are_read_in_any_column_order(arm, tmp_path, style, separator):
    joints, targets = HEADERS[style]
    header = ["id", *targets, *reversed(joints)]
    lines = ["# a tracker", "", separator.join(header)]
    for k in range(5):
        numbers = [k + 1, *1e3 * POINTS[k].ravel(), *np.degrees(Q[k])[::-1]]
        cells = [repr(float(number)) for number in numbers]
        if k == 3:
            cells[4:7] = ["", "NaN", "-"]
        text = separator.join(cells)
        lines += [text if separator == "," else text.replace(".", ","), separator * 12]
    path = tmp_path / "measured.csv"
    path.write_text("\ufeff" + "\r\n".join(lines), encoding="utf-8")
    table = read_measurements(path, arm)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=1e-14)
    expected = POINTS.copy()
    expected[3, 1] = np.nan
    assert_allclose(found.points, expected, atol=1e-14)


def test_one_row_per_target_table_is_read_in_any_row_order(arm, write):
    rows = [
        [name, *np.degrees(q), *y]
        for j, name in enumerate("AB")
        for q, y in zip(Q, POINTS[:, j], strict=True)
    ]
    again = ["A", *np.degrees(Q[2]), 1.0, 2.0, 3.0]
    header = ["Marker", *HEADER, "x [m]", "y [m]", "z [m]"]
    table = read_measurements(write(header, [*rows, again]), arm)
    q, found = table.q, table.measurements
    assert_allclose(q, [*Q, Q[2]], atol=1e-14)
    assert_allclose(found.points[:5], POINTS, atol=0)
    assert_allclose(found.points[5], [[1, 2, 3], [np.nan] * 3])


def test_table_without_rows_is_rejected(arm, write):
    with pytest.raises(InputValueError, match="a header but no rows"):
        read_measurements(write([*HEADER, "x [m]", "y [m]", "z [m]"], []), arm)


def test_empty_file_is_rejected(arm, tmp_path):
    path = tmp_path / "empty.csv"
    path.write_text("")
    with pytest.raises(InputValueError, match="empty; expected a header"):
        read_measurements(path, arm)


SEEN = np.random.default_rng(3).normal(size=(5, 3))
PLACES = ["x [mm]", "y [mm]", "z [mm]"]
CELLS = [
    [*map(repr, map(float, q)), *map(repr, map(float, x))]
    for q, x in zip(np.degrees(Q), 1e3 * SEEN, strict=True)
]
TABLE = "\n".join(map(",".join, [[*HEADER, *PLACES], *CELLS]))
BARE, ROWS = "q1,q2,q3,q4,q5,q6,x,y,z", [",".join(row) for row in CELLS]


@pytest.mark.parametrize(
    ("written", "encoding"),
    [
        (TABLE, "utf-8-sig"),
        (TABLE.replace("deg", "°"), "utf-16"),
        (TABLE.replace("deg", "°"), "cp1252"),
        (TABLE.replace("deg", "degrees").replace("mm", "millimeters"), "utf-8"),
        (TABLE.replace(",", ";").replace(".", ","), "utf-8"),
        (TABLE.replace("deg", "Grad").replace("q", "Achse "), "utf-8"),
        (TABLE.replace(" [deg]", "_actual [deg]"), "utf-8"),
        (TABLE.replace(" [deg]", "").replace(" [mm]", ""), "utf-8"),
        (TABLE.replace(" [deg]", ""), "utf-8"),
        (TABLE.replace(" [deg]", "").replace(" [mm]", "").replace(",", "  "), "utf-8"),
        (TABLE.replace(",", "|"), "utf-8"),
        (TABLE.replace(",", " , ").replace("q1 [deg]", '"q1 [deg]"'), "utf-8"),
        ("\n".join([BARE, ",".join(["deg"] * 6 + ["mm"] * 3), *ROWS]), "utf-8"),
        ("\n".join([BARE, ",".join(["[Deg]"] * 6 + ["(mm)"] * 3), *ROWS]), "utf-8"),
    ],
    ids=[
        "utf-8 bom",
        "utf-16",
        "cp1252",
        "unit words",
        "decimal comma",
        "german headings",
        "actual suffix",
        "no units",
        "joint units missing",
        "space separated",
        "bar separated",
        "quoted cells",
        "unit row",
        "bracketed unit row",
    ],
)
def test_tables_in_common_encodings_and_formats_are_read(arm, tmp_path, written, encoding):
    path = tmp_path / "measured.csv"
    path.write_bytes(written.encode(encoding))
    table = read_measurements(path, arm)
    q, found = table.q, table.measurements
    assert_allclose(q, Q, atol=1e-15)
    assert_allclose(found.points[:, 0], SEEN, atol=1e-15)


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("\n".join(map(",".join, CELLS[:2])), "first line contains numbers"),
        (TABLE.replace(",", "~"), "one column.*commas, semicolons or tabs"),
        (
            TABLE.replace(".", ","),
            "line 2: the line has more cells than the header: 18 instead of 9",
        ),
        (TABLE.rpartition(",")[0], r"line 6: 'z': the cell is empty"),
        # A single column without a unit is rejected.
        (TABLE.replace("z [mm]", "z"), "column 'z' has no unit"),
        ("\n".join([BARE, *(",".join(["0.5"] * 9) for _ in range(5))]), "'q1' has no unit"),
        (TABLE.replace("x [mm],y [mm],z [mm]", "x,y,z [mm],qw,qx,qy,qz"), "'x' has no unit"),
    ],
    ids=[
        "no header",
        "unknown separator",
        "ambiguous comma",
        "empty cell",
        "one unit missing",
        "ambiguous angles",
        "pose without units",
    ],
)
def test_unreadable_table_error_names_cause(arm, tmp_path, written, expected):
    path = tmp_path / "measured.csv"
    path.write_text(written, encoding="utf-8")
    with pytest.raises(InputValueError, match=expected):
        read_measurements(path, arm)
