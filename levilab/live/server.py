"""The server of the live view: a page, its modules, and frames over a WebSocket.

One task reads what is new 22 times a second while a page is open.  A page asks for each frame, and gets it when there
is something that it does not have: a slow page gets fewer frames, and nothing queues.
"""

import asyncio
import contextlib
import json
import math
import os
import re
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import unquote

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, PlainTextResponse, Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from levilab.animation.three import three_js
from levilab.errors import LevilabError, UsageError
from levilab.errors import unquote as unquote_names
from levilab.live.analyzed import TEXTS, Analyses, is_shown
from levilab.live.choice import Choice, choices, newest, running_run
from levilab.live.desk import Desk, parts_for, scene_of_run
from levilab.live.doors import PAGE_POLICY, REPORT_POLICY, Doors, Guard
from levilab.live.opened import Opened
from levilab.live.practice.commands import PracticeEvent
from levilab.live.running import Running
from levilab.live.tuning import advice_on
from levilab.live.watch import Watch
from levilab.live.words import data_in, page_in
from levilab.pipelines.look import QUANTITIES, name_of
from levilab.pipelines.result import beside
from levilab.runs.find import RECORD
from levilab.texts.text import ENGLISH, in_language, languages, text_of

#: Frames a second at most, so that 20 come to the page; and the longest wait of a page without news [s].
FRAMES_PER_S, PATIENCE_S = 22, 1.0
#: The runs are listed for guests, who may ask without pause, once in this time [s].
LISTED_EVERY_S = 1.0
#: Of a guest at most; and guests at most, two classes of pupils: who measures is not to notice them.
GUEST_FRAMES_PER_S, MOST_GUESTS = 10, 60
#: Time between two looks for runs of other programs [s].
_OTHERS_EVERY_S = 2.0
#: What a page asks for that keeps to the bench for practice and its runs, whatever others record; no run has this name.
OWN_BENCH = "."
#: The longest question of a page [bytes].
_LONGEST_ASK = 4096
#: The language that was chosen in a browser, and for how long it is kept [s].
_COOKIE, _KEPT_S = "levilab_language", 365 * 86400
PAGE = Path(__file__).parent / "page"
_ONLY_LOOK = "this page may only look: open the address that the terminal shows"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".png": "image/png",
          ".svg": "image/svg+xml"}  # fmt: skip


