"""The virtual bench as a PyVISA library: it translates PyVISA's calls into those of a session."""

import itertools
import math
from collections.abc import Callable, Iterable
from typing import Any, TypeVar, cast

from pyvisa import constants, rname
from pyvisa.constants import EventAttribute, ResourceAttribute, StatusCode
from pyvisa.highlevel import ResourceInfo, VisaLibraryBase
from pyvisa.typing import VISARMSession, VISASession
from pyvisa.util import LibraryPath

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.serial_line import SerialLine
from instruments.virtual.bench.session import LinkLost, Session
from instruments.virtual.core.line import LineSettings

T = TypeVar("T")
Link = Session | SerialLine
Attributes = dict[int, Any]
_numbers = itertools.count(1)
#: The attributes of a VISA session when it is opened (VPP-4.3, 3.2 and 5.1).
_DEFAULT_ATTRIBUTES: dict[int, Any] = {
    ResourceAttribute.timeout_value: 2000,
    ResourceAttribute.termchar: ord("\n"),
    ResourceAttribute.termchar_enabled: False,
    ResourceAttribute.send_end_enabled: True,
    ResourceAttribute.resource_lock_state: constants.AccessModes.no_lock,
    ResourceAttribute.resource_manufacturer_name: "levilab",
    ResourceAttribute.interface_number: 0,
}
#: The same for a serial line (VPP-4.3, 5.1.2): 9600 baud, 8N1.
_SERIAL_ATTRIBUTES: dict[int, Any] = {
    ResourceAttribute.asrl_baud_rate: 9600,
    ResourceAttribute.asrl_data_bits: 8,
    ResourceAttribute.asrl_parity: constants.Parity.none,
    ResourceAttribute.asrl_stop_bits: constants.StopBits.one,
    ResourceAttribute.asrl_flow_control: constants.ControlFlow.none,
    ResourceAttribute.asrl_end_in: constants.SerialTermination.termination_char,
    ResourceAttribute.asrl_end_out: constants.SerialTermination.none,
}


