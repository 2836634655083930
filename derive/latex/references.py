r"""Prints the list of works that a LaTeX article cites.

LaTeX fragments cite works by author and year, so that the fragments fit into any LaTeX article. The
list contains only works that the LaTeX fragments of the article cite.
"""

from collections.abc import Iterable, Mapping

WORKS: Mapping[str, str] = {
    "Brockett": (
        r"R. W. Brockett, Robotic manipulators and the product of exponentials formula,"
        r" \emph{Mathematical Theory of Networks and Systems}, 1984."
    ),
    "Craig": r"J. J. Craig, \emph{Introduction to Robotics: Mechanics and Control}, 1986.",
    "Denavit": (
        r"J. Denavit and R. S. Hartenberg, A kinematic notation for lower-pair mechanisms based on"
        r" matrices, \emph{Journal of Applied Mechanics} 22, 1955."
    ),
    "Elias and Wen": (
        r"A. J. Elias and J. T. Wen, IK-Geo: unified robot inverse kinematics using subproblem"
        r" decomposition, 2022."
    ),
    "Gosselin and Angeles": (
        r"C. Gosselin and J. Angeles, Singularity analysis of closed-loop kinematic chains,"
        r" \emph{IEEE Transactions on Robotics and Automation} 6, 1990."
    ),
    "Gosselin, Sefrioui and Richard": (
        r"C. M. Gosselin, J. Sefrioui and M. J. Richard, Solutions polynomiales au probl\`eme de la"
        r" cin\'ematique directe des manipulateurs parall\`eles plans \`a trois degr\'es de"
        r" libert\'e, \emph{Mechanism and Machine Theory} 27, 1992."
    ),
    "Hayati": (
        r"S. Hayati and M. Mirmirani, Improving the absolute positioning accuracy of robot"
        r" manipulators, \emph{Journal of Robotic Systems} 2, 1985."
    ),
    "Hunt 1983": (
        r"K. H. Hunt, Structural kinematics of in-parallel-actuated robot-arms, \emph{Journal of"
        r" Mechanisms, Transmissions, and Automation in Design} 105, 1983."
    ),
    "Kutzbach": (
        r"K. Kutzbach, Mechanische Leitungsverzweigung, ihre Gesetze und Anwendungen,"
        r" \emph{Maschinenbau} 8, 1929."
    ),
    "Murray, Li and Sastry": (
        r"R. M. Murray, Z. Li and S. S. Sastry, \emph{A Mathematical Introduction to Robotic"
        r" Manipulation}, 1994."
    ),
    "Paden": (
        r"B. Paden, \emph{Kinematics and Control of Robot Manipulators}, thesis, University of"
        r" California, Berkeley, 1986."
    ),
    "Pieper": (
        r"D. L. Pieper, \emph{The Kinematics of Manipulators under Computer Control}, thesis,"
        r" Stanford University, 1968."
    ),
    "Raghavan 1993": (
        r"M. Raghavan, The Stewart platform of general geometry has 40 configurations,"
        r" \emph{Journal of Mechanical Design} 115, 1993."
    ),
    "Raghavan and Roth": (
        r"M. Raghavan and B. Roth, Inverse kinematics of the general 6R manipulator and related"
        r" linkages, \emph{Journal of Mechanical Design} 115, 1993."
    ),
    "Stone": (
        r"H. W. Stone, \emph{Kinematic Modeling, Identification, and Control of Robotic"
        r" Manipulators}, 1987."
    ),
    "Wampler": (
        r"C. W. Wampler, Forward displacement analysis of general six-in-parallel SPS (Stewart)"
        r" platform manipulators using soma coordinates, \emph{Mechanism and Machine Theory} 31,"
        r" 1996."
    ),
}
"""Entries of the list of references in printed order, keyed by the words with which a text cites
the work."""
_LAYOUT = (
    r"\setlength{\leftmargin}{1.5em}\setlength{\itemindent}{-1.5em}"
    r"\setlength{\itemsep}{0pt}\setlength{\parsep}{1pt}"
)
_UNBROKEN = r"\samepage\small"
"""LaTeX commands that keep the list of references on one page."""


def references(fragments: Iterable[str]) -> str:
    """Return the list of publications that the fragments cite, or an empty text."""
    text = "\n".join(fragments)
    cited = [entry for words, entry in WORKS.items() if words in text]
    if not cited:
        return ""
    items = "\n".join(rf"\item {entry}" for entry in cited)
    body = f"\\begin{{list}}{{}}{{{_LAYOUT}}}\n{items}\n\\end{{list}}"
    return f"{{{_UNBROKEN}\n{body}}}\n"
