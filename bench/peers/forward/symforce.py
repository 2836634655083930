"""SymForce generates C++ from the equations in `formulas.py` during the benchmark."""

import tempfile
from pathlib import Path

import symforce

from tests.support.native import Source

from ...cases.arms import Arm
from ...native.library import Loop, headers, loop
from .formulas import fk_jacobian

# The equations of forward kinematics contain no division; SymForce requires this setting before its
# first import.
symforce.set_epsilon_to_number()

import symforce.symbolic as sf  # noqa: E402
from symforce import codegen  # noqa: E402
from symforce.values import Values  # noqa: E402

MAIN = """
#include "pose.h"
#include "both.h"
template <int rows, int columns> static auto matrix(double *data)
{{
    return reinterpret_cast<Eigen::Matrix<double, rows, columns> *>(data);
}}
static const auto &vector(const double *q)
{{
    return *reinterpret_cast<const Eigen::Matrix<double, {n}, 1> *>(q);
}}
static void fk(void *, const double *q, double *T) {{ sym::Pose(vector(q), matrix<4, 4>(T)); }}
static void fk_jacobian(void *, const double *q, double *T, double *J)
{{
    sym::Both(vector(q), matrix<4, 4>(T), matrix<6, {n}>(J));
}}
#include "loop.h"
"""


def loops(arm: Arm) -> list[Loop]:
    files = {"main.cpp": MAIN.format(n=arm.joints), **_generated(arm)}
    folder = headers("cmeel-eigen", "/Eigen/Core")
    # Eigen must not assume aligned memory, because matrices within an array are unaligned.
    flags = ("-DEIGEN_MAX_ALIGN_BYTES=0", f"-isystem{folder}")
    source = Source(f"symforce-{arm.name}", files, flags)
    return [loop("SymForce", arm.joints, source, by_columns=True)]


def _generated(arm: Arm) -> dict[str, str]:
    q = sf.Matrix(arm.joints, 1).symbolic("q")
    T, J = (sf.Matrix(rows) for rows in fk_jacobian(arm, list(q), sf.cos, sf.sin))
    # SymForce stores matrices by columns. The output is the transposed pose, so the pose itself is
    # stored by rows.
    outputs = {"pose": Values(T=T.T), "both": Values(T=T.T, J=J)}
    files = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, results in outputs.items():
            function = codegen.Codegen(Values(q=q), results, codegen.CppConfig(), name=name)
            function.generate_function(output_dir=folder, skip_directory_nesting=True)
            files[f"{name}.h"] = (Path(folder) / f"{name}.h").read_text(encoding="utf-8")
    return files
