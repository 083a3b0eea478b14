"""Each row of the catalogue: a model is named in the docs, and its driver works with its virtual twin.

What messages do to a twin is in virtual/bench/test_fuzz.py, which takes each row, too.
"""

import json
import re

import pytest

from instruments.catalogue import CATALOGUE
from instruments.errors import OutOfRange
from instruments.ieee488 import identity_fields
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from levilab.bench.bench import open_bench
from levilab.bench.discover import driver_for_identity
from levilab.world.bench import practice_world, virtual_bus, virtual_wiring
from support import hostile
from support.models import KIND_OF, PREPARE, ROWS, measure
from support.paths import ROOT

EACH = pytest.mark.parametrize("name", ROWS)


class Opened:
    """A model's twin in a room of its own, and its driver at a link to it."""

    def __init__(self, name):
        self.room = hostile.Room()
        self.twin = hostile.instrument(name, self.room)
        address = "ASRLbox::INSTR" if ROWS[name].driver.SERIAL else "TCPIP0::box::inst0::INSTR"
        line = {key: value for key, value in ROWS[name].driver.SERIAL.items() if key != "pause"}
        transport = open_link(address, library=library_for(VirtualBench({address: self.twin})), line=line)
        self.driver = ROWS[name].driver(transport, clock=self.room.clock)


@pytest.mark.parametrize("name", [*ROWS, "phyphox"])
def test_a_model_and_its_driver_stand_on_the_page_of_their_kind(name):
    page = (ROOT / "docs" / "instruments" / f"{KIND_OF[name]}.md").read_text(encoding="utf-8")
    assert f"`{name}`" in page
    (model,) = (model for model in CATALOGUE[KIND_OF[name]] if model.name == name)
    assert f"`{model.driver.__name__}`" in page


@pytest.mark.parametrize("kind", CATALOGUE)
def test_a_bench_finds_every_twin_by_the_identity_that_its_driver_reads(kind):
    for model in CATALOGUE[kind]:
        wiring = virtual_wiring(practice_world(), models={kind: model.name})
        with open_bench(wiring, (kind,)) as bench:
            identity = bench.instruments[kind].identity()
            assert driver_for_identity(identity) == (kind, model.name)
            assert "VIRTUAL" in identity_fields(identity)[2]  # so that a run with it is known as synthetic
            assert {type(value) for value in bench.instruments[kind].settings().values()} <= {bool, int, float, str}


@EACH
def test_a_driver_prepares_and_reads_its_twin(name):
    measure(name, Opened(name).driver)


@EACH
def test_settings_survive_a_round_trip(name):
    opened = Opened(name)
    driver = opened.driver
    PREPARE[KIND_OF[name]](driver)
    rows = [row.name for row in driver.declared_settings() if not row.on_demand]
    before = {row: getattr(driver, row) for row in rows}
    opened.twin.execute("*RST")
    for _ in range(2):  # a load changes the amplitude that was set before it
        for row in rows:
            setattr(driver, row, before[row])
    assert {row: getattr(driver, row) for row in rows} == before
    assert driver.changed_settings(driver.settings()) == {}


@EACH
def test_what_a_driver_says_of_its_settings_is_what_it_answers_and_takes(name):
    driver = Opened(name).driver
    PREPARE[KIND_OF[name]](driver)
    asked = driver.settings()
    kinds = {"number": float, "switch": bool, "word": str, "text": str}
    for about in json.loads(json.dumps(driver.describe_settings())):
        if about["column"] in asked:
            value = asked[about["column"]]
            assert isinstance(value, kinds[about["kind"]])
            assert value in (about["choices"] or about["values"] or [value])
        if about["high"] is not None:
            with pytest.raises(OutOfRange):
                setattr(driver, about["name"], 2 * about["high"] + 1)


@pytest.mark.parametrize("kind", CATALOGUE)
def test_a_model_is_chosen_in_any_case_of_its_letters(kind):
    for model in CATALOGUE[kind]:
        bench = virtual_bus(practice_world(), {kind: model.name.lower()})
        found = [twin.identity for twin in bench.instruments.values() if re.search(model.driver.MODELS, twin.identity)]
        assert driver_for_identity(found[0]) == (kind, model.name)
