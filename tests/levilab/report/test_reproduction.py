"""How to reproduce a report: commands as one types them, hashes, seeds."""

import hashlib
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import read_options
from levilab.present.document.blocks import Code, Details, Note
from levilab.report.reproduction import Asked, paths_in_commands, reproduction
from support.paths import SAMPLE_DATA


def test_columns_that_are_not_named_are_not_given():
    # or the names that an earlier result has would be replaced by none, and stand in the page as an option
    assert read_options({"columns": ""}) == {}
    assert read_options({"columns": "t=1,f=2"}) == {"columns": {"t": "1", "f": "2"}}


def test_the_command_of_a_report_has_the_paths_the_options_and_the_format_that_were_asked_for():
    given = {"columns": {"t": "1", "f": "spin, Hz"}, "rate": None, "uncertainty": "covariance", "keep_outliers": True}
    asked = Asked((Path("runs"), Path("a b.csv")), "short.pdf", given, crosscheck=False)
    words = "runs 'a b.csv' --columns 't=1,f=spin, Hz' --keep-outliers --no-crosscheck -o short.pdf"
    assert asked.command([]) == f"levilab report {words}"


def test_of_many_inputs_the_paths_are_named_that_were_typed():
    # their folders would be "many" and ".", which holds more
    sources = [SimpleNamespace(path=Path("many") / f"{k}.csv") for k in range(14)]
    sources.append(SimpleNamespace(path=Path("r.csv")))
    assert paths_in_commands(sources, [Path("many"), Path("r.csv"), Path("traces")]) == ["many", "r.csv"]
    assert paths_in_commands(sources[:14]) == ["many"]


def test_options_that_no_command_can_hold_are_named_as_they_are_typed():
    field = ANALYSES["field"]
    given = read_options({"device": SAMPLE_DATA / "device.toml", "height": 75.8}, typed=True)
    found = field.analyze([SAMPLE_DATA / "field-scan"], field.options_from(given))
    section = reproduction([(field, found)], Asked())
    assert [block.text for block in section.blocks if isinstance(block, Note)] == [
        "Besides, these options were given: --device."
    ]
    (code,) = (block for block in section.blocks if isinstance(block, Code))
    assert "field-scan --height 75.8\n" in code.text


def test_commands_hashes_seeds_and_what_recorded_it_are_there(tmp_path):
    run = shutil.copytree(SAMPLE_DATA / "lower-limits", tmp_path / "a run")
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    record |= {"seed": 7, "command_line": ["/usr/bin/levilab", "acquire", "limit", "--note", "it's"], "software": {}}
    (run / "run.json").write_text(json.dumps(record), encoding="utf-8")
    limit = ANALYSES["limit"]
    found = limit.analyze([run], limit.options_from({"reading_u": 0.06}))
    section = reproduction([(limit, found)], Asked())
    (code,) = (block for block in section.blocks if isinstance(block, Code))
    assert code.text.splitlines() == [
        f"levilab analyze limit '{run}' --reading-u 0.06",
        f"levilab report '{run}' -o report.html",
    ]
    data, recorded = next(block for block in section.blocks if isinstance(block, Details)).blocks
    digest = hashlib.sha256((run / "readings.csv").read_bytes()).hexdigest()
    assert [row.cells for row in data.table.rows] == [("a run", "readings.csv", "7", digest)]
    (facts,) = recorded.blocks
    assert facts.facts[0].texts == ("""levilab acquire limit --note 'it'"'"'s'""",)


def test_what_recorded_all_runs_alike_is_said_once(tmp_path):
    for k in range(3):
        run = shutil.copytree(SAMPLE_DATA / "lower-limits", tmp_path / f"run-{k}")
        with (run / "readings.csv").open("a", encoding="utf-8") as file:
            file.write(f"21.{k}\n")  # the same readings would be one run that was copied
        record = json.loads((run / "run.json").read_text(encoding="utf-8")) | {"software": {}}
        record["command_line"] = ["levilab", "acquire", "limit", *(["--note", "late"] if k == 2 else [])]
        (run / "run.json").write_text(json.dumps(record), encoding="utf-8")
    limit = ANALYSES["limit"]

    def recorded(*runs):
        found = limit.analyze(list(runs))
        of_data = next(one for one in reproduction([(limit, found)], Asked()).blocks if isinstance(one, Details))
        (facts,) = of_data.blocks[1].blocks
        return [(fact.name, fact.texts) for fact in facts.facts]

    one, two, late = (tmp_path / f"run-{k}" for k in range(3))
    assert recorded(one, two) == [("all 2 runs", ("levilab acquire limit",))]
    assert [name for name, _ in recorded(one, late)] == ["run-0", "run-2"]
