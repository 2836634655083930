"""Operation counts of the generated C stay small."""

import json
import re

import pytest

from chasles.derive.program.counting import count_operations
from tests.support.derivations import FULL, GENERATED, NAMES, made

UR_FK, UR_FK_AND_JACOBIAN = 90, 125


def manifest(name):
    return json.loads((GENERATED / name / "manifest.json").read_text())


def test_ur5e_operation_counts_stay_below_limits():
    counts = {f["name"]: f["operations"]["total"] for f in manifest("ur5e")["functions"]}
    assert counts["fk"] <= UR_FK
    assert counts["fk_jacobian_mixed"] <= UR_FK_AND_JACOBIAN


@pytest.mark.parametrize("name", [name for name in FULL if name in NAMES])
def test_manifest_operation_counts_match_c_source(name):
    source = (GENERATED / name / f"{name}.c").read_text()
    for function in manifest(name)["functions"]:
        if function["role"] == "inverse":
            # The C code of an inverse kinematics function is a loop whose body computes one branch,
            # but the manifest counts the operations of all branches.
            continue
        body = source.split(f"void {function['symbol']}(")[1].split("\n}\n")[0]
        counts = function["operations"]
        assert body.count(" * ") == counts["multiply"]
        assert len(re.findall(r"\w\]? [-+] ", body)) == counts["add"]
        angles = int(re.search(r"chasles_cos_sin\((\d+)|$", body).group(1) or 0)
        assert angles <= counts["trig"] <= 2 * angles + body.count("atan2(")
        assert counts["total"] == sum(v for k, v in counts.items() if k != "total")
        assert counts == count_operations(made(name).whole[function["name"]]).as_dict()
