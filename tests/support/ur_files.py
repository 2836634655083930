"""Calibration files of UR arms in the format of the controller."""

LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
DELTAS = ("theta", "d", "a", "alpha")


def conf(deltas):
    """Return the text of a calibration.conf with six deviations of each DH parameter."""
    lines = [f"delta_{name} = [ {deltas[name]}]" for name in DELTAS]
    return "\n".join(["[mounting]", *lines, "joint_checksum = [ 0x6e0f7bf, 0xa32a713f]", ""])