@dataclass
class Hall:
    """What the server knows: the runs in a folder, the bench for practice, and what pages look at.

    Attributes:
        root: the folder with the runs.
        shown: name of the run that a page shows at first; empty: the newest.
        doors: who may come in.
        desk: the bench for practice; None where runs are only looked at.
        guests: who may come in from the network; None where the view is not shared.
        language: of pages at which none was chosen; empty: of the browser.
        opened: data files that were opened, and the folder for dropped ones, beside that with the runs.
    """

    root: Path
    shown: str
    doors: Doors
    desk: Desk | None = None
    guests: Doors | None = None
    language: str = ""
    watches: dict[str, Watch] = field(default_factory=dict)
    pages: dict[str, int] = field(default_factory=dict)  # name of a run → how many look at it
    new: asyncio.Event = field(default_factory=asyncio.Event)
    analyses: Analyses = field(default_factory=Analyses)
    opened: Opened = field(init=False)

    def __post_init__(self) -> None:
        """Place dropped files beside the runs, which they are none of."""
        self.opened = Opened(self.root.parent / "opened")

    def is_run(self, name: str) -> bool:
        """Return whether a run of this name lies in the folder; a name with a way to elsewhere does not."""
        plain = bool(name) and name == Path(name).name and name not in {".", ".."}
        try:
            return plain and (self.root / name / RECORD).exists()
        except OSError:  # the name is too long for a file
            return False

    @contextlib.contextmanager
    def watching(self, name: str) -> Iterator[Watch]:
        """Yield the watch of a run, shared by all pages that look at it.

        Args:
            name: of the run; "" is what the bench for practice recorded last, or what another program records now;
                OWN_BENCH the former alone.
        """
        if name not in self.watches:
            is_chosen = name not in {"", OWN_BENCH}
            recorded = self.desk.folder if self.desk else None
            folder = self.root / name if is_chosen else recorded
            self.watches[name] = Watch(folder, self.desk.address if self.desk else None, stays=is_chosen)
        self.pages[name] = self.pages.get(name, 0) + 1
        try:
            yield self.watches[name]
        finally:
            self.pages[name] -= 1
            if not self.pages[name]:
                del self.pages[name]
                self.watches.pop(name).close()

    def scene(self, name: str) -> dict[str, Any] | None:
        """Return the scene of the bench that pages see with a run; None where it is not known.

        Args:
            name: of the run that is shown, also where no page chose it; "" is none, beside the bench for practice.
        """
        of_other_program = any(
            watch.has_own_bench and watch.followed and watch.followed.folder.name == name
            for watch in self.watches.values()
        )
        if self.desk and not of_other_program:
            return self.desk.scene
        return scene_of_run(self.root / name) if self.is_run(name) else None

    async def read_on(self) -> None:
        """Read the news of all runs that pages show, for ever."""
        fitting: set[asyncio.Task[None]] = set()
        before = self._ticks()
        while True:
            begin = time.monotonic()
            if self.desk:
                self.desk.step()
            for watch in [*self.watches.values()]:
                with watch.failing_alone():
                    watch.step()
                if not fitting and (task := watch.fit_task()):
                    job = asyncio.create_task(self._fit(watch, *task))
                    fitting.add(job)
                    job.add_done_callback(fitting.discard)
            if (now := self._ticks()) != before:  # also by what came since the last round, as a fit
                self._announce()
            before = now
            await asyncio.sleep(max(0.005, 1 / FRAMES_PER_S - (time.monotonic() - begin)))

    async def look_for_others(self) -> None:
        """Look for runs of other programs, for ever."""
        while True:
            await asyncio.sleep(_OTHERS_EVERY_S)
            await self.turn_to_another()

    async def turn_to_another(self) -> None:
        """Let pages that chose no run turn to the one that is recorded: that of the practice bench before others."""
        desk, watch = self.desk, self.watches.get("")
        if desk is None or watch is None:
            return
        if not desk.is_recording:
            if watch.followed and watch.followed.status == "running":
                return
            folder = await asyncio.to_thread(running_run, self.root, [*desk.folders])
        if desk.is_recording:  # it may have begun meanwhile
            folder = desk.folder
        if folder:
            watch.turn_to(folder)

    def _ticks(self) -> list[int]:
        return [*(watch.tick for watch in self.watches.values()), self.desk.count if self.desk else 0]

    async def _fit(self, watch: Watch, folder: Path, compute: Callable[[], Running | None]) -> None:
        with watch.failing_alone():
            watch.take_fit(folder, *await asyncio.to_thread(_time_task, compute))

    def _announce(self) -> None:
        self.new.set()
        self.new = asyncio.Event()

    async def wait_for_news(self, watch: Watch, tick: object) -> None:
        """Return once there is news for a page, or it has waited long enough."""
        before = self.desk.count if self.desk else 0
        await self._wait(lambda: watch.tick != tick or (self.desk is not None and self.desk.count != before))

    async def wait_for_answer(self, desk: Desk, number: int) -> PracticeEvent | None:
        """Return the answer of the bench for practice to a command; None if it takes longer than PATIENCE_S."""
        await self._wait(lambda: number in desk.answers)
        return desk.answers.get(number)

    async def _wait(self, is_over: Callable[[], bool]) -> None:
        """Wait for something that comes with news, PATIENCE_S at most."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE_S):
                while not is_over():
                    await self.new.wait()


def _time_task(task: Callable[[], Running | None]) -> tuple[Running | None, float]:
    """Return the result of a task and the processor time of this thread [s]: waiting for others costs none."""
    begin = time.thread_time()
    return task(), time.thread_time() - begin


class Pages:
    """What is sent for each request.

    Args:
        hall: what the server knows.
        doors: of those whom these pages are for.
    """

    def __init__(self, hall: Hall, doors: Doors) -> None:
        self.hall, self.doors = hall, doors
        self.for_guests = doors is hall.guests
        self.sockets = 0
        self._listed: tuple[float, list[Choice]] = (-math.inf, [])
        self._lists = asyncio.Lock()
        top = Path(__file__).parents[1] / "animation" / "top.js"
        self.files = {path.name: path for path in PAGE.iterdir()} | {
            "three.js": three_js("the live view"),
            "top.js": top,
        }

    def _file(self, path: Path, policy: str = PAGE_POLICY) -> Response:
        return FileResponse(path, media_type=_TYPES.get(path.suffix, "text/plain"), headers=self.doors.headers(policy))

    def _json(self, document: Any, status: int = 200) -> Response:
        return JSONResponse(document, status, headers=self.doors.headers())

    async def page(self, request: Request) -> Response:
        """Return the page."""
        return self._page("live.html", request)

    async def open(self, request: Request) -> Response:
        """Return the page on which data files are opened."""
        return self._page("open.html", request)

    def _page(self, name: str, request: Request) -> Response:
        """Return a page in its language, which is kept where its address has it."""
        code = _language(request, self.hall)
        page, result = (self.files[one].read_text("utf-8") for one in (name, "result.html"))
        answer = HTMLResponse(page_in(page.replace("<!--result-->", result), code), headers=self.doors.headers())
        if code == request.query_params.get("language"):
            answer.set_cookie(_COOKIE, code, _KEPT_S, samesite="strict", httponly=True)
        return answer

    async def part(self, request: Request) -> Response:
        """Return a module or the style sheet of the page."""
        found = self.files.get(request.path_params["name"])
        return self._file(found) if found else _nothing()

    async def runs(self, _: Request) -> Response:
        """Return the runs to choose from, and the first data of the page."""
        hall = self.hall
        async with self._lists:
            if not self.for_guests or time.monotonic() > self._listed[0] + LISTED_EVERY_S:
                self._listed = time.monotonic(), await asyncio.to_thread(choices, hall.root)
        found = self._listed[1]
        first = hall.shown or newest(found) or ""
        practice = hall.desk.about | {"guest": self.for_guests} if hall.desk else None
        about = {"runs": [asdict(one) for one in found], "first": first, "practice": practice}
        return self._json(about | {"opens": not self.for_guests})

    async def parts(self, request: Request) -> Response:
        """Return the parts of the top to draw."""
        scene = self.hall.scene(request.query_params.get("run", ""))
        return self._json(await asyncio.to_thread(parts_for, scene))

    def _input(self, request: Request) -> Path | None:
        """Return the run, or the data file that is open, of a request; None where there is none."""
        name = request.path_params["input"]
        if request.path_params["kind"] == "run":
            return self.hall.root / name if self.hall.is_run(name) else None
        one = self.hall.opened.files.get(name)
        return one.path if one else None

    async def result(self, request: Request) -> Response:
        """Return a figure or the report of an input."""
        path, name = self._input(request), request.path_params["name"]
        place = beside(path) if path else None
        return self._file(place.file(name), REPORT_POLICY) if place and is_shown(place, name) else _nothing()

    async def analysis(self, request: Request) -> Response:
        """Return the progress of an input's analysis, and its answer."""
        path = self._input(request)
        about: dict[str, Any] = self.hall.analyses.about(path) if path else {"failed": ""}
        language = _language(request, self.hall)
        for what in TEXTS:
            about[what] = [unquote_names(in_language(text, language)) for text in about.get(what, ())]
        return self._json(about | {"failed": in_language(about["failed"], language)})

    async def export(self, request: Request) -> Response:
        """Return an input as NetCDF, as `levilab export` writes it."""
        path, language = self._input(request), _language(request, self.hall)
        if path is None or not self.doors.knows(request.headers.get("x-levilab-token")):
            return self._json({"error": in_language(_ONLY_LOOK, language)}, 403)
        with TemporaryDirectory() as folder:
            file = Path(folder) / "run.nc"
            words = ["export", str(path), "--out", str(file)]
            status, err = await asyncio.to_thread(self.hall.analyses.carry_out, words)
            if status:
                return self._json({"error": err.strip()[-600:]}, 400)
            return Response(file.read_bytes(), media_type="application/x-netcdf", headers=self.doors.headers())

    async def take(self, request: Request) -> Response:
        """Keep a file that is dropped into a page, and open it."""
        if not self.doors.knows(request.headers.get("x-levilab-token")):
            return self._json({"error": in_language(_ONLY_LOOK, _language(request, self.hall))}, 403)
        name = unquote(request.headers.get("x-levilab-name", ""))
        try:
            key = await self.hall.opened.receive(name, request.stream())
        except LevilabError as error:
            return self._json({"error": in_language(text_of(error), _language(request, self.hall))}, 400)
        return self._json({"file": key})

    async def do(self, request: Request) -> Response:
        """Carry out a command."""
        body = b""
        async for piece in request.stream():
            body += piece
            if len(body) > _LONGEST_ASK:
                return self._json({"error": "the command is too long"}, 413)
        language = _language(request, self.hall)
        answer, status = await _carry_out(self.hall, request.headers.get("x-levilab-token"), body, language)
        if error := answer.get("error"):
            answer["error"] = unquote_names(in_language(error, language))
        return self._json(data_in(language, answer), status)

    async def frames(self, socket: WebSocket) -> None:
        """Send a frame for each question, FRAMES_PER_S at most, until the page goes.

        Questions that come faster wait: uvicorn reads no further while one is unread.
        """
        hall, name, language = self.hall, socket.query_params.get("run", ""), _language(socket, self.hall)
        await socket.accept()
        if not (name in {"", OWN_BENCH if hall.desk else ""} or hall.is_run(name)):
            await socket.close(4404)
            return
        if self.for_guests and self.sockets >= MOST_GUESTS:
            await socket.close(1013)
            return
        frames_per_s = GUEST_FRAMES_PER_S if self.for_guests else FRAMES_PER_S
        with self._counted(), hall.watching(name) as watch, contextlib.suppress(WebSocketDisconnect, RuntimeError):
            with watch.failing_alone():
                watch.step()
            again = 0.0
            while (text := (await socket.receive()).get("text")) is not None and len(text) <= _LONGEST_ASK:
                ask = _table(text)
                await asyncio.sleep(max(0.0, again - time.monotonic()))
                again = time.monotonic() + 1 / frames_per_s
                await hall.wait_for_news(watch, ask.get("tick"))
                said = hall.desk.events_after(ask.get("said")) if hall.desk else []
                said = [one | {"text": unquote_names(in_language(one["text"], language))} for one in said]
                if self.for_guests:  # where the runs lie is no concern of theirs
                    said = [one | {"text": one["text"].replace(f"{hall.root}{os.sep}", "")} for one in said]
                await socket.send_bytes(watch.frame(ask, said, language))
            await socket.close(1003 if text is None else 1009)

    @contextlib.contextmanager
    def _counted(self) -> Iterator[None]:
        self.sockets += 1
        try:
            yield
        finally:
            self.sockets -= 1


