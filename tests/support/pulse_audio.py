"""A PulseAudio server of a test's own, with a null sink: what is played there can be recorded from its monitor."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import wave
from contextlib import contextmanager
from pathlib import Path

import pytest

from support.waiting import HANG_GUARD_S

RATE = 48_000
_COMMANDS = ("pulseaudio", "paplay")


@contextmanager
def null_sink():
    """Run a server whose default input is the monitor of a null sink; gives the environment of its clients.

    Skips the test where PulseAudio, PortAudio, or the plugin that joins them is missing.
    """
    if missing := [name for name in _COMMANDS if shutil.which(name) is None]:
        pytest.skip(f"{' and '.join(missing)} not installed: a sound card is not tried with PulseAudio's null sink")
    with tempfile.TemporaryDirectory(prefix="levilab-pulse-") as folder:  # short: the name of a socket
        socket = Path(folder) / "native"
        environment = os.environ | {"PULSE_SERVER": f"unix:{socket}", "PULSE_COOKIE": f"{folder}/cookie"}
        own = dict.fromkeys(("HOME", "PULSE_RUNTIME_PATH", "PULSE_STATE_PATH", "PULSE_CONFIG_PATH"), folder)
        command = ["pulseaudio", "-n", "--daemonize=no", "--exit-idle-time=-1", "--use-pid-file=no", "--disable-shm"]
        command += ["-L", f"module-native-protocol-unix socket={socket} auth-anonymous=1"]
        command += ["-L", f"module-null-sink sink_name=bench rate={RATE} format=s16le channels=1"]
        with subprocess.Popen(command, env=environment | own, stderr=subprocess.DEVNULL) as server:
            try:
                _wait_for(socket, server)
                _skip_without_inputs(environment)
                yield environment
            finally:
                server.terminate()


def _wait_for(socket, server):
    end = time.monotonic() + HANG_GUARD_S
    while not socket.exists():
        if server.poll() is not None:
            pytest.skip("PulseAudio does not start here")
        assert time.monotonic() < end
        time.sleep(0.01)


def _skip_without_inputs(environment):
    ask = "from instruments.links.sound import inputs; print(inputs())"
    found = subprocess.run([sys.executable, "-c", ask], env=environment, capture_output=True, text=True, check=False)
    if found.stdout.strip() in {"", "()"}:
        why = (found.stderr.strip().splitlines() or ["PortAudio lists no input: libasound2-plugins"])[-1]
        pytest.skip(f"no sound input: {why}")


@contextmanager
def playing(samples, path, environment):
    """Play samples, shape (n,), from a WAV file into the null sink, until the end of the block at most."""
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(samples.astype("<i2").tobytes())
    with subprocess.Popen(["paplay", "--device=bench", str(path)], env=environment) as player:
        try:
            yield
        finally:
            player.terminate()
