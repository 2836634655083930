"""The commit hook accepts the form in CONTRIBUTING.md and reports each fault."""

import pytest

from tests.support.commit_message import faults


def test_message_with_area_and_reason_is_accepted():
    message = "inverse: find all branches\n\nA fold lost one branch.\n# a comment of git\n"
    assert faults(message) == []


@pytest.mark.parametrize(
    ("message", "fault"),
    [
        ("find all branches", "no area"),
        (f"inverse: {'a' * 64}", "has 73 characters"),
        ("inverse: find all branches.", "full stop"),
        ("inverse: find all branches\nA fold lost one branch.", "must be blank"),
    ],
    ids=["no area", "long", "full stop", "no blank line"],
)
def test_faults_of_a_message_are_named(message, fault):
    (found,) = faults(message)
    assert fault in found
