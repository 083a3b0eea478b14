"""Pictures on the disk and in pages."""

import os
import re
from unittest.mock import Mock
from xml.etree import ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from levilab.present.style import STYLE, WIDE, as_pdf, as_png, as_svg, save_png
from support.figures import faults


def test_a_picture_that_cannot_be_written_leaves_the_older_one(tmp_path, monkeypatch):
    path = tmp_path / "picture.png"
    save_png(Figure(), path)
    older = path.read_bytes()
    monkeypatch.setattr(os, "fsync", Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space"):
        save_png(Figure(), path)
    assert path.read_bytes() == older
    assert [found.name for found in tmp_path.iterdir()] == ["picture.png"]


def test_a_picture_is_never_written_through_a_link(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("not a picture", encoding="utf-8")
    try:
        (tmp_path / "picture.png").symlink_to(precious)
    except OSError:
        pytest.skip("this system makes no links")
    save_png(Figure(), tmp_path / "picture.png")
    assert precious.read_text(encoding="utf-8") == "not a picture"


def drawing(gid="readings-a"):
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDE, 3))
        axes = figure.add_axes((0.1, 0.2, 0.8, 0.7))
        (line,) = axes.plot([0, 1, 2, 3], [1.0, 3.0, 2.0, 5.0], "o-")
        line.set_gid(gid)
        axes.axhspan(1, 2, hatch="//", alpha=0.2)
        axes.set_title("--> <script>alert(1)</script>")
    return figure


def test_two_figures_of_a_page_share_no_id_and_refer_to_their_own():
    pages = [as_svg(drawing(), prefix) for prefix in ("one", "two")]
    ids, references = (
        [set(re.findall(pattern, page)) for page in pages]
        for pattern in (r'\bid="([^"]*)"', r'(?:href="#|url\(#)([^")]*)')
    )
    assert ids[0].isdisjoint(ids[1])
    assert len(ids[0]) == len(ids[1]) > 10
    for own, used in zip(ids, references, strict=True):
        assert used
        assert used <= own


def test_each_marker_of_a_named_line_is_one_use_in_the_order_of_the_points():
    root = ET.fromstring(as_svg(drawing(), "p"))
    (group,) = [one for one in root.iter("{http://www.w3.org/2000/svg}g") if one.get("id") == "p-readings-a"]
    marks = [one for one in group.iter() if one.tag.endswith("}use")]
    places = [(float(one.get("x") or "nan"), float(one.get("y") or "nan")) for one in marks]
    assert len(places) == 4
    assert [x for x, _ in places] == sorted(x for x, _ in places)
    assert np.argsort([-y for _, y in places]).tolist() == [0, 2, 1, 3]  # y counts downwards


def test_an_inlined_figure_has_no_rule_for_the_page_and_nothing_but_marks():
    page = as_svg(drawing(), "p", title='"><script>')
    assert page.startswith("<svg ")
    assert not re.search(r"<(script|style|!|\?|metadata)", page)
    root = ET.fromstring(page)
    assert root.get("aria-label") == '"><script>'


def test_a_prefix_that_would_become_markup_is_refused():
    with pytest.raises(ValueError, match="begins with a letter"):
        as_svg(drawing(), 'a" onload="')


def test_what_a_person_has_set_in_a_matplotlibrc_changes_nothing():
    own = as_svg(drawing())
    with mpl.rc_context({"axes.facecolor": "yellow", "font.size": 20, "lines.linewidth": 9, "text.color": "red"}):
        assert as_svg(drawing()) == own


def test_the_same_figure_is_saved_as_the_same_bytes_with_its_fonts_inside():
    page = as_pdf(drawing())
    assert page == as_pdf(drawing())
    assert as_svg(drawing()) == as_svg(drawing())
    assert as_png(drawing()) == as_png(drawing())
    assert b"/FontFile2" in page
    assert b"/CreationDate" not in page


def test_what_lies_over_a_line_or_a_bar_is_found():
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], label="slope")
    axes.vlines([0.2], 0, 1)
    for x, y, text in ((0.5, 0.48, "on the slope"), (0.18, 0.7, "on a bar"), (0.8, 0.1, "free")):
        axes.text(x, y, text)
    assert faults(figure) == ["'on the slope' over the line slope", "'on a bar' over a bar"]
