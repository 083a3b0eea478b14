"""A published value beside ours: verdicts, and that a wrong number, ours or theirs, is noticed."""

import json
import math

import pytest

from levilab.reproduce.check import Among, Because, Comparison, Verdict, Within, as_document, erratum, statement
from levilab.reproduce.check import check as checked
from levilab.simulator.published.printed import Printed, published, several
from support.paths import ROOT

PUBLISHED = ROOT / "levilab/simulator/published"
MEAN = Printed("21.86", "Hz", "ten", "a thesis")


def check(value, way=None, u=None):
    given = () if way is None else (way,)
    return checked("mean", MEAN, value, *given, u=u)


@pytest.mark.parametrize(
    ("value", "u", "verdict"),
    [
        (21.86, None, Verdict.AGREES),
        (21.8649, None, Verdict.AGREES),
        (21.8651, None, Verdict.UNEXPECTED),
        (21.8449, 0.01, Verdict.UNEXPECTED),
        (21.8451, 0.01, Verdict.AGREES),
        (None, None, Verdict.UNEXPECTED),
        (math.nan, None, Verdict.UNEXPECTED),
    ],
)
def test_a_number_agrees_within_the_rounding_of_the_print_and_our_u(value, u, verdict):
    assert check(value, u=u).verdict is verdict


def test_a_tolerance_has_a_reason_and_an_edge():
    assert check(21.95, Within(0.1, "a step of the scan")).verdict is Verdict.AGREES
    assert check(21.95, Within(0.1, "a step of the scan")).why == "within 0.1: a step of the scan"
    assert check(21.97, Within(0.1, "a step of the scan")).verdict is Verdict.UNEXPECTED


def test_a_number_that_the_start_decides_agrees_within_the_range_of_starts():
    falls = Among(21.6, 22.4, 0.0, "48 starts fall there")
    assert check(22.2, falls).verdict is Verdict.AGREES
    assert check(22.2, falls).comparison is Comparison.RANGE  # which is worth less, and the row says what it proves
    assert "21.600 to 22.400" in check(22.2, falls).why
    assert check(22.2, Among(21.9, 22.4, 0.0, "")).verdict is Verdict.UNEXPECTED
    assert check(22.2, Among(21.9, 22.4, 0.04, "")).verdict is Verdict.AGREES


def test_a_difference_needs_a_reason_that_gives_the_published_value():
    assert check(24.0, Because("x is a misprint", 21.861)).verdict is Verdict.DIFFERS
    assert check(24.0, Because("x is a misprint", 21.90)).verdict is Verdict.UNEXPECTED
    assert check(24.0, Because("x is a misprint", 21.90, 0.05)).verdict is Verdict.DIFFERS
    assert check(24.0, Because("it is torn", explained=True)).verdict is Verdict.DIFFERS
    assert check(24.0, Because("it is torn", explained=False)).verdict is Verdict.UNEXPECTED
    assert check(21.86, Because("no reason is needed", explained=False)).why == ""


def slip(truth, by_printed, by_corrected):
    numbers = {"truth": truth, "by_printed": by_printed, "by_corrected": by_corrected}
    return erratum("(1)", "lacks ½", "with ½", "energy", tolerance=1e-6, **numbers)


def test_an_erratum_holds_if_the_correction_is_right_and_the_print_is_wrong():
    assert slip(1.0, 2.0, 1.0).verdict is Verdict.DIFFERS
    assert slip(1.0, None, 1.0).verdict is Verdict.DIFFERS
    assert slip(2.0, 2.0, 1.0).verdict is Verdict.UNEXPECTED  # the print was right after all
    assert slip(1.0, 1.0, 1.0).verdict is Verdict.UNEXPECTED
    assert slip(1.0, 2.0, 1.1).verdict is Verdict.UNEXPECTED


def test_a_statement_agrees_differs_for_a_reason_or_is_ours_alone():
    assert statement("a", "b", "it is", "it is", holds=True).verdict is Verdict.AGREES
    assert statement("a", "b", "", "it is", holds=True).verdict is Verdict.ADDED
    assert statement("a", "b", "it is", "it is not", holds=False).verdict is Verdict.UNEXPECTED
    assert statement("a", "b", "it is", "it is not", holds=False, reason="that").verdict is Verdict.DIFFERS


def test_a_document_has_no_number_that_json_has_not():
    for one in (check(math.nan), check(21.8), slip(1.0, math.nan, 1.0), statement("a", "b", "c", "d", holds=True)):
        json.dumps(as_document(one), allow_nan=False)


@pytest.mark.parametrize("source", sorted(path.stem for path in PUBLISHED.glob("*.toml")))
def test_every_published_number_has_digits_a_place_and_a_rounding(source):
    found = published(source)
    assert len(found) > 5
    for one in found.values():
        assert one.place
        assert one.source
        assert 0 < one.rounding <= max(abs(one.value), 1.0)


def test_the_published_constants_are_those_of_the_tables():
    assert [one.value for one in several("thesis", "spindown.c2")] == [1.760e-5, 1.707e-5, 1.669e-5, 1.772e-5]
    assert len(several("thesis", "measured.limits")) == 10
    simon = published("simon-1997")
    assert [simon[f"top.{k}.lower"].value for k in (1, 2, 3)] == [98, 120, 103]
