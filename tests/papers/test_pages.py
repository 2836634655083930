"""The report of the papers: its page, its tables and its picture files."""

import pages
from report import Printed, agrees

ROW = agrees(Printed("a < b | c", "1.0", "mm", "table 1"), 0.001)


def test_html_page_contains_rows_and_embedded_pictures(tmp_path):
    picture = tmp_path / "figure_1.png"
    picture.write_bytes(b"pixels")
    chapter = pages.Chapter("photo_robot", "Title", "Source", (ROW,), {"figure 1: <x>": picture}, 1)
    page = pages.html_page([chapter])
    assert "<td>a &lt; b | c (table 1):</td>" in page
    assert "<td>The paper prints 1.0 mm; chasles computes 1.00 mm.</td>" in page
    assert 'src="data:image/png;base64,cGl4ZWxz"' in page
    assert "figure 1: &lt;x&gt;" in page
    assert "<td>1</td>" + 7 * "<td>0</td>" in page, "one row agrees"
    assert "<td>1</td><td>2</td><td>0</td><td>0</td><td>0</td>" in page, "two digits refute it"
    assert "http" not in page, "the report is one file"


def test_pipe_in_a_cell_keeps_table_columns():
    head, line, row = pages.table(pages.HEAD, [pages.cells(ROW)])
    assert head.count("|") == line.count("|") == row.replace("\\|", "").count("|")


def test_asterisks_in_a_cell_stay_asterisks():
    *_, row = pages.table(("equation", "value"), [("2*S_A*cos(theta)", "1")])
    assert row == r"| 2\*S_A\*cos(theta) | 1 |"


def test_captions_become_file_names(tmp_path):
    assert pages.slug("figure 3 a: r1 from zero") == "figure_3_a"
    made = pages.written(tmp_path / "motion", lambda path: path.write_bytes(b"GIF"))
    assert (made.name, made.read_bytes()) == ("motion.gif", b"GIF")
