"""Textures of meshes are read only from the folder of the mesh."""

import base64
import json
import struct

import pytest

import chasles
from chasles.drawing import skeleton
from chasles.view.meshes import body_meshes
from tests.support.optional import requires

pytestmark = requires("yourdfpy")

ARM = """<robot name="textured">
  <link name="base"><visual><geometry><mesh filename="{}"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <link name="tip"/>
</robot>
"""
PAINT = (200, 10, 10)
OBJ = """\
mtllib {}
v 0 0 0
v 1 0 0
v 0 1 0
vt 0 0
vt 1 0
vt 0 1
usemtl painted
f 1/1 2/2 3/3
"""
COLLADA = """\
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><up_axis>Z_UP</up_axis></asset>
<library_images><image id="i"><init_from>{}</init_from></image></library_images>
<library_effects><effect id="e"><profile_COMMON>
<newparam sid="surface"><surface type="2D"><init_from>i</init_from></surface></newparam>
<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
<technique sid="t"><phong><diffuse><texture texture="sampler" texcoord="UV"/></diffuse></phong>
</technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="9">0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor source="#pa" count="3" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="u"><float_array id="ua" count="6">0 0 1 0 0 1</float_array><technique_common>
<accessor source="#ua" count="3" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="painted"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#u" offset="1" set="0"/><p>0 0 1 1 2 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="painted" target="#m"/>
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


def gltf(image: str) -> str:
    """Return a glTF file with a textured triangle and embedded vertex data."""
    corners = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<6f", 0, 0, 1, 0, 0, 1)
    data = corners + struct.pack("<3I", 0, 1, 2)
    parts = ((0, 36), (36, 24), (60, 12))
    kinds = (("VEC3", 5126), ("VEC2", 5126), ("SCALAR", 5125))
    attributes = {"POSITION": 0, "TEXCOORD_0": 1}
    content = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 2, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"uri": image}],
        "buffers": [
            {
                "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
                "byteLength": len(data),
            }
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": a, "byteLength": n} for a, n in parts],
        "accessors": [
            {"bufferView": k, "componentType": component, "count": 3, "type": kind}
            for k, (kind, component) in enumerate(kinds)
        ],
    }
    return json.dumps(content)


def write_mesh(kind, folder, reference):
    if kind == "texture of material":
        (folder / "own.mtl").write_text(f"newmtl painted\nmap_Kd {reference}\n")
        text, name = OBJ.format("own.mtl"), "part.obj"
    elif kind == "material":
        text, name = OBJ.format(reference), "part.obj"
    elif kind == "gltf":
        text, name = gltf(reference), "part.gltf"
    else:
        text, name = COLLADA.format(reference), "part.dae"
    (folder / name).write_text(text)
    return name


def add_texture(folder, kind):
    """Write a texture and a material file.

    Return the material file if `kind` is "material", otherwise the texture.
    """
    from PIL import Image

    folder.mkdir(exist_ok=True)
    name = folder.name
    Image.new("RGB", (2, 2), PAINT).save(folder / f"{name}.png")
    (folder / f"{name}.mtl").write_text("newmtl painted\nmap_Kd arm.png\n")
    return folder / (f"{name}.mtl" if kind == "material" else f"{name}.png")


@pytest.fixture(scope="module")
def bodies(tmp_path_factory):
    file = tmp_path_factory.mktemp("arm") / "arm.urdf"
    file.write_text(ARM.format("part"))
    return skeleton(chasles.load(file))


def is_painted(file, bodies):
    """Test whether the mesh of a URDF has its texture."""
    (mesh,) = body_meshes(file, bodies)
    material = mesh.surface.visual.material
    image = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    return image is not None and image.convert("RGB").getpixel((0, 0)) == PAINT


@pytest.mark.parametrize("kind", ["texture of material", "material", "gltf", "collada"])
def test_only_textures_next_to_the_mesh_are_opened(tmp_path, bodies, kind):
    folder = tmp_path / "arm"
    own, other = add_texture(folder, kind), add_texture(tmp_path / "outside", kind)
    (folder / "link").symlink_to(other)
    file = folder / "arm.urdf"
    outside = (f"../outside/{other.name}", str(other), other.as_uri(), "link")
    for reference in (own.name, *outside):
        file.write_text(ARM.format(write_mesh(kind, folder, reference)))
        assert is_painted(file, bodies) == (reference == own.name), reference
