"""Ctrl-C and its kin: the first is noted, the second breaks through once, and nothing after the shield."""

import signal
import threading

import pytest

from levilab.interruption import (
    Interrupted,
    end_process_at_interruption,
    ignore_all_signals,
    interruption_ends_process,
    interruption_postponed,
    watching_for_interruption,
)

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


@pytest.fixture(autouse=True)
def handlers():
    """Every signal as a terminal leaves it to a program, whatever started the tests; restored afterwards."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in SIGNALS}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", SIGNALS)
def test_the_first_signal_is_only_noted_and_raised_where_it_is_looked_for(number):
    with watching_for_interruption() as stop:
        stop.check()  # no signal has come yet
        signal.raise_signal(number)
        assert stop.by == number.name
        with pytest.raises(Interrupted) as interruption:
            stop.check()
    assert interruption.value.by == number.name
    assert str(interruption.value) == f"interrupted by {number.name}"


@pytest.mark.parametrize("number", SIGNALS)
def test_the_second_signal_breaks_through_once(number):
    with watching_for_interruption() as stop, stop.let_second_signal_through():
        signal.raise_signal(number)
        with pytest.raises(Interrupted):
            signal.raise_signal(number)
        signal.raise_signal(number)  # outputs are going off: not again
        with pytest.raises(Interrupted):
            stop.check()


def test_while_a_run_is_made_or_completed_signals_are_only_noted():
    with watching_for_interruption() as stop:
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)
        with stop.let_second_signal_through(), pytest.raises(Interrupted):
            stop.check()
        signal.raise_signal(signal.SIGINT)
    with watching_for_interruption() as stop:
        with stop.let_second_signal_through():
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(Interrupted):
                stop.check()
            signal.raise_signal(signal.SIGINT)  # on the way out already
        signal.raise_signal(signal.SIGINT)


def test_two_different_signals_count_together():
    with watching_for_interruption() as stop, stop.let_second_signal_through():
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(Interrupted, match="SIGINT"):
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("before", [0, 1])
def test_nothing_breaks_through_the_shield(before):
    with watching_for_interruption() as stop, stop.let_second_signal_through():
        for _ in range(before):
            signal.raise_signal(signal.SIGINT)
        stop.shield()
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)
        assert stop.by == "SIGINT"  # noted nevertheless


def test_the_handlers_are_those_from_before_after_any_end():
    before = {number: signal.getsignal(number) for number in SIGNALS}
    with watching_for_interruption() as stop:
        assert all(signal.getsignal(number) is stop for number in SIGNALS)
    assert {number: signal.getsignal(number) for number in SIGNALS} == before

    with pytest.raises(ZeroDivisionError), watching_for_interruption():
        raise ZeroDivisionError
    assert {number: signal.getsignal(number) for number in SIGNALS} == before

    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no hang-up")
def test_a_run_started_with_nohup_outlives_its_terminal():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with watching_for_interruption() as stop:
        signal.raise_signal(signal.SIGHUP)
        stop.check()
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


def test_in_another_thread_signals_are_left_to_the_main_one():
    before, seen = signal.getsignal(signal.SIGINT), []

    def watch():
        with watching_for_interruption() as stop:
            stop.check()
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=watch)
    thread.start()
    thread.join()
    assert seen == [before]


def test_postponed_ctrl_c_waits_until_it_is_admitted():
    with interruption_postponed() as admit:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            admit()
        with pytest.raises(KeyboardInterrupt):  # from here on it comes at once
            signal.raise_signal(signal.SIGINT)


def test_postponed_ctrl_c_comes_at_the_end_at_the_latest():
    reached = False
    with pytest.raises(KeyboardInterrupt), interruption_postponed():  # noqa: PT012 (the end of the block raises)
        signal.raise_signal(signal.SIGINT)
        reached = True
    assert reached
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_while_modules_are_imported_ctrl_c_ends_the_process_in_one_line(monkeypatch, capfd):
    ended = []
    monkeypatch.setattr("os._exit", ended.append)
    with interruption_ends_process(130, "interrupted\n"):
        signal.raise_signal(signal.SIGINT)
    assert (ended, capfd.readouterr().err) == ([130], "interrupted\n")
    with pytest.raises(KeyboardInterrupt):  # from here on it is Python's
        signal.raise_signal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    assert end_process_at_interruption(130) is None  # what a shell had it ignore stays ignored
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def test_while_python_ends_no_signal_gives_the_status():
    ignore_all_signals()
    for number in SIGNALS:
        signal.raise_signal(number)