class LevilabVisaLibrary(VisaLibraryBase):
    """A PyVISA library whose only resources are the instruments of one virtual bench."""

    bench: VirtualBench | None
    _sessions: dict[int, tuple[Link, Attributes]]

    @staticmethod
    def get_library_paths() -> Iterable[LibraryPath]:
        """Return one name: there is nothing to look for on disk."""
        return (LibraryPath("levilab"),)

    def _init(self) -> None:
        self.bench = None
        self._sessions = {}

    def _bench(self) -> VirtualBench:
        """Return the bench of this library; the default one, made at the first use, where none was given."""
        if self.bench is None:
            self.bench = self.default_bench()
        return self.bench

    def default_bench(self) -> VirtualBench:
        """Make the bench of a library that was opened by its name alone; ``pyvisa_levilab`` does."""
        raise NotImplementedError

    def open_default_resource_manager(self) -> tuple[VISARMSession, StatusCode]:
        """ViOpenDefaultRM."""
        return cast("VISARMSession", next(_numbers)), self.handle_return_value(None, StatusCode.success)

    def list_resources(self, session: VISARMSession, query: str = "?*::INSTR") -> tuple[str, ...]:
        """ViFindRsrc."""
        return rname.filter(self._bench().instruments, query)

    def parse_resource_extended(self, session: VISARMSession, resource_name: str) -> tuple[ResourceInfo, StatusCode]:
        """ViParseRsrcEx; resource names know no case (VPP-4.3, 4.3.1), pyvisa's parser knows INSTR only."""
        return super().parse_resource_extended(session, resource_name.upper())

    def open(
        self,
        session: VISARMSession,
        resource_name: str,
        access_mode: constants.AccessModes = constants.AccessModes.no_lock,
        open_timeout: int | None = constants.VI_TMO_IMMEDIATE,
    ) -> tuple[VISASession, StatusCode]:
        """ViOpen."""
        opened = self._bench().open(self._name_on_bench(resource_name))
        if opened is None:
            return cast("VISASession", 0), self.handle_return_value(None, StatusCode.error_resource_not_found)
        parsed = rname.parse_resource_name(resource_name.upper())
        serial = parsed.interface_type_const == constants.InterfaceType.asrl
        attributes = (
            _DEFAULT_ATTRIBUTES
            | (_SERIAL_ATTRIBUTES if serial else {})
            | {
                ResourceAttribute.resource_name: resource_name,
                ResourceAttribute.resource_class: parsed.resource_class,
                ResourceAttribute.interface_type: parsed.interface_type_const,
            }
        )
        link = SerialLine(opened, _line_settings(attributes)) if serial else opened
        if access_mode == constants.AccessModes.exclusive_lock and not link.client_lock.acquire(link, None):
            return cast("VISASession", 0), self.handle_return_value(None, StatusCode.error_resource_locked)
        attributes[ResourceAttribute.resource_lock_state] = access_mode
        number = cast("VISASession", next(_numbers))
        self._sessions[number] = (link, attributes)
        return number, self.handle_return_value(number, StatusCode.success)

    def _name_on_bench(self, resource_name: str) -> str:
        """Return the bench's own spelling of a name: PyVISA fills in what is left out (USB's interface, boards)."""
        wanted = _canonical(resource_name)
        return next((name for name in self._bench().instruments if _canonical(name) == wanted), resource_name)

    def close(self, session: Any) -> StatusCode:
        """ViClose."""
        link, _ = self._sessions.pop(session, (None, {}))
        if link:
            link.close()
        return self.handle_return_value(session, StatusCode.success)

    def connect(self, address: str) -> Callable[[bytes, float], bytes]:
        """Return what carries requests over HTTP to an instrument of the bench, see `instruments.links.http.Exchange`.

        The instrument is given the first line of a request.
        """

        def exchange(request: bytes, within: float) -> bytes:
            session = self._bench().open(address)
            if session is None:
                raise ConnectionError("no such instrument on the virtual bench, or it is away")
            try:
                session.write(request.partition(b"\r\n")[0])
                data, ended = b"", False
                while not ended:
                    if (got := session.read(1 << 20, within)) is None:
                        raise TimeoutError
                    data, ended = data + got[0], got[1]
            except LinkLost:
                raise ConnectionError("the connection was lost") from None
            finally:
                session.close()
            return data

        return exchange

    def _use(
        self, session: VISASession, act: Callable[[Link, Attributes], tuple[T, StatusCode]], otherwise: T
    ) -> tuple[T, StatusCode]:
        """Do something with the link of a session.

        Args:
            session: its number.
            act: takes the link and its attributes, and returns a result and a status.
            otherwise: the result where another program has locked the instrument, or the link is lost.
        """
        link, attributes = self._sessions[session]
        try:
            if link.client_lock.excludes(link):
                result, status = otherwise, StatusCode.error_resource_locked
            else:
                result, status = act(link, attributes)
        except LinkLost:
            result, status = otherwise, StatusCode.error_connection_lost
        return result, self.handle_return_value(session, status)

    def write(self, session: VISASession, data: bytes) -> tuple[int, StatusCode]:
        """ViWrite."""

        def act(link: Link, attributes: Attributes) -> tuple[int, StatusCode]:
            link.write(bytes(data), end=bool(attributes[ResourceAttribute.send_end_enabled]))
            return len(data), StatusCode.success

        return self._use(session, act, 0)

    def read(self, session: VISASession, count: int) -> tuple[bytes, StatusCode]:
        """ViRead: read to the end of the answer, to the termination character if that is on, or `count` bytes."""

        def act(link: Link, attributes: Attributes) -> tuple[bytes, StatusCode]:
            timeout = _seconds(attributes[ResourceAttribute.timeout_value])
            return _read(link, count, timeout, _termchar(attributes))

        return self._use(session, act, b"")

    def clear(self, session: VISASession) -> StatusCode:
        """ViClear."""
        return self._use(session, lambda link, _: (link.clear(), StatusCode.success), None)[1]

    def flush(self, session: VISASession, mask: constants.BufferOperation) -> StatusCode:
        """ViFlush: drop what was received and not read."""
        return self._use(session, lambda link, _: (link.discard(), StatusCode.success), None)[1]

    def read_stb(self, session: VISASession) -> tuple[int, StatusCode]:
        """ViReadSTB."""
        return self._use(session, lambda link, _: (link.status_byte(), StatusCode.success), 0)

    def assert_trigger(self, session: VISASession, protocol: constants.TriggerProtocol) -> StatusCode:
        """ViAssertTrigger."""
        return self._use(session, lambda link, _: (link.trigger(), StatusCode.success), None)[1]

    # --- locks ---

    def lock(
        self, session: VISASession, lock_type: constants.Lock, timeout: int, requested_key: str | None = None
    ) -> tuple[str, StatusCode]:
        """ViLock; a shared lock with the same key lets its holders through."""
        link, attributes = self._sessions[session]
        shared, modes = lock_type == constants.Lock.shared, constants.AccessModes
        key = (requested_key or f"levilab-{next(_numbers)}") if shared else None
        if not link.client_lock.acquire(link, key):
            return "", self.handle_return_value(session, StatusCode.error_resource_locked)
        attributes[ResourceAttribute.resource_lock_state] = modes.shared_lock if shared else modes.exclusive_lock
        return key or "", self.handle_return_value(session, StatusCode.success)

    def unlock(self, session: VISASession) -> StatusCode:
        """ViUnlock."""
        link, attributes = self._sessions[session]
        link.client_lock.release(link)
        attributes[ResourceAttribute.resource_lock_state] = constants.AccessModes.no_lock
        return self.handle_return_value(session, StatusCode.success)

    def get_attribute(self, session: Any, attribute: ResourceAttribute | EventAttribute) -> tuple[Any, StatusCode]:
        """ViGetAttribute."""
        _, attributes = self._sessions[session]
        if attribute not in attributes:
            return None, self.handle_return_value(session, StatusCode.error_nonsupported_attribute)
        return attributes[attribute], self.handle_return_value(session, StatusCode.success)

    def set_attribute(self, session: VISASession, attribute: ResourceAttribute, attribute_state: Any) -> StatusCode:
        """ViSetAttribute."""
        link, attributes = self._sessions[session]
        attributes[attribute] = attribute_state
        if isinstance(link, SerialLine):
            link.settings = _line_settings(attributes)
        return self.handle_return_value(session, StatusCode.success)

    # --- events: there are none, and a program that asks for one gets the error of any VISA without them ---

    def enable_event(self, session: VISASession, event_type: Any, mechanism: Any, context: None = None) -> StatusCode:
        """ViEnableEvent."""
        return self.handle_return_value(session, StatusCode.error_invalid_event)

    def wait_on_event(self, session: VISASession, in_event_type: Any, timeout: int) -> tuple[Any, Any, StatusCode]:
        """ViWaitOnEvent."""
        return in_event_type, None, self.handle_return_value(session, StatusCode.error_invalid_event)

    def install_handler(
        self, session: VISASession, event_type: Any, handler: Any, user_handle: Any
    ) -> tuple[Any, Any, Any, StatusCode]:
        """ViInstallHandler."""
        return handler, user_handle, handler, self.handle_return_value(session, StatusCode.error_invalid_event)

    def uninstall_handler(
        self, session: VISASession, event_type: Any, handler: Any, user_handle: Any = None
    ) -> StatusCode:
        """ViUninstallHandler."""
        return self.handle_return_value(session, StatusCode.error_handler_not_installed)

    def disable_event(self, session: VISASession, event_type: Any, mechanism: Any) -> StatusCode:
        """ViDisableEvent: there are no events."""
        return self.handle_return_value(session, StatusCode.success)

    def discard_events(self, session: VISASession, event_type: Any, mechanism: Any) -> StatusCode:
        """ViDiscardEvents: there are no events."""
        return self.handle_return_value(session, StatusCode.success)


