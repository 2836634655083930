"""Functions in a separate process obey time and memory limits.

An error in the separate process is raised again in the calling process.
"""

from functools import partial

import pytest

from chasles.contract import isolation
from chasles.contract.isolation import IsolatedWorkError, Limits, isolated
from chasles.derive import DescriptionError, read, read_text
from chasles.derive.build.freshness import Job, source_files
from chasles.derive.description.importers import chains

ENDLESS = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="value" value="${factorial(10**7)}"/><link name="a${value}"/></robot>"""
WIDE = """<mujoco><asset><hfield name="f" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>
<worldbody><body name="b"><joint name="j"/><geom size="0.1"/></body></worldbody></mujoco>"""
REPEATED = """<mujoco><worldbody><body name="b"><joint name="j"/><geom size="0.1"/>
<replicate count="100000000" offset="0 0 1"><body><geom size="0.1"/></body></replicate>
</body></worldbody></mujoco>"""
SHORT = Limits(seconds=0.3, memory=1 << 30)


@pytest.fixture(params=["forked", "started"])
def run(request, monkeypatch):
    """Run each test in a forked process, as on Linux, and in a new process, as on other systems."""
    if request.param == "started":
        monkeypatch.setattr(isolation, "_forked", isolation._started)
    return isolated


def test_results_and_errors_arrive(run):
    assert run(partial(pow, 2, 10)) == 1024
    with pytest.raises(ZeroDivisionError, match="division"):
        run(partial(divmod, 1, 0))


def test_limits_hold(run, tmp_path):
    file = tmp_path / "written"
    with pytest.raises(IsolatedWorkError, match=r"longer than 0\.2 s"):
        run(partial(sum, range(10**12)), Limits(seconds=0.2))
    with pytest.raises(IsolatedWorkError, match=r"0\.25 GiB"):
        run(partial(bytes, 1 << 30), Limits(memory=1 << 28))
    with pytest.raises(OSError, match="File too large"):
        run(partial(file.write_text, "x" * 100_000))


def test_errors_of_files_keep_their_fields(run, tmp_path):
    file = tmp_path / "bent.urdf"
    file.write_text('<robot name="bent">\n<link name=""/></robot>')
    with pytest.raises(DescriptionError) as caught:
        read(file)
    with pytest.raises(DescriptionError) as direct:
        read_text(file.read_text(), format="urdf", file=str(file))
    assert caught.value.file == str(file)
    assert vars(caught.value) == vars(direct.value)
    assert str(caught.value) == str(direct.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.xacro", ENDLESS), ("hfield.xml", WIDE), ("replicate.xml", REPEATED)],
    ids=["factorial", "hfield", "replicate"],
)
def test_files_that_exceed_limits_end_with_one_sentence(name, text, tmp_path, monkeypatch):
    monkeypatch.setattr(chains, "READING", SHORT)
    file = tmp_path / name
    file.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        read(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_robot_is_read_in_either_process(run, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1"/></joint></robot>'
    )
    assert read(file).joints[0].name == "j"


def test_errors_with_causes_arrive_while_dask_is_imported(tmp_path):
    """If Dask is imported, pickled errors include the causes of the errors."""
    pytest.importorskip("distributed", reason="missing package distributed")
    file = tmp_path / "arm.urdf"
    file.write_text("<robot><link>")
    with pytest.raises(DescriptionError, match="expected well-formed XML"):
        read(file)


def test_listing_the_files_of_an_endless_xacro_ends(tmp_path, monkeypatch):
    monkeypatch.setattr(chains, "READING", SHORT)
    file = tmp_path / "arm.xacro"
    file.write_text(ENDLESS)
    with pytest.raises(DescriptionError, match=r"longer than 0\.3 s"):
        source_files(Job(file, tmp_path))
