"""What a log says of the way to the first reading."""

import multiprocessing

from levilab.present.progress import LineDisplay, ShareBar


def test_a_log_has_a_line_each_fifth_of_each_part_and_none_twice(capsys):
    display = LineDisplay()
    for k, share in enumerate((0.1, 0.21, 0.19, 0.2, 0.4, 0.5, 0.6, 0.8, 0.79, 1.0), 1):  # noise takes it back a bit
        display.preparing(f"raised by {k} Hz", share)
    for k in range(1, 11):
        display.preparing("held", k / 10)
    assert capsys.readouterr().err.splitlines() == [*(f"raised by {k} Hz" for k in (2, 5, 7, 8, 10)), "held"]


def test_a_log_calls_the_time_left_of_a_bench_that_jumps_bench_time(capsys):
    for bench_time in (False, True):
        LineDisplay(bench_time=bench_time).reading("25 Hz", 10.0, (95.0, 95.0))
    assert capsys.readouterr().err.splitlines() == [
        "25 Hz   about 1:35 min left",
        "25 Hz   about 1:35 min of bench time left",
    ]


def test_a_worker_process_shows_no_share_beside_that_of_its_parent(capsys, monkeypatch):
    ShareBar("films", line_every=0.0)(0.5)
    assert capsys.readouterr().err == "films: 50 %\n"
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: "a process")
    ShareBar("films", line_every=0.0)(0.5)
    assert not capsys.readouterr().err
