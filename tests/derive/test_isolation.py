"""Work in a separate process: limits on time and memory hold, and errors arrive as they are."""

import threading
from functools import partial

import pytest

from chasles.derive import read
from chasles.derive.description.importers import chains
from chasles.derive.description.toml_file import DescriptionError
from chasles.derive.isolation import IsolatedWorkError, Limits, isolated

ENDLESS = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="value" value="${factorial(10**7)}"/><link name="a${value}"/></robot>"""
WIDE = """<mujoco><asset><hfield name="f" nrow="100000" ncol="100000" size="1 1 1 1"/></asset>
<worldbody><body name="b"><joint name="j"/><geom size="0.1"/></body></worldbody></mujoco>"""
REPEATED = """<mujoco><worldbody><body name="b"><joint name="j"/><geom size="0.1"/>
<replicate count="100000000" offset="0 0 1"><body><geom size="0.1"/></body></replicate>
</body></worldbody></mujoco>"""
SHORT = Limits(seconds=2.0, memory=1 << 30)


@pytest.fixture(params=["forked", "started"])
def is_started(request):
    """With a second thread, a new interpreter does the work."""
    stop = threading.Event()
    other = threading.Thread(target=stop.wait)
    if request.param == "started":
        other.start()
    yield request.param == "started"
    stop.set()
    if request.param == "started":
        other.join()


def test_results_and_errors_arrive(is_started):
    assert isolated(partial(pow, 2, 10)) == 1024
    with pytest.raises(ZeroDivisionError, match="division"):
        isolated(partial(divmod, 1, 0))


def test_limits_hold(is_started, tmp_path):
    file = tmp_path / "written"
    with pytest.raises(IsolatedWorkError, match="longer than 1 s"):
        isolated(partial(sum, range(10**12)), Limits(seconds=1.0))
    with pytest.raises(IsolatedWorkError, match=r"0\.25 GiB"):
        isolated(partial(bytes, 1 << 30), Limits(memory=1 << 28))
    with pytest.raises(OSError, match="File too large"):
        isolated(partial(file.write_text, "x" * 100_000))


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


def test_reading_in_a_thread_has_the_same_result(is_started, tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_text(
        '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="revolute">'
        '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1"/></joint></robot>'
    )
    assert read(file).joints[0].name == "j"