def application(hall: Hall) -> Guard:
    """Return the ASGI application.  Raises MissingThree."""
    pages = Pages(hall, hall.doors)

    @contextlib.asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(work()) for work in (hall.read_on, hall.look_for_others)]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()

    own = [
        Route("/do", pages.do, methods=["POST"]),
        Route("/open", pages.open),
        Route("/file", pages.take, methods=["POST"]),
        Route("/{kind}/{input}/analysis", pages.analysis),
        Route("/{kind}/{input}/export", pages.export, methods=["POST"]),
        Route("/{kind}/{input}/{name}", pages.result),
    ]
    shared = (Starlette(routes=_views(Pages(hall, hall.guests))), hall.guests) if hall.guests else None
    return Guard(Starlette(routes=[*_views(pages), *own], lifespan=lifespan), hall.doors, shared)


def _views(pages: Pages) -> list[BaseRoute]:
    """Return the routes of those who only look: guests have no other."""
    return [
        Route("/", pages.page),
        Route("/runs", pages.runs),
        Route("/parts", pages.parts),
        Route("/page/{name}", pages.part),
        WebSocketRoute("/frames", pages.frames),
    ]


def _language(request: Request | WebSocket, hall: Hall) -> str:
    """Return the language of the page that asks: of its address, else chosen last in this browser, else its own."""
    weighted = re.findall(r"(?:^|,)\s*(\w+)[^,;]*(?:;\s*q=([01]\.?\d*))?", request.headers.get("accept-language", ""))
    of_browser = [code for code, weight in sorted(weighted, key=lambda one: -float(one[1] or 1)) if float(weight or 1)]
    codes = request.query_params.get("language"), request.cookies.get(_COOKIE), hall.language, *of_browser
    return next((code for code in codes if code in languages()), ENGLISH)


