"""What the tests of the servers share."""

import faulthandler

import pytest

from support.served import AT_MOST, serving


@pytest.fixture(autouse=True)
def hang_guard():
    """Twenty minutes, reached by a test that hangs alone."""
    faulthandler.dump_traceback_later(2 * AT_MOST, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture(autouse=True)
def patient_servers(monkeypatch):
    """A client that a busy machine delays is not sent away."""
    monkeypatch.setattr("instruments.virtual.servers.clients.FIRST_WORDS", AT_MOST)
    monkeypatch.setattr("instruments.virtual.servers.hislip.SECOND_CHANNEL", AT_MOST)


@pytest.fixture
def served():
    with serving() as served:
        yield served
