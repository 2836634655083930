"""Errors name the files that an incomplete xacro file needs."""

import pytest

from chasles.derive import DescriptionError
from chasles.derive.description.importers.xacro_file import _Packages, expanded
from chasles.derive.description.importers.xacro_hints import files_like, missing

pytest.importorskip("xacro", reason="xacro is not installed")

OPEN = '<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">'
MACRO = """
<xacro:macro name="paint" params="c"><material name="${c}"/></xacro:macro>
<xacro:macro name="arm" params="prefix tool:=true reach *origin">
  <link name="${prefix}base"/>
</xacro:macro>
"""
CALL = '<xacro:arm prefix="..." reach="..."><origin/></xacro:arm>'
JOINT = """
<link name="hand"/>
<joint name="mount" type="fixed"><parent link="flange"/><child link="hand"/></joint>
"""


def written(folder, package="arm", **texts):
    """Create a package folder with xacro files."""
    folder = folder / "src" / package / "urdf"
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / f"{name}.xacro").write_text(f"{OPEN}{text}</robot>")
    return folder


def refusal(file, *arguments):
    """Expand an invalid xacro file, and return the error message, which must have one line."""
    with pytest.raises(DescriptionError) as caught:
        expanded(file, arguments)
    message = str(caught.value)
    assert message.startswith(f"{file}")
    assert "\n" not in message
    return message


def include(name):
    return f'<xacro:include filename="{name}.xacro"/>'


def test_hint_for_macro_file_names_the_including_file(tmp_path):
    folder = written(
        tmp_path, parts=MACRO, whole=include("parts") + '<xacro:arm prefix="" reach="1"/>'
    )
    assert "the file only defines macros: derive " in refusal(folder / "parts.xacro")
    assert f"{folder / 'whole.xacro'}, which includes it" in refusal(folder / "parts.xacro")


def test_hint_for_unused_macro_file_shows_a_call(tmp_path):
    message = refusal(written(tmp_path, parts=MACRO) / "parts.xacro")
    assert message.endswith(f"derive a file that calls one, as {CALL}")


def test_hint_for_uncalled_included_macro_shows_a_call(tmp_path):
    folder = written(tmp_path, parts=MACRO, whole=include("parts"))
    assert refusal(folder / "whole.xacro").endswith(
        f"the file includes parts.xacro and calls no macro of it: add {CALL}"
    )


def test_file_without_links_or_macros_is_reported(tmp_path):
    assert "defines no macro" in refusal(written(tmp_path, bare="<material/>") / "bare.xacro")


def test_hint_for_partial_file_names_the_complete_file(tmp_path):
    whole = '<link name="flange"/>' + include("hand")
    folder = written(tmp_path, hand=JOINT, whole=whole)
    assert "<link" in expanded(folder / "whole.xacro", ())
    message = refusal(folder / "hand.xacro")
    assert "needs the missing link flange: derive " in message
    assert str(folder / "whole.xacro") in message


@pytest.mark.parametrize(
    ("elsewhere", "text", "words"),
    [
        ('<xacro:property name="deg" value="1"/>', '<a b="${90*deg}"/>', "it is in {other}"),
        ('<property name="deg" value="1"/>', '<a b="${90*deg}"/>', "without the prefix xacro:"),
        ("", '<a b="${90*deg}"/>', 'no <xacro:property name="deg"> is included, and none is near'),
        (
            "",
            '<a b="${x}"/><xacro:property name="x" value="1"/>',
            '<xacro:property name="x"> is defined after its use',
        ),
        (MACRO, '<xacro:arm prefix=""/>', 'no <xacro:macro name="arm"> is included: it is in'),
        ("", MACRO + '<xacro:arm prefix="" reach="1"/>', "must contain an element for each"),
        ("", MACRO + "<xacro:paint/>", "must set c"),
    ],
    ids=[
        "property in other file",
        "no prefix",
        "no property",
        "defined after use",
        "macro in other file",
        "missing block",
        "missing parameter",
    ],
)
def test_hint_locates_missing_properties_and_macros(tmp_path, elsewhere, text, words):
    folder = written(tmp_path, whole=text)
    other = written(tmp_path, "common", constants=elsewhere) / "constants.xacro"
    assert words.format(other=other) in refusal(folder / "whole.xacro")


def test_missing_package_is_reported_only_once(tmp_path):
    file = written(tmp_path, whole=include("$(find no_parts)/a")) / "whole.xacro"
    assert refusal(file).count("no package 'no_parts'") == 1
    assert "<class" not in refusal(file)


def test_hint_names_missing_xacro_argument(tmp_path):
    file = written(tmp_path, whole='<link name="$(arg side)_hand"/>') / "whole.xacro"
    assert "set side:=value" in refusal(file)
    assert "left_hand" in expanded(file, ("side:=left",))


def test_unknown_xacro_error_has_no_hint(tmp_path):
    assert missing("some other reason", tmp_path / "a.xacro") == ""


def test_hint_gives_full_argument_name(tmp_path):
    folder = written(tmp_path, whole='<link name="$(arg tool_len)"/>')
    message = refusal(folder / "whole.xacro")
    assert "argument tool_len" in message
    assert "set tool_len:=value" in message


def test_folder_that_vanishes_during_a_search_has_no_files(tmp_path):
    assert files_like(tmp_path / "vanished", "*") == []
    packages = _Packages(tmp_path / "vanished" / "arm.xacro")
    assert packages._named(tmp_path / "vanished").keys() == {"vanished"}
