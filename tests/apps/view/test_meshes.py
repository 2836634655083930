"""The meshes of a URDF have the same poses as in yourdfpy."""

import re
import shutil
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest

import chasles
from chasles.contract.isolation import Limits
from chasles.drawing import skeleton
from chasles.errors import InputValueError
from chasles.view import LiveView, meshes
from chasles.view.meshes import body_meshes
from tests.support.command_line import run
from tests.support.optional import OptionalPackage

yourdfpy = OptionalPackage("yourdfpy")

ARM = """<robot name="meshed">
  <link name="world"/>
  <joint name="stand" type="fixed"><parent link="world"/><child link="base"/>
    <origin xyz="0.5 0 0.1" rpy="0 0 0.4"/></joint>
  <link name="base"><visual><geometry><box size="0.2 0.2 0.1"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0.1 0 0.3"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <link name="upper"><visual><origin xyz="0.1 0 0.2" rpy="0.3 0.2 0.1"/>
    <geometry><mesh filename="part.stl" scale="0.001 0.001 0.001"/></geometry></visual></link>
  <joint name="bend" type="revolute"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <link name="lower"><visual><geometry><cylinder radius="0.05" length="0.4"/></geometry></visual>
  </link>
  <joint name="slide" type="prismatic"><parent link="lower"/><child link="hand"/>
    <origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.3" effort="1" velocity="1"/></joint>
  <link name="hand"/>
  <joint name="mount" type="fixed"><parent link="hand"/><child link="plate"/>
    <origin xyz="0 0.02 0.05" rpy="0 0.5 0"/></joint>
  <link name="plate"><visual><geometry><sphere radius="0.03"/></geometry></visual></link>
</robot>
"""


@pytest.fixture(scope="module")
def meshed(tmp_path_factory):
    trimesh = pytest.importorskip("trimesh")
    folder = tmp_path_factory.mktemp("meshed")
    trimesh.creation.box((100, 200, 300)).export(folder / "part.stl")
    file = folder / "meshed.urdf"
    file.write_text(ARM, encoding="utf-8")
    return file


def corners(surface) -> np.ndarray:
    return np.asarray(surface.vertices)


def test_mesh_poses_match_yourdfpy(meshed):
    robot = chasles.load(meshed)
    bodies = skeleton(robot)
    meshes = body_meshes(meshed, bodies)
    urdf = yourdfpy.URDF.load(str(meshed))
    assert len(meshes) == 4
    q = np.array([0.7, -0.4, 0.2])
    poses = bodies.poses(q)
    urdf.update_cfg(dict(zip([c.name for c in robot.coordinates], q, strict=True)))
    base = urdf.get_transform(robot.base_frame, urdf.base_link)
    expected = []
    for node in urdf.scene.graph.nodes_geometry:
        T, name = urdf.scene.graph.get(node)
        vertices = urdf.scene.geometry[name].vertices
        moved = np.linalg.solve(base, T)
        expected.append(vertices @ moved[:3, :3].T + moved[:3, 3])
    for mesh in meshes:
        T = poses[mesh.body]
        own = corners(mesh.surface) @ T[:3, :3].T + T[:3, 3]
        off = [np.abs(own - e).max() for e in expected if len(e) == len(own)]
        assert min(off) < 1e-9


def test_files_other_than_urdf_have_no_meshes(tmp_path):
    assert body_meshes(tmp_path / "arm.toml", skeleton(chasles.load("scara"))) == ()


@pytest.fixture
def without_files(tmp_path):
    """Write a URDF file with a collision mesh and three meshes. Two mesh files are missing on
    disk."""
    trimesh = pytest.importorskip("trimesh")
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "part.stl")
    shape = '<geometry><mesh filename="{}"/></geometry>'
    text = ARM.replace('<cylinder radius="0.05" length="0.4"/>', '<mesh filename="gone.stl"/>')
    text = text.replace('<sphere radius="0.03"/>', '<mesh filename="package://any/gone.stl"/>')
    text = text.replace("</robot>", f"</robot>\n<!-- {shape.format('hidden.stl')} -->")
    collision = f"<collision>{shape.format('collision.stl')}</collision>"
    file = tmp_path / "meshed.urdf"
    file.write_text(text.replace("</visual></link>", f"</visual>{collision}</link>", 1))
    return file


def test_missing_meshes_are_one_warning(without_files, caplog):
    with pytest.warns(UserWarning, match="2 of 3 meshes were not found; their links") as given:
        meshes = body_meshes(without_files, skeleton(chasles.load(without_files)))
    assert len(meshes) == 2
    assert [item.category for item in given].count(UserWarning) == 1
    assert not caplog.records