def _canonical(resource_name: str) -> str:
    try:
        return rname.to_canonical_name(resource_name.upper()).upper()
    except rname.InvalidResourceName:
        return resource_name.upper()


def _read(link: Link, count: int, timeout: float, termchar: bytes) -> tuple[bytes, StatusCode]:
    """Read until there are `count` bytes, the answer ends, or nothing more comes in time."""
    data = b""
    while len(data) < count:
        got = link.read(count - len(data), timeout, until=termchar)
        if got is None:
            return data, StatusCode.error_timeout
        data += got[0]
        if termchar and data.endswith(termchar):
            return data, StatusCode.success_termination_character_read
        if got[1]:
            return data, StatusCode.success
    return data, StatusCode.success_max_count_read


def _seconds(timeout: int) -> float:
    """Convert VISA's milliseconds to seconds; its largest number means without end."""
    return math.inf if timeout == constants.VI_TMO_INFINITE else timeout / 1000


def _line_settings(attributes: Attributes) -> LineSettings:
    """Return the program's end of a serial line; VISA counts stop bits in tenths and parities from none to space."""
    return LineSettings(
        int(attributes[ResourceAttribute.asrl_baud_rate]),
        int(attributes[ResourceAttribute.asrl_data_bits]),
        "NOEMS"[int(attributes[ResourceAttribute.asrl_parity])],
        int(attributes[ResourceAttribute.asrl_stop_bits]) / 10,
    )


def _termchar(attributes: Attributes) -> bytes:
    """Return the character that ends a read, or none; a serial line has one by default (VI_ATTR_ASRL_END_IN)."""
    serial = attributes.get(ResourceAttribute.asrl_end_in) == constants.SerialTermination.termination_char
    wanted = attributes[ResourceAttribute.termchar_enabled] or serial
    return bytes([attributes[ResourceAttribute.termchar]]) if wanted else b""


def library_for(bench: VirtualBench) -> LevilabVisaLibrary:
    """Make a library for this bench alone, to pass to ``pyvisa.ResourceManager``."""
    library = LevilabVisaLibrary(f"levilab-{next(_numbers)}")
    library.bench = bench
    return library
