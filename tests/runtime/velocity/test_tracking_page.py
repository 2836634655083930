"""The examples of docs/how-to/tracking.md run, and their comments are true."""

import re

from tests.support.pages import examples

PAGE = "how-to/tracking.md"


def test_tracking_page_examples_print_documented_output(capsys):
    names = {}
    for example in examples(PAGE):
        exec(compile(example, PAGE, "exec"), names)
        said = " ".join(re.findall(r"^# (.*)$", example, re.MULTILINE))
        printed = capsys.readouterr().out
        assert kept(said) == kept(printed)
        assert ("At its rate limit: wrist_" in said) == ("At its rate limit" in printed)
    assert names["track"].error[names["away"]].max() < 1e-10


def kept(text):
    """Return the words of a tracking summary that do not depend on the machine.

    Numbers and the text after "Held" depend on the machine and are left out.
    """
    return re.findall("[a-zA-Z]{2,}", text.split("Held")[0])
