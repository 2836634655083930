"""Writes the description of a robot with loops, with placeholders for the robot's geometry.

The runtime replaces ``$xyz_k`` by the position of frame k, ``$rpy_k`` by its angles (degrees), and
``$x_k`` by a single value. The placeholders in the robot file are in the order of
``chasles.derive.loops.parametric.parametric_loops.file_parts``. The runtime also replaces
``$name``, ``$title``, ``$source`` and ``$closure``.
"""

import json
from collections.abc import Iterator

import sympy as sp

from ..loops.model.coupling_equations import is_length
from ..loops.parametric.parametric_loops import masses_of_links
from ..loops.solve.solved_loops import SolvedLoops
from ..model.mechanism import Closure, Frame, Mechanism, Strut
from ..model.robot import Joint

_HEAD = """\
name = $name
title = $title
source = $source
convention = "urdf"
units = { length = "m", angle = "deg" }
"""


def robot_template(hybrid: SolvedLoops) -> str:
    """Return the robot file with placeholders, or an empty text if a joint is helical.

    Args:
        hybrid: The robot.
    """
    mechanism = hybrid.mechanism
    if any(joint.kind == "helical" for joint in mechanism.joints):
        return ""
    return _HEAD + "\n".join(_lines(hybrid)) + "\n"


def _lines(hybrid: SolvedLoops) -> Iterator[str]:
    mechanism = hybrid.mechanism
    count = 1 + len(mechanism.joints) + 2 * len(mechanism.loop_joints)
    yield "closure = $closure"
    if mechanism.load is not None:
        gravity = ", ".join(_number(hybrid.terms.value(g)) for g in mechanism.load.gravity)
        yield f"gravity = [{gravity}]"
    yield f"actuated = {json.dumps(list(mechanism.actuated))}"
    yield f"base = {{ name = {json.dumps(mechanism.base_frame)}, {_frame(0)} }}"
    tool = f"name = {json.dumps(mechanism.tool_frame)}, body = {json.dumps(mechanism.tool_body)}"
    yield f"tool = {{ {tool}, {_frame(count)} }}"
    for k, joint in enumerate(mechanism.joints, 1):
        yield from _joint(joint, k)
    first = 1 + len(mechanism.joints)
    for k, loop_joint in enumerate(mechanism.loop_joints):
        yield from _loop_joint(mechanism, loop_joint, first + 2 * k)
    # Drives of passive coordinates are omitted. Robots with iterated loops have no drives of
    # passive coordinates.
    for drive in (d for d in mechanism.drives if d.name in mechanism.actuated):
        yield from ("", "[[drives]]", f"name = {json.dumps(drive.name)}")
        yield from (f'kind = "{drive.kind}"', f"joint = {json.dumps(drive.joint)}")
        member = mechanism.members[drive.joint]
        slides = is_length(member)
        yield f"{'radius' if slides else 'ratio'} = {_number(hybrid.terms.value(drive.ratio))}"
    yield from _masses(hybrid)
    yield from _couplings(mechanism)
    yield from ("", "[reference]")
    units = {variable.name: variable.unit for variable in hybrid.variables}
    for name, value in hybrid.at_reference.items():
        yield f"{json.dumps(name)} = {_number(sp.Float(value), units[name])}"


def _masses(hybrid: SolvedLoops) -> Iterator[str]:
    """Yield the masses.

    For each mass in ``masses_of_links``, the position in the link frame is a placeholder.
    """
    mechanism, value = hybrid.mechanism, hybrid.terms.value
    if mechanism.load is None:
        return
    on_links = masses_of_links(mechanism)
    for mass in mechanism.load.masses:
        yield from ("", "[[masses]]", f"link = {json.dumps(mass.link)}")
        yield f"mass = {_number(value(mass.mass))}"
        if mass in on_links:
            yield f"at = $xyz_{_after_struts(mechanism) + on_links.index(mass)}"
        else:
            yield f"at = [{', '.join(_number(value(x)) for x in mass.at)}]"


def _couplings(mechanism: Mechanism) -> Iterator[str]:
    """Yield the couplings.

    A placeholder replaces the offset of each coupling.
    """
    first = _after_struts(mechanism) + len(masses_of_links(mechanism))
    if mechanism.couplings:
        yield from ("", "[couplings]")
    for k, coupling in enumerate(mechanism.couplings, first):
        own = _turn(mechanism, coupling.joint)
        ratios = [
            f"{json.dumps(name)} = {_number(ratio * own / _turn(mechanism, name))}"
            for name, ratio in coupling.ratios
        ]
        fields = ", ".join((*ratios, f"offset = $x_{k}"))
        yield f"{json.dumps(coupling.joint)} = {{ {fields} }}"


def _turn(mechanism: Mechanism, name: str) -> sp.Expr:
    """Return the value of one radian or meter in the units of the robot file (degree, meter)."""
    return sp.S.One if is_length(mechanism.members[name]) else 180 / sp.pi


def _after_struts(mechanism: Mechanism) -> int:
    """Return the index of the first placeholder after the placeholders of the struts."""
    frames = 2 + len(mechanism.joints) + 2 * len(mechanism.loop_joints)
    return frames + len(mechanism.struts)


def _joint(joint: Joint, k: int) -> Iterator[str]:
    yield from ("", "[[joints]]", f"name = {json.dumps(joint.name)}")
    yield from (f"parent = {json.dumps(joint.parent)}", f"link = {json.dumps(joint.link)}")
    yield from (f'type = "{joint.kind}"', f"xyz = $xyz_{k}", f"rpy = $rpy_{k}")
    if joint.kind != "fixed":
        yield f"axis = [0, 0, {joint.direction}]"
        yield from _limits(joint)


def _loop_joint(mechanism: Mechanism, loop_joint: Closure | Strut, k: int) -> Iterator[str]:
    ends = [f"a = {_end(loop_joint.a, k)}", f"b = {_end(loop_joint.b, k + 1)}"]
    name = f"name = {json.dumps(loop_joint.name)}"
    if isinstance(loop_joint, Closure):
        yield from ("", "[[closures]]", name, f'kind = "{loop_joint.kind}"', *ends)
        return
    tool = 1 + len(mechanism.joints) + 2 * len(mechanism.loop_joints)
    place = f"$x_{tool + 1 + mechanism.struts.index(loop_joint)}"
    if loop_joint.is_cylinder:
        yield from ("", "[[cylinders]]", name, f"retracted = {place}", *_limits(loop_joint))
    else:
        yield from ("", "[[rods]]", name, f"length = {place}")
    is_pair = loop_joint.has_universal
    yield 'ends = ["universal", "ball"]' if is_pair else f'ends = "{loop_joint.ends}"'
    if loop_joint.ends == "pin":
        yield f"swing = {json.dumps(loop_joint.swing_name)}"
    yield from ends


def _limits(member: Joint | Strut) -> Iterator[str]:
    low, high = member.limits
    if low is not None and high is not None:
        unit = "m" if is_length(member) else "rad"
        yield f"limits = [{_number(low, unit)}, {_number(high, unit)}]"


def _frame(k: int) -> str:
    return f"xyz = $xyz_{k}, rpy = $rpy_{k}"


def _end(frame: Frame, k: int) -> str:
    return f"{{ body = {json.dumps(frame.body)}, {_frame(k)} }}"


def _number(value: sp.Expr, unit: str = "m") -> str:
    """Format a number in meters or degrees."""
    shown = value * 180 / sp.pi if unit == "rad" else value
    return repr(float(shown))
