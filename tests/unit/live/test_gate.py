"""Who may watch: Foxglove and this machine, nobody whom another page sends, and not too many."""

import select
import shutil
import socket
import subprocess
import threading
import time
from contextlib import ExitStack, suppress
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from queue import Queue

import pytest
from test_live_view import LOGGED, fill, free_port, head, viewing
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from wamctl.live.gate import MOST_CLIENTS, admits
from wamctl.live.watch import live_view
from wamctl.telemetry.logger import recorded


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    path, chosen = tmp_path_factory.mktemp("live") / "log.mcap", free_port()
    view = partial(live_view, port=chosen)
    with recorded(head(path), waits=True, shown=False, live_views=[view]) as log:
        fill(log, 100)
        yield chosen


def open_connection(port):
    """A client that subscribes to nothing."""
    address = f"ws://127.0.0.1:{port}"
    return connect(address, subprotocols=["foxglove.sdk.v1"], ping_interval=None)


def request(*lines):
    return "\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode()


@pytest.mark.parametrize(
    "lines",
    [
        ["Host: 127.0.0.1:8765"],
        ["Host: localhost:9999"],
        ["Host: [::1]:8765", "Origin: http://localhost:5173"],
        ["Host: 127.0.0.1:8765", "Origin: https://app.foxglove.dev"],
        ["host: 127.0.0.1", "ORIGIN: file://"],
    ],
)
def test_who_comes_through(lines):
    assert admits(request(*lines))


@pytest.mark.parametrize(
    "lines",
    [
        [],
        ["Host: evil.example:8765"],
        ["Host: 127.0.0.1.evil.example"],
        ["Host: 127.0.0.1@evil.example"],
        ["Host: [::1"],
        ["Host: 127.0.0.1", "Host: evil.example"],
        ["Host: 127.0.0.1", "Origin: https://evil.example"],
        ["Host: 127.0.0.1", "Origin: null"],
        ["Host: 127.0.0.1", "Origin: https://app.foxglove.dev.evil.example"],
        ["Host: 127.0.0.1", "Origin: https://app.foxglove.dev", "Origin: https://evil.example"],
        ["Host: 127.0.0.1", "Origin: http://localhost@evil.example"],
        ["Host: 127.0.0.1", "Origin: "],
    ],
)
def test_who_does_not(lines):
    assert not admits(request(*lines))


def test_a_page_of_elsewhere_is_refused(port):
    with pytest.raises(InvalidStatus) as refused:
        connect(f"ws://127.0.0.1:{port}", origin="https://evil.example")
    assert refused.value.response.status_code == 403
    with viewing(port) as viewer:
        assert len(viewer.channels) == len(LOGGED) + 1


def test_only_so_many_at_once_and_others_when_they_have_gone(port):
    with ExitStack() as viewers:
        for _ in range(MOST_CLIENTS):
            viewers.enter_context(open_connection(port))
        with pytest.raises(InvalidStatus) as refused:
            open_connection(port)
        assert refused.value.response.status_code == 503
    until = time.monotonic() + 30
    while time.monotonic() < until:
        try:
            with open_connection(port):
                return
        except InvalidStatus:
            time.sleep(0.05)
    pytest.fail("nobody came in after all others had gone")


def test_one_too_many_is_told_so_however_late_it_asks(port):
    with ExitStack() as viewers:
        for _ in range(MOST_CLIENTS):
            viewers.enter_context(open_connection(port))
        with socket.create_connection(("127.0.0.1", port), timeout=10) as end:
            assert select.select([end], [], [], 0.2)[0] == [], "answered before it asked"
            end.sendall(request(f"Host: 127.0.0.1:{port}"))
            assert end.recv(1 << 16).startswith(b"HTTP/1.1 503")


@pytest.mark.parametrize(
    "sent",
    [b"\x1b]0;owned\x07\r\n\r\n", b"A" * 100_000, b"GET / HTTP/1.1\r\nHost: \xff\r\n\r\n", b""],
)
def test_nothing_that_a_client_sends_reaches_the_terminal(port, sent, capfd):
    with socket.create_connection(("127.0.0.1", port)) as end:
        end.sendall(sent)
        end.shutdown(socket.SHUT_WR)
        end.settimeout(10)
        try:
            assert not end.recv(1 << 16).startswith(b"HTTP/1.1 101")
        except ConnectionResetError:
            pass
    with viewing(port):
        pass
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


PAGE = """<script>
const tries = %s.map(url => new Promise(done => {
  const end = new WebSocket(url, ["foxglove.sdk.v1"]);
  end.onopen = () => done("open");
  end.onerror = () => done("refused");
}));
Promise.all(tries).then(all => fetch("/" + all.join("-")));
</script>"""


class Page(BaseHTTPRequestHandler):
    """A page that tries to watch, and tells how it went by what it asks for next."""

    def do_GET(self):
        with suppress(OSError):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write((PAGE % self.server.urls).encode())
        if "refused" in self.path or "open" in self.path:
            self.server.results.put(self.path)

    def log_message(self, *arguments):
        pass


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs chromium")
@pytest.mark.parametrize(
    ("host", "expected"), [("evil.example", "/refused-refused"), ("localhost", "/open-refused")]
)
def test_in_a_browser(port, host, expected, tmp_path):
    """A page of elsewhere, one of here, and a name of elsewhere that was bound to here."""
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-extensions"]
    command += [f"--user-data-dir={tmp_path}", "--host-resolver-rules=MAP evil.example 127.0.0.1"]
    with ThreadingHTTPServer(("127.0.0.1", 0), Page) as pages:
        pages.urls = [f"ws://127.0.0.1:{port}", f"ws://evil.example:{port}"]
        pages.results = Queue()
        threading.Thread(target=pages.serve_forever, daemon=True).start()
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        address = f"http://{host}:{pages.server_address[1]}/"
        with subprocess.Popen([*command, address], **quiet) as browser:
            try:
                assert pages.results.get(timeout=120) == expected
            finally:
                browser.terminate()
                pages.shutdown()
