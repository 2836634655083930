r"""Assembles the LaTeX article of a robot from LaTeX fragments."""

import math
from collections.abc import Callable, Mapping
from functools import partial

from chasles.contract.forking import run_in_fork

from ..derivation import Derivation
from ..inverse.mechanisms import leg_inverse
from ..inverse.mechanisms.mode_check import LEGS
from ..loops.modes.platforms import is_platform, triad_of
from ..model.mechanism import Mechanism
from ..program.programs import Programs
from .chain.coupled_page import (
    CoupledPage,
    couplings,
    example_of_coupled,
    inverse_of_coupled,
    singularities_of_coupled,
)
from .chain.coupled_page import description as coupled_description
from .chain.example_fragment import worked_example
from .chain.functions_fragment import forward_kinematics, jacobians
from .chain.geometry_fragment import link_transforms, screws
from .chain.given_fragment import parameters, symbols
from .chain.parametric_fragment import parametric
from .chain.singularity_fragment import singularities
from .drawing import PREAMBLE as DRAWING_PREAMBLE
from .drawing import arm_drawing, drawing
from .drawing.region import workspace, workspace_of_loops
from .inverse.inverse_fragment import inverse
from .inverse.inverse_of_loops import inverse_of_loops
from .loops.example_of_loops import worked_example_of_loops
from .loops.legs_fragment import legs
from .loops.loop_geometry import parametric_of_loops
from .loops.loop_page import LoopPage
from .loops.loops_fragment import loops
from .loops.mechanism_fragment import description
from .loops.mobility_fragment import freedoms
from .loops.platforms_fragment import platform
from .loops.rates_fragment import rates
from .loops.solution_fragment import solution
from .loops.tool_position import tool_position
from .references import references
from .setting.names import escape
from .setting.page import Page

FOLDER = "latex"
"""Folder with the LaTeX fragments, next to the document."""
_FRAGMENTS: Mapping[str, tuple[str, Callable[[Page], str]]] = {
    "parameters": ("Description", parameters),
    "symbols": ("Notation", symbols),
    "screws": ("Screw axes", screws),
    "transforms": ("Link transforms", link_transforms),
    "fk": ("Forward kinematics", forward_kinematics),
    "jacobian": ("Jacobians", jacobians),
    "parametric": ("Geometry as variables", parametric),
    "inverse": ("Inverse kinematics", inverse),
    "singularities": ("Singular configurations", singularities),
    "example": ("Worked example", worked_example),
}
"""Headings and printing functions of the LaTeX fragments of a serial robot, in reading order."""
_OF_COUPLED: Mapping[str, tuple[str, Callable[[CoupledPage], str]]] = {
    "parameters": ("Description", coupled_description),
    "couplings": ("Couplings", couplings),
    "inverse": ("Inverse kinematics", inverse_of_coupled),
    "singularities": ("Singular configurations", singularities_of_coupled),
    "example": ("Worked example", example_of_coupled),
}
"""Headings and printing functions of LaTeX fragments for robots with coupled joints, which replace
or supplement entries of ``_FRAGMENTS``."""
_DRAWING = "drawing"
"""Name of the LaTeX fragment with the figure of the robot."""
_WORKSPACE = "workspace"
"""Name of the LaTeX fragment with the workspace figure."""
_PICTURES: Mapping[str, Mapping[str, str]] = {
    "parameters": {_DRAWING: "Drawing"},
    "singularities": {_WORKSPACE: "Workspace"},
}
"""Pictures after each LaTeX fragment, keyed by the name of the fragment. Each entry maps the names
of pictures to their section headings."""
_NEEDS_GEOMETRY = "parametric"
"""Name of the LaTeX fragment with the parametric functions."""


_OF_LOOPS: Mapping[str, tuple[str, Callable[[LoopPage], str]]] = {
    "parameters": ("Description", description),
    "drawing": (
        "Drawing",
        lambda page: drawing(
            page.mechanism, page.terms, page.skeleton, [*page.hybrid.at_reference.values()]
        ),
    ),
    "symbols": ("Notation", lambda page: symbols(page.chain)),
    "mobility": ("Mobility", freedoms),
    "loops": ("Loops", loops),
    "solution": ("Solution of the loops", solution),
    "screws": ("Screw axes of the main chain", lambda page: screws(page.chain)),
    "transforms": ("Link transforms of the main chain", lambda page: link_transforms(page.chain)),
    "fk": ("Forward kinematics of the main chain", lambda page: forward_kinematics(page.chain)),
    "position": ("Position of the tool in actuated coordinates", tool_position),
    "jacobian": ("Jacobians of the main chain", lambda page: jacobians(page.chain)),
    "inverse": ("Inverse kinematics of the main chain", inverse_of_loops),
    "singularities": (
        "Singular configurations of the main chain",
        # Loops can have singularities even if the main chain has none.
        lambda page: "" if page.chain.singular.is_regular else singularities(page.chain),
    ),
    "workspace": (
        "Workspace",
        lambda page: workspace_of_loops(
            *(page.mechanism, page.terms, page.skeleton, page.functions, page.members.q)
        ),
    ),
    "rates": ("Velocities", rates),
    "parametric": ("Geometry as variables", lambda page: parametric_of_loops(page.geometry)),
    "platform": ("Platform on legs", platform),
    "legs": ("Platform on legs", legs),
    "example": ("Worked example", worked_example_of_loops),
}
"""Headings and printing functions of the LaTeX fragments for robots with loops or geared motors."""
_NEED_LOOPS = ("loops", "mobility")
_REFERENCES = "references"
"""Name of the last LaTeX fragment, which lists the cited works."""


