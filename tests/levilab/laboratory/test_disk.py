"""What a loss of power leaves of a simulated disk."""

import errno
from random import Random

import pytest

from levilab.computer import at_another_computer
from levilab.files import replace_atomically
from levilab.laboratory.disk import SimulatedComputer
from levilab.laboratory.fate import Fate


def computer(seed):
    return SimulatedComputer(Fate(lambda _: None), Random(seed))


def left(made, path):
    """Content of a file after a loss of power; None: it is gone."""
    made.end_process(power=True)
    return path.read_bytes() if path.exists() else None


@pytest.mark.parametrize(("sync", "sync_folder"), [(True, True), (True, False), (False, True)])
def test_what_is_on_the_disk_with_its_name_stays_and_nothing_else_need(tmp_path, sync, sync_folder):
    found = set()
    for seed in range(40):
        made, path = computer(seed), tmp_path / f"{seed}"
        with made.open(path, "xb") as file:
            file.write(b"ab")
            file.flush()
            if sync:
                made.sync(file)
            if sync_folder:
                made.sync_folder(tmp_path)
            file.write(b"c")
        found.add(left(made, path))
        path.unlink(missing_ok=True)
    assert (
        found
        == {
            (True, True): {b"ab", b"abc"},
            (True, False): {b"ab", b"abc", None},
            (False, True): {b"", b"a", b"ab", b"abc"},
        }[sync, sync_folder]
    )


@pytest.mark.parametrize("whole", [True, False])
def test_a_replaced_file_is_the_old_or_the_new_one(tmp_path, whole):
    found = set()
    for seed in range(20):
        made, path = computer(seed), tmp_path / "file"
        with at_another_computer(made):
            replace_atomically(path, "old")
            if whole:
                replace_atomically(path, "new")
            else:  # without the folder's sync
                part = tmp_path / "part"
                with made.open(part, "xb") as file:
                    file.write(b"new")
                    file.flush()
                    made.sync(file)
                made.move(part, path)
        found.add(left(made, path))
        path.unlink()
        (tmp_path / "part").unlink(missing_ok=True)
    assert found == ({b"new"} if whole else {b"old", b"new"})


def test_a_full_disk_takes_a_part_and_says_so(tmp_path):
    made = computer(0)
    made.room = 3
    with made.open(tmp_path / "file", "xb") as file:
        file.write(b"abcde")
        with pytest.raises(OSError, match="No space left") as refused:
            file.flush()
    assert refused.value.errno == errno.ENOSPC
    assert (tmp_path / "file").read_bytes() == b"abc"
