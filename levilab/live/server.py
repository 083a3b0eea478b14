"""The server of the live view: a page, its modules, and frames over a WebSocket.

One task reads what is new 20 times a second while a page is open.  A page asks for each frame, and gets it when there is
something that it does not have: a slow page gets fewer frames, and nothing queues.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from dataclasses import asdict, dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from levilab.errors import LevilabError
from levilab.live.analyzed import FIGURES, REPORT, Analyses
from levilab.live.choice import choices, newest
from levilab.live.desk import parts_for, scene_of_run
from levilab.live.doors import REPORT_POLICY, Doors, Guard
from levilab.live.watch import Watch
from levilab.runs.run import RECORD

if TYPE_CHECKING:
    from levilab.live.desk import Desk

#: Frames a second, at most; and so long a page waits for a frame in which nothing is new [s].
FRAMES_PER_S, PATIENCE_S = 20, 1.0
#: The longest question of a page [bytes].
_LONGEST_ASK = 4096
PAGE = Path(__file__).parent / "page"
_TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".png": "image/png",
          ".svg": "image/svg+xml"}  # fmt: skip


class NoThree(LevilabError):
    """The graphics library of the page is not installed."""


def three_js() -> Path:
    """Return the module with three.js, which comes inside of nicegui.  Raises NoThree.  It imports nothing."""
    found = find_spec("nicegui")
    for folder in (found.submodule_search_locations or ()) if found else ():
        path = Path(folder, "elements", "scene", "dist", "index.js")
        if path.is_file():
            return path
    raise NoThree('the live view needs nicegui 3.18 or newer: pip install "levilab[live]"')


@dataclass
class Hall:
    """What the server knows: the runs in a folder, the bench for practice, and what pages look at.

    Attributes:
        root: the folder with the runs.
        shown: name of the run that a page shows at first; empty: the newest.
        doors: who may come in.
        desk: the bench for practice; None where runs are only looked at.
    """

    root: Path
    shown: str
    doors: Doors
    desk: Desk | None = None
    watches: dict[str, Watch] = field(default_factory=dict)
    pages: dict[str, int] = field(default_factory=dict)  # name of a run → how many look at it
    new: asyncio.Event = field(default_factory=asyncio.Event)
    analyses: Analyses = field(default_factory=Analyses)

    def is_run(self, name: str) -> bool:
        """Whether a run of this name lies in the folder; a name with a way to elsewhere does not."""
        return bool(name) and name == Path(name).name and (self.root / name / RECORD).exists()

    def first(self) -> str:
        """The run that a page shows if it names none."""
        return self.shown or newest(choices(self.root)) or ""

    @contextlib.contextmanager
    def watching(self, name: str) -> Any:
        """The watch of a run, shared by all pages that look at it; "" is the bench for practice."""
        if name not in self.watches:
            bench = self.desk.address if self.desk and not name else None
            self.watches[name] = Watch(self.root / name if name else None, bench)
        self.pages[name] = self.pages.get(name, 0) + 1
        try:
            yield self.watches[name]
        finally:
            self.pages[name] -= 1
            if not self.pages[name]:
                del self.pages[name]
                self.watches.pop(name).close()

    async def read_on(self) -> None:
        """Read what is new for all pages, for ever."""
        fitting: set[asyncio.Task[None]] = set()
        while True:
            begin = time.monotonic()
            before = self._ticks()
            if self.desk:
                self.desk.step()
            for watch in [*self.watches.values()]:
                watch.step()
                if not fitting and (task := watch.fit_task()):
                    job = asyncio.create_task(self._fit(watch, task))
                    fitting.add(job)
                    job.add_done_callback(fitting.discard)
            if before != self._ticks():
                self._announce()
            await asyncio.sleep(max(0.005, 1 / FRAMES_PER_S - (time.monotonic() - begin)))

    def _ticks(self) -> list[int]:
        return [*(watch.tick for watch in self.watches.values()), self.desk.count if self.desk else 0]

    async def _fit(self, watch: Watch, task: Any) -> None:
        begin = time.monotonic()
        found = await asyncio.to_thread(task)
        watch.fitted(found, time.monotonic() - begin)

    def _announce(self) -> None:
        self.new.set()
        self.new = asyncio.Event()

    async def wait_for_news(self, watch: Watch, tick: object) -> None:
        """Return when there is something newer than a page has, or it has waited long enough."""
        end = time.monotonic() + PATIENCE_S
        before = self.desk.count if self.desk else 0
        while watch.tick == tick and (not self.desk or self.desk.count == before) and (left := end - time.monotonic()) > 0:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self.new.wait(), left)


def application(hall: Hall) -> Any:
    """Return the ASGI application."""
    from starlette.applications import Starlette
    from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
    from starlette.routing import Route, WebSocketRoute
    from starlette.websockets import WebSocketDisconnect

    three, top = three_js(), Path(__file__).parents[1] / "motion" / "animation" / "top.js"
    files = {path.name: path for path in PAGE.iterdir()} | {"three.js": three, "top.js": top}

    def file(path: Path, policy: str | None = None) -> Response:
        headers = hall.doors.headers(policy) if policy else hall.doors.headers()
        return FileResponse(path, media_type=_TYPES.get(path.suffix, "text/plain"), headers=headers)

    async def page(_: Any) -> Response:
        return file(files["live.html"])

    async def part(request: Any) -> Response:
        found = files.get(request.path_params["name"])
        return file(found) if found else PlainTextResponse("there is no such file", 404)

    async def runs(_: Any) -> Response:
        found = await asyncio.to_thread(choices, hall.root)
        about = {"runs": [asdict(one) for one in found], "first": hall.first(), "folder": str(hall.root)}
        about["practice"] = hall.desk.about if hall.desk else None
        return JSONResponse(about, headers=hall.doors.headers())

    async def of_run(request: Any) -> Response:
        name, wanted = request.path_params["run"], request.path_params["name"]
        path = hall.root / name / wanted
        if not hall.is_run(name) or not (wanted == REPORT or FIGURES.fullmatch(wanted)) or not path.is_file():
            return PlainTextResponse("there is no such file", 404)
        return file(path, REPORT_POLICY)

    async def analysis(request: Any) -> Response:
        name = request.path_params["run"]
        about = hall.analyses.about(hall.root / name) if hall.is_run(name) else {}
        return JSONResponse(about, headers=hall.doors.headers())

    async def frames(socket: Any) -> None:
        await socket.accept()
        name = socket.query_params.get("run", "")
        if name and not hall.is_run(name):
            await socket.close(4404)
            return
        with hall.watching(name) as watch, contextlib.suppress(WebSocketDisconnect, RuntimeError):
            watch.step()
            while True:
                text = await socket.receive_text()
                if len(text) > _LONGEST_ASK:
                    await socket.close(1009)
                    return
                ask = _table(text)
                await hall.wait_for_news(watch, ask.get("tick"))
                said = hall.desk.said_after(ask.get("said")) if hall.desk and not name else []
                await socket.send_bytes(watch.frame(ask, said))

    async def do(request: Any) -> Response:
        body = await request.body()
        answer, status = _carry_out(hall, request.headers.get("x-levilab-token"), body[: _LONGEST_ASK + 1])
        return JSONResponse(answer, status, headers=hall.doors.headers())

    async def parts(request: Any) -> Response:
        name = request.query_params.get("run", "")
        scene = hall.desk.scene if hall.desk else scene_of_run(hall.root / name) if hall.is_run(name) else None
        return JSONResponse(await asyncio.to_thread(parts_for, scene), headers=hall.doors.headers())

    @contextlib.asynccontextmanager
    async def lifespan(_: Any) -> Any:
        reading = asyncio.create_task(hall.read_on())
        try:
            yield
        finally:
            reading.cancel()

    routes = [
        Route("/", page),
        Route("/runs", runs),
        Route("/parts", parts),
        Route("/do", do, methods=["POST"]),
        Route("/page/{name}", part),
        Route("/run/{run}/analysis", analysis),
        Route("/run/{run}/{name}", of_run),
        WebSocketRoute("/frames", frames),
    ]
    return Guard(Starlette(routes=routes, lifespan=lifespan), hall.doors)


def _table(text: str) -> dict[str, Any]:
    """A page's question; anything else than a table asks for everything."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _carry_out(hall: Hall, token: str | None, body: bytes) -> tuple[dict[str, Any], int]:
    """Carry out what a page with the token asks for; the answer, and the status of the request."""
    if not hall.doors.knows(token):
        return {"error": "this page may only look: open the address that the terminal shows"}, 403
    if hall.desk is None:
        return {"error": "there is no bench for practice: levilab live --mock brings one"}, 404
    wanted = _table(body.decode("utf-8", "replace")) if len(body) <= _LONGEST_ASK else {}
    try:
        if wanted.get("do") == "analyze":
            name = str(wanted.get("run"))
            if not hall.is_run(name):
                return {"error": "there is no such run"}, 404
            hall.analyses.begin(hall.root / name)
            return {}, 200
        return {"number": hall.desk.carry_out(wanted)}, 200
    except LevilabError as error:
        return {"error": str(error)}, 400
