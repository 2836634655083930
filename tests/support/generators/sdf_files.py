"""SDF texts of random trees of links, with different constructs of the format."""

import numpy as np

from tests.support.generators.mutated_urdfs import rotation, rpy_of, texts
from tests.support.generators.random_trees import RandomTree

VARIANTS = ("relative", "absolute", "degrees", "quaternion", "joint frames", "expressed in")


def _pose(T: np.ndarray) -> str:
    return " ".join((*texts(T[:3, 3]), *texts(rpy_of(T[:3, :3]))))


def sdf_of(tree: RandomTree, variant: str) -> str:
    """Return a tree of links as SDF text."""
    placed, lines = {"l0": np.eye(4)}, ['<link name="l0"/>']
    lines.append('<joint name="stand" type="fixed"><parent>world</parent><child>l0</child></joint>')
    for name, kind, parent, child, xyz, rpy, axis in tree.joints:
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotation(*map(float, rpy.split())), [float(x) for x in xyz.split()]
        placed[child] = placed[parent] @ T
        pose, above, at, shown, frame = f"{xyz} {rpy}", parent, "", axis, ""
        if variant == "absolute":
            pose, above = _pose(placed[child]), "__model__"
        attributes = f' relative_to="{above}"'
        if variant == "degrees":
            turned = " ".join(repr(float(np.degrees(float(x)))) for x in rpy.split())
            pose, attributes = f"{xyz} {turned}", f'{attributes} degrees="true"'
        if variant == "quaternion":
            pose = f"{xyz} {_quaternion(T[:3, :3])}"
            attributes += ' rotation_format="quat_xyzw"'
        if variant == "joint frames":
            # A separate frame element defines the pose of the joint, and the link is placed
            # relative to the joint.
            lines.append(f'<frame name="{name}_at"><pose{attributes}>{pose}</pose></frame>')
            at, pose, attributes = f'<pose relative_to="{name}_at"/>', "", f' relative_to="{name}"'
        if variant == "expressed in":
            wanted = T[:3, :3] @ [float(x) for x in axis.split()]
            shown, frame = " ".join(texts(wanted)), f' expressed_in="{parent}"'
        bounds = "" if kind != "revolute" else "<limit><lower>-2</lower><upper>1.5</upper></limit>"
        moved = "" if kind == "fixed" else f"<axis><xyz{frame}>{shown}</xyz>{bounds}</axis>"
        lines += [
            f'<link name="{child}"><pose{attributes}>{pose}</pose></link>',
            f'<joint name="{name}" type="{kind}"><parent>{parent}</parent><child>{child}</child>'
            f"{at}{moved}</joint>",
        ]
    body = "\n".join(lines)
    return f'<sdf version="1.11"><model name="tree">\n{body}\n</model></sdf>'


def _quaternion(R: np.ndarray) -> str:
    from chasles import se3

    T = np.eye(4)
    T[:3, :3] = R
    return " ".join(map(repr, map(float, se3.to_quat(T, order="xyzw"))))
