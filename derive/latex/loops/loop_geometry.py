r"""Prints the parametric functions of a robot with loops."""

from ...loops.model.mechanism_geometry import MechanismGeometry
from ..chain.parameter_table import parameter_table
from ..setting.page import sentence, text
from ..setting.printer import Printer

_LOOPS = r"""With $u$ the values of the passive joints and cylinders, $f(q, u, p) = 0$ the equations
of the loops, and $T(q, u, p)$ the pose of the tool along the main chain, both as products over the
same joints as in the sections above with the corrections $p$ in their places, Newton's iteration
\begin{align*}
u \leftarrow u - \left(\frac{\partial f}{\partial u}\right)^{-1} f(q, u, p)
\end{align*}
starts at the nominal configuration at $q$, and \texttt{fk\_p} is $T$ at its end."""
_SLOPES = r"""With $\mathcal{S}_x$ the tool twist per unit rate of $x$ with all other variables
constant, the implicit function theorem gives
\begin{align*}
J_p = \mathcal{S}_p - L \frac{\partial f}{\partial p}, \qquad
J_q = \mathcal{S}_q - L \frac{\partial f}{\partial q}, \qquad
L = \mathcal{S}_u \left(\frac{\partial f}{\partial u}\right)^{-1},
\end{align*}
where $J_p$ is \texttt{identification\_jacobian} and $J_q$ is \texttt{jacobian\_p}. $L$ requires six
linear systems, for any number of parameters $p$."""


def parametric_of_loops(geometry: MechanismGeometry | None) -> str:
    """Print the parameter table, the Newton iteration for the loops and the Jacobians.

    Args:
        geometry: The robot's parametric functions, or None if they were not derived.
    """
    if geometry is None:
        return ""
    found = geometry.parameters
    printer = Printer({p.symbol: f"p_{{{k}}}" for k, p in enumerate(found, 1)}, {})
    return text(
        sentence(
            "The parametric functions take the geometry as a vector $p$ of"
            rf" ${len(found)}$ parameters; the nominal value is zero unless stated:",
            parameter_table(found, printer),
        ),
        _LOOPS,
        _SLOPES,
    )
