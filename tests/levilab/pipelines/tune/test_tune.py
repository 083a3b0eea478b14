"""Which washers today: what the owner's file keeps, and what is advised."""

import pytest

from analysis.tuning import Outcome
from levilab.errors import DataError, UsageError
from levilab.formats.typed import read_mass, read_masses, read_temperature
from levilab.pipelines.tune.advice import advise
from levilab.pipelines.tune.owner import Owner, Scan, read_owner, read_scan, write_owner
from support.paths import ROOT

G = 1e-3
SCAN, DEVICE = ROOT / "sample_data" / "field-scan", ROOT / "sample_data" / "device.toml"
OWNER = Owner(24.9 * G, (0.06 * G, 0.06 * G, 0.1 * G, 0.2 * G))


A_SCAN = Scan(
    path='a "b"', temperature_c=20.0, mass_to_set_kg=0.025, mass_to_set_u_kg=1e-4, lightest_kg=0.0245,
    heaviest_kg=0.0255,
)  # fmt: skip


def told(*trials, owner=OWNER):
    for text in trials:
        owner = owner.with_trial(text)
    return owner


# --- as people type it ---


@pytest.mark.parametrize(("text", "value"), [("25", 0.025), ("25g", 0.025), (" 60 mg", 6e-5), ("0.025 kg", 0.025)])
def test_a_mass_is_read_with_its_unit_or_in_grams(text, value):
    assert read_mass(text) == value


#: What reads it → what it refuses: no mass, no temperature of a room, washers to be read in two ways, and no trial.
REFUSED = {
    read_mass: ("", "g", "24,98 g", "-1 g", "24.98 s", "25 25", "2 kg", "1e400 g", "0 g"),
    read_temperature: ("21,5", "294", "21 g", "-40 C", "hot"),
    read_masses: ("0,06", "0,06 + 0,1 g", "0.06,,0.1", "0.06 mm", "60 mg + 0.1", "60 mg, 0.1, 0.2 g"),
    told: (
        *("", "rises", "24.98 g, rises", "24.98 g, 20 C", "24.98 g, 20 C, flies", "24,98 g, 20,5 C, rises"),
        *("x, 20 C, rises", "24.98 g, 20 C, s"),  # sinks, or sideways
    ),
}


@pytest.mark.parametrize(("read", "text"), [(read, text) for read, texts in REFUSED.items() for text in texts])
def test_what_is_not_what_is_read_or_doubtful_is_refused(read, text):
    with pytest.raises(ValueError, match="expected"):
        read(text)


@pytest.mark.parametrize(("text", "mass", "washers"), [
    ("24.98 g, 20.5 C, rises", 24.98, None), ("0.1+0.06 g, 20.5 °C, RISES", 25.06, (0.06 * G, 0.1 * G)),
    ("0.06, 0.1 g, 68.9 F, r", 25.06, (0.06 * G, 0.1 * G)), ("none, 293.65 K, rises", 24.9, ()),
])  # fmt: skip
def test_a_trial_is_read_by_its_mass_or_its_washers(text, mass, washers):
    (one,) = told(text).attempts
    assert (one.mass, one.outcome) == (pytest.approx(mass * G), Outcome.RISES)
    assert one.temperature == pytest.approx(20.5)
    assert (one.washers is None) == (washers is None)
    assert one.washers == pytest.approx(washers)
    assert told(one.text).attempts == (one,)  # as the file has it


# --- the file ---


def test_the_file_keeps_all_and_reads_as_a_person_writes(tmp_path):
    file = tmp_path / "tune.toml"
    owner = told("24.98 g, 20.5 C, rises", "0.06+0.1 g, 20.5 C, floats")
    owner = Owner(owner.top, owner.washers, owner.attempts, A_SCAN)
    write_owner(file, owner)
    assert read_owner(file) == owner
    assert '  "0.06 + 0.1 g, 20.5 °C, floats",' in file.read_text("utf-8").splitlines()
    assert [path.name for path in tmp_path.iterdir()] == ["tune.toml"]


@pytest.mark.parametrize(("text", "seen"), [
    ("top = 24.9", "top = '24.9'"), ('top = "24.9 s"', "top, washers: a mass"), ("tops = 1", "did you mean top?"),
    ("top", "Expected '='"),
    ('top = "24 g"\ntrials = ["0.06 g, 20 C, flies"]', "trials, number 1 "), ('trials = ["25 g, 20 C, rises"]', "top"),
])  # fmt: skip
def test_a_damaged_file_is_named_with_its_fault(text, seen, tmp_path):
    file = tmp_path / "tune.toml"
    file.write_text(text, "utf-8")
    with pytest.raises(DataError) as refused:
        read_owner(file)
    assert str(refused.value).startswith(f"{file}: ")
    assert seen in str(refused.value)
    assert file.read_text("utf-8") == text


# --- the advice ---