_BRIEF = frozenset(
    ("parameters", "drawing", "symbols", "fk", "jacobian", "inverse", "solution", "references")
)
"""Names of the LaTeX fragments in a brief LaTeX article."""


def files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """Return the LaTeX article and its fragments, keyed by file path.

    The second argument of ``files`` is not used, because a LaTeX article contains no generated
    code.
    """
    return _files(derivation, fragments(derivation))


def brief_files(derivation: Derivation, _: Programs) -> dict[str, str]:
    """Return the files of an article without derivations, screws, examples and singularities."""
    parts = fragments(derivation)
    return _files(derivation, {k: v for k, v in parts.items() if k.removesuffix(".tex") in _BRIEF})


def _files(derivation: Derivation, parts: Mapping[str, str]) -> dict[str, str]:
    article = _article(derivation, parts)
    read = {f"{FOLDER}/{name}": text for name, text in parts.items()}
    return {f"{derivation.robot.name}.tex": article, **read}


def fragments(derivation: Derivation) -> dict[str, str]:
    r"""Return LaTeX fragments that any LaTeX article can include with ``\input``.

    The LaTeX fragments require the packages amsmath and booktabs. The fragments have no headings
    and fit a text width of 345 pt at a font size of 10 pt. The fragments ``drawing.tex`` and
    ``workspace.tex`` require TikZ. ``jacobian.tex`` and ``inverse.tex`` use terms defined in
    ``fk.tex``. The fragment ``symbols.tex`` explains the short symbols in the equations.

    Args:
        derivation: The derivation of a robot.

    Returns:
        The text of each LaTeX fragment, keyed by file name. A serial robot has ``parameters.tex``,
        ``drawing.tex``, ``symbols.tex``, ``screws.tex``, ``transforms.tex``, ``fk.tex``,
        ``jacobian.tex``, ``inverse.tex``, ``singularities.tex``, ``workspace.tex``, ``example.tex``
        and ``references.tex``. A robot with parametric functions also has ``parametric.tex``. A
        robot with loops also has ``mobility.tex``, ``loops.tex``, ``solution.tex``,
        ``position.tex`` and ``rates.tex``. A platform on legs has ``platform.tex``, or ``legs.tex``
        if the legs end in closures. Empty fragments are omitted.
    """
    if isinstance(derivation.robot, Mechanism):
        page = LoopPage.of(derivation)
        return _written({name: partial(_OF_LOOPS[name][1], page) for name in _headings(derivation)})
    coupled = CoupledPage.of(derivation) if derivation.robot.couplings else None
    chain = coupled.chain if coupled else Page.of(derivation)
    made = {name: partial(writer, chain) for name, (_, writer) in _FRAGMENTS.items()}
    if coupled:
        made |= {name: partial(writer, coupled) for name, (_, writer) in _OF_COUPLED.items()}
    for name, picture in ((_DRAWING, arm_drawing), (_WORKSPACE, workspace)):
        made[name] = partial(picture, derivation.robot, derivation.skeleton)
    return _written({name: made[name] for name in _headings(derivation)})


def _written(writers: Mapping[str, Callable[[], str]]) -> dict[str, str]:
    drawn = [name for name in writers if name in (_DRAWING, _WORKSPACE)]
    # The symbol table lists the symbols of all other fragments, so it is written last.
    order = sorted(writers.keys() - {*drawn}, key=[*writers].index)
    order.sort(key="symbols".__eq__)
    with run_in_fork(lambda: {name: writers[name]() for name in drawn}) as pictures:
        written = {name: writers[name]() for name in order}
        written |= pictures()
    written[_REFERENCES] = references(written.values())
    return {f"{name}.tex": written[name] for name in (*writers, _REFERENCES) if written[name]}