def _nothing() -> Response:
    return PlainTextResponse("there is no such file", 404)


def _table(text: str) -> dict[str, Any]:
    """Return a page's question; anything else than a table asks for everything."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


async def _carry_out(hall: Hall, token: str | None, body: bytes, language: str) -> tuple[dict[str, Any], int]:
    """Carry out the command of a page with the token.  Return the answer, and the status of the request."""
    if not hall.doors.knows(token):
        return {"error": _ONLY_LOOK}, 403
    try:
        return await _do(hall, _table(body.decode("utf-8", "replace")), language)
    except LevilabError as error:
        return {"error": text_of(error)}, 400


async def _do(hall: Hall, wanted: dict[str, Any], language: str) -> tuple[dict[str, Any], int]:
    """Carry out a command.  Raises LevilabError."""
    if act := _FILE_COMMANDS.get(str(wanted.get("do"))):
        return await asyncio.to_thread(act, hall, wanted | {"language": language}), 200
    if hall.desk is None:
        return {"error": "there is no bench for practice: levilab live --mock brings one"}, 404
    if wanted.get("do") == "analyze":
        return _analyze(hall, str(wanted.get("run")), language)
    number = hall.desk.carry_out(wanted)
    answer = await hall.wait_for_answer(hall.desk, number)
    if answer is not None and answer.kind == "refused":
        return {"error": answer.text}, 200  # the request was right, and a browser lists no failure of it
    return {"number": number}, 202 if answer is None else 200


def _analyze(hall: Hall, name: str, language: str) -> tuple[dict[str, Any], int]:
    if not hall.is_run(name):
        return {"error": "there is no such run"}, 404
    hall.analyses.begin(hall.root / name, language=language)
    return {}, 200


# --- data files that are open ---


def _list_files(hall: Hall, _: dict[str, Any]) -> dict[str, Any]:
    files = [{"file": key, "name": name_of(one.path)} for key, one in hall.opened.files.items()]
    units = {name: {"words": words, "units": units} for name, (words, units) in QUANTITIES.items()}
    return {"files": files, "folder": str(hall.opened.folder), "quantities": units}


def _look_at_file(hall: Hall, wanted: dict[str, Any]) -> dict[str, Any]:
    options = wanted.get("options")
    return hall.opened.look(wanted.get("file", ""), options if isinstance(options, dict) else None)


def _keep(hall: Hall, wanted: dict[str, Any]) -> dict[str, Any]:
    return {"kept": hall.opened.keep(wanted.get("file", ""))}


def _analyze_file(hall: Hall, wanted: dict[str, Any]) -> dict[str, Any]:
    one = hall.opened.get(wanted.get("file"))
    hall.analyses.begin(one.path, one.words, wanted["language"], one.words_of_film)
    return {}


def _advise(_: Hall, wanted: dict[str, Any]) -> dict[str, Any]:
    try:
        return advice_on(wanted)
    except UsageError as error:
        return {"error": text_of(error)}  # the request was right, and a browser lists no failure of it


_FILE_COMMANDS = {
    "say which washers": _advise,
    "list files": _list_files,
    "look at a file": _look_at_file,
    "keep": _keep,
    "analyze a file": _analyze_file,
}
