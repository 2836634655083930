r"""Prints a report about the quality of a model."""

import math

import sympy as sp

from ...quality.quality_report import JointQuality, ModelReport, ranked
from ..setting import names
from ..setting.page import sentence, text
from . import tables


def model_quality(report: ModelReport) -> str:
    r"""Print a model report as LaTeX that any LaTeX article can include.

    Args:
        report: The report of ``chasles.derive.model_report``.
    """
    r, t = report.revolute, report.prismatic
    pitches = f" + {report.helical}" if report.helical else ""
    count = (
        rf"$4 r + 2 t + 6{pitches} = {report.identifiable}$ numbers, with $r = {r}$ and $t = {t}$"
    )
    models = [
        names.escape(ranked(name, numbers, rank, report.identifiable))
        for name, numbers, rank in (
            ("As described", report.numbers, report.rank),
            ("As suited", report.suitable_numbers, report.suitable_rank),
        )
    ]
    return text(
        f"Tool poses determine {count}: 4 for the axis of each revolute joint, 2 for the direction"
        " of each prismatic joint, and 6 for the tool. " + ". ".join(models) + ".",
        *(_determinants(report, slides=slides) for slides in (False, True)),
        *(_joint(joint) for joint in report.joints),
    )


def _determinants(report: ModelReport, *, slides: bool) -> str:
    found = report.conventions_of(slides=slides)
    if not found:
        return ""
    columns: list[tables.Column] = [
        ("convention", [names.escape(item.convention) for item in found]),
        ("numbers", [str(len(item.numbers)) for item in found]),
        ("own parameters", [f"${_tex(item.determinant)}$" for item in found]),
        ("full-pose parameters", [f"${_tex(item.completed)}$" for item in found]),
    ]
    kind = "prismatic" if slides else "revolute"
    words = rf"For a link to a {kind} joint, $\det(D^{{\mathsf T}} D)$ is"
    return sentence(words, tables.tabular(columns, repeated=1))


def _joint(joint: JointQuality) -> str:
    angle = math.degrees(joint.angle)
    misses = "; ".join(joint.misses)
    described = f"misses {names.escape(misses)}" if misses else "is complete"
    items = joint.conventions
    columns: list[tables.Column] = [
        ("convention", [names.escape(item.convention) for item in items]),
        (r"$\det$", ["" if item.value is None else f"{item.value:.3g}" for item in items]),
        ("", [names.escape(item.verdict) for item in items]),
    ]
    return sentence(
        rf"Joint {names.escape(joint.joint)} after {names.escape(joint.before)}: angle"
        rf" ${angle:.4g}^\circ$, distance ${joint.distance:.6g}$ m. The description {described}."
        f" The suitable convention is {names.escape(joint.suitable)}.",
        tables.tabular(columns, repeated=1),
    )


def _tex(expression: sp.Expr) -> str:
    symbols = {symbol: names.parameter(symbol.name) for symbol in expression.free_symbols}
    return str(sp.latex(expression, symbol_names=symbols))