def test_after_a_top_that_rose_washers_are_added():
    advice = advise(told("0.06 g, 21 C, rises"), 21.0)
    assert advice.text.startswith("Add the 0.")
    assert advice.why.startswith("It rose at 24.96 g and 21 °C. The middle")
    assert advice.best.floats == max(one.floats for one in advice.choices) or len(advice.best.washers_kg) < 4
    assert sum((advice.best.rises, advice.best.floats, advice.best.sinks)) == pytest.approx(1)


def test_warmth_takes_washers_off_and_says_why():
    owner = told("0.06+0.06+0.1 g, 19 C, rises", "0.06+0.06+0.2 g, 19 C, floats", "0.06+0.06+0.1+0.2 g, 19 C, sinks")
    same, warm = advise(owner, 19.0), advise(owner, 21.0)
    assert sum(warm.best.washers_kg) < sum(same.best.washers_kg)
    assert "Take off" in warm.text
    assert "Today is 2 K warmer, which moves the window by −0.2" in warm.why


def test_what_floated_stays_as_it_is():
    advice = advise(told("0.1 g, 21 C, floats"), 21.0)
    assert advice.text.startswith("Leave the washers as they are: the top then weighs 25 g ")
    assert advice.best.floats > 0.8


def test_a_top_that_slid_sideways_is_first_set_level():
    advice = advise(told("0.1 g, 21 C, floats", "0.1 g, 21 C, sideways"), 21.0)
    assert advice.text.startswith("Raise the base on the side to which the top slid")


@pytest.mark.parametrize(("trial", "words"), [
    ("0.06+0.06+0.1+0.2 g, 21 C, rises", "Even with all washers it would rise: 0."),
    ("none, 21 C, sinks", "Even without washers it would sink: it is 0."),
])  # fmt: skip
def test_washers_that_do_not_reach_are_named_with_what_is_missing(trial, words):
    assert words in advise(told(trial, trial), 21.0).why


def test_a_trial_against_all_others_is_named():
    rest = ["0.1 g, 21 C, floats", "0.2 g, 21 C, floats"]
    assert advise(told(*rest), 21.0).warnings == ()
    (warning,) = advise(told(*rest, "0.06+0.1 g, 21 C, rises"), 21.0).warnings
    assert warning.startswith("trial 3 (0.06 + 0.1 g, 21 °C, rises) does not go with")
    (warning,) = advise(told("none, 21 C, sinks", "0.06+0.1 g, 21 C, rises"), 21.0).warnings
    assert warning.startswith("trial 1 (none, 21 °C, sinks) does not go with")


def test_washers_on_the_top_are_not_changed_for_others_of_the_same_mass():
    owner = told("0.1+0.1 g, 21 C, floats", owner=Owner(24.9 * G, (0.1 * G, 0.1 * G, 0.2 * G)))
    assert advise(owner, 21.0).text.startswith("Leave the washers as they are")


def test_of_washers_that_promise_nearly_the_same_the_fewest_are_changed():
    owner = Owner(24.9 * G, (0.1 * G, 0.05 * G, 0.05 * G, 0.02 * G))
    assert advise(owner, 21.0).text.startswith("Put on the 0.1 g washer:")  # 0.02 g more promise less than 2 % more


def test_a_likelier_choice_of_the_table_is_told_with_its_cost():
    advice = advise(told("0.1 g, 20.5 C, rises", owner=Owner(24.9 * G, (0.06 * G, 0.06 * G, 0.1 * G, 0.2 * G))), 21.5)
    assert max(one.floats for one in advice.choices) > advice.best.floats + 0.005
    assert "0.06 + 0.06 + 0.1 + 0.2 g floats with 47 %, but takes more changes." in advice.why


# --- the scan ---


def test_a_scan_gives_the_mass_to_set_at_another_temperature():
    owner = Owner(24.5 * G, OWNER.washers, scan=read_scan(SCAN, 20.0, DEVICE, lambda _: None))
    cold, warm = (advise(owner, degrees).values["mass_to_set"] for degrees in (20.0, 25.0))
    assert cold.value == pytest.approx(owner.scan.mass_to_set_kg, rel=1e-4)
    assert warm.value / cold.value == pytest.approx(0.98, abs=1e-3)  # 5 K at −0.4 %/K
    assert "By the scan the middle was 25.2(4) g at 20 °C" in advise(owner, 25.0).why


@pytest.mark.parametrize(("path", "temperature", "device", "error", "words"), [
    (SCAN, 20.0, None, DataError, "the moment of your top and its u are not known"),
    (SCAN, None, DEVICE, UsageError, "scan_temperature: is needed"),
    (SCAN.parent / "spin-down-1", 20.0, None, DataError, "is no Hall scan"),
])  # fmt: skip
def test_a_scan_that_says_nothing_of_this_top_is_refused(path, temperature, device, error, words):
    with pytest.raises(error, match=words):
        read_scan(path, temperature, device, lambda _: None)