def _headings(derivation: Derivation) -> dict[str, str]:
    robot = derivation.robot
    if not isinstance(robot, Mechanism):
        found = {}
        for name, (heading, _) in _FRAGMENTS.items():
            if name != _NEEDS_GEOMETRY or derivation.geometry is not None:
                found[name] = heading
            found |= _PICTURES.get(name, {})
            if name == "symbols" and robot.couplings:
                found["couplings"] = _OF_COUPLED["couplings"][0]
        return found
    return {
        name: heading
        for name, (heading, _) in _OF_LOOPS.items()
        if (robot.loop_joints or name not in _NEED_LOOPS)
        and (name != "platform" or is_platform(robot))
        and (name != _NEEDS_GEOMETRY or derivation.geometry is not None)
        and (name != "legs" or _has_legs(derivation))
        and (name != "inverse" or not _has_poses(derivation))
    }


def _has_legs(derivation: Derivation) -> bool:
    hybrid = derivation.hybrid
    if hybrid is None or not hybrid.forward.open or is_platform(hybrid.mechanism):
        return False
    return triad_of(hybrid) is not None


def _has_poses(derivation: Derivation) -> bool:
    """Whether the article omits the section about the inverse kinematics of the main chain."""
    hybrid = derivation.hybrid
    if hybrid is None or not hybrid.forward.open:
        return False
    if any(f.name in ("ik", LEGS) for f in derivation.functions) and not leg_inverse.makers(hybrid):
        return False
    return derivation.inverse is None or not derivation.inverse.solved


def document(derivation: Derivation) -> str:
    r"""Return the text of an article that includes its fragments from the folder ``FOLDER``."""
    return _article(derivation, fragments(derivation))


def _article(derivation: Derivation, parts: Mapping[str, str]) -> str:
    robot = derivation.robot
    source = f"Source of the parameters: {escape(robot.source)}." if robot.source else ""
    title = escape(robot.title or robot.name)
    shown = [item for item in _in_article(derivation) if f"{item[0]}.tex" in parts]
    sections = [
        _figure(derivation) if name == _DRAWING else _section(name, heading)
        for name, heading in shown
    ]
    if len(shown) > 1 and shown[-1][0] == _REFERENCES:
        sections[-2] = sections[-2].replace("\n", f"\n{_KEEP}\n", 1)
    preamble = _PREAMBLE.replace(_BOOKTABS, f"{_BOOKTABS}\n{DRAWING_PREAMBLE}")
    return "\n\n".join(
        [
            preamble,
            "\\begin{document}",
            # The robot's title stands alone and not in a sentence, because the title may be a
            # plural or a genitive.
            f"\\begin{{center}}\n{{\\LARGE {title}}}\\\\[1ex]\n\\large Kinematics\n\\end{{center}}",
            *([source] if source else []),
            *sections,
            "\\end{document}\n",
        ]
    )


def _section(name: str, heading: str) -> str:
    return f"\\section{{{heading}}}\n\\input{{{FOLDER}/{name}}}"


def _in_article(derivation: Derivation) -> list[tuple[str, str]]:
    headings = _headings(derivation) | {_REFERENCES: "References"}
    return sorted(headings.items(), key=lambda item: item[0] != _DRAWING)


def _figure(derivation: Derivation) -> str:
    robot = derivation.robot
    if isinstance(robot, Mechanism):
        caption = "The robot at its reference configuration, actuators in red, loops numbered."
        return _FIGURE % caption
    values = [
        rf"{value:.4g}\,\mathrm{{m}}" if joint.unit == "m" else rf"{math.degrees(value):.4g}^\circ"
        for value, joint in zip(derivation.skeleton.q_drawn, robot.coordinates, strict=True)
    ]
    configuration = ", ".join(f"${value}$" for value in values)
    return _FIGURE % f"The robot at $q =$ ({configuration}), with the positive sense of each joint."


_BOOKTABS = r"\usepackage{booktabs}"
_KEEP = r"\keepwithnext"
"""LaTeX command that prevents a page that contains only references."""
_FIGURE = rf"""\begin{{figure}}[H]
\centering
\input{{{FOLDER}/drawing}}
\caption{{%s}}
\end{{figure}}"""
_PREAMBLE = r"""\providecommand{\paper}{a4paper} % or letterpaper, defined before
\documentclass[\paper]{article}
\usepackage[utf8]{inputenc}
\usepackage[T1]{fontenc}
\usepackage{lmodern}
\usepackage{amsmath}
\usepackage{booktabs}
\usepackage{float}
\usepackage[textwidth=160mm,hcentering,vmargin=22mm]{geometry}
\setlength{\emergencystretch}{6em}
\AtBeginDocument{%
  \setlength{\abovedisplayskip}{6pt plus 3pt minus 3pt}%
  \setlength{\belowdisplayskip}{6pt plus 3pt minus 3pt}}
\renewcommand{\arraystretch}{0.95}
\makeatletter
\@beginparpenalty=10000 % a table stays with the words before it
\clubpenalty=10000 \@clubpenalty=10000 \widowpenalty=10000 \displaywidowpenalty=10000
\newcommand{\keepwithnext}{\@secpenalty=10000 \@endparpenalty=10000 }
\makeatother"""