def test_command_states_missing_meshes_in_one_sentence(without_files, tmp_path, monkeypatch):
    pytest.importorskip("viser")

    def interrupted(_):
        raise KeyboardInterrupt

    chasles.load(without_files)
    monkeypatch.setattr(LiveView, "wait", interrupted)
    done = run("view", without_files)
    assert done.exit_code == 0
    assert re.fullmatch(r"meshed: http://localhost:\d+/\?token=\S+ \(Ctrl-C .*\)\n", done.stdout)
    sentence = f"{without_files}: 2 of 3 meshes were not found; their links are drawn as rods\n"
    assert done.stderr == sentence
    done = run("view", without_files, "--html", tmp_path / "page.html")
    assert done.stderr == f"{without_files}: the page omits 3 meshes; the links are drawn as rods\n"


def test_invalid_urdf_is_rejected_by_file_name(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text("<robot", encoding="utf-8")
    with pytest.raises(InputValueError, match=r"arm\.urdf"):
        body_meshes(file, skeleton(chasles.load("scara")))


def mesh_in(folder, meshed):
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(meshed.parent / "part.stl", folder)


@pytest.mark.parametrize("kind", ["relative", "absolute", "scheme", "package", "link"])
def test_mesh_outside_the_package_is_refused(meshed, tmp_path, kind):
    mesh_in(tmp_path / "outside", meshed)
    file = tmp_path / "arm" / "urdf" / "meshed.urdf"
    file.parent.mkdir(parents=True)
    name = {
        "relative": "../../outside/part.stl",
        "absolute": f"{tmp_path}/outside/part.stl",
        "scheme": f"file://{tmp_path}/outside/part.stl",
        "package": "package://any/outside/part.stl",
        "link": "part.stl",
    }[kind]
    file.write_text(ARM.replace("part.stl", name), encoding="utf-8")
    if kind == "link":
        (file.parent / name).symlink_to(tmp_path / "outside" / "part.stl")
    (tmp_path / "arm" / "package.xml").write_text("<package><name>arm</name></package>")
    with pytest.raises(InputValueError, match=r"meshed\.urdf: expected meshes inside .*/arm, got"):
        body_meshes(file, skeleton(chasles.load(meshed)))


@pytest.mark.parametrize("name", ["../meshes/part.stl", "package://arm/meshes/part.stl"])
def test_mesh_in_the_package_is_read(meshed, tmp_path, name):
    mesh_in(tmp_path / "arm" / "meshes", meshed)
    file = tmp_path / "arm" / "urdf" / "meshed.urdf"
    file.parent.mkdir(parents=True)
    file.write_text(ARM.replace("part.stl", name), encoding="utf-8")
    (tmp_path / "arm" / "package.xml").write_text("<package><name>arm</name></package>")
    assert len(body_meshes(file, skeleton(chasles.load(meshed)))) == 4


@pytest.mark.parametrize("suffix", ["zip", "obj"])
def test_mesh_that_exceeds_limits_is_one_sentence(meshed, tmp_path, monkeypatch, suffix):
    pytest.importorskip("trimesh")
    robot = chasles.load(meshed)
    file = tmp_path / "meshed.urdf"
    file.write_text(ARM.replace("part.stl", f"part.{suffix}"), encoding="utf-8")
    line = b"v 0 0 0\n"
    with ZipFile(tmp_path / "part.zip", "w", ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("part.obj", line * (1 << 23))
    (tmp_path / "part.obj").write_bytes(line * (1 << 20))
    monkeypatch.setattr(meshes, "READING", Limits(seconds=10, memory=1 << 25))
    assert len(body_meshes(meshed, skeleton(robot))) == 4
    with pytest.raises(InputValueError, match=r"cannot read the meshes \(.*\)$") as caught:
        body_meshes(file, skeleton(robot))
    assert str(file) in str(caught.value)


def test_entities_are_refused(meshed, tmp_path):
    file = tmp_path / "meshed.urdf"
    entity = f'<!DOCTYPE robot [<!ENTITY outside SYSTEM "file://{meshed}">]>'
    file.write_text(entity + ARM.replace("</robot>", "&outside;</robot>"), encoding="utf-8")
    with pytest.raises(InputValueError, match=r"meshed\.urdf: expected no document type"):
        body_meshes(file, skeleton(chasles.load(meshed)))
