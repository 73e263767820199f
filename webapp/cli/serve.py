"""``padlab serve``: gunicorn in front, a companion process that renders behind."""

import os
import signal
import socket
import subprocess
import sys
from typing import Any

import click
from gunicorn.app.base import BaseApplication

from webapp import create_app
from webapp.config import Settings
from webapp.errors import ConfigError
from webapp.parts import Parts

THREADS = 4
KEEPALIVE_SECONDS = 5
STOP_SECONDS = 10
EVERYWHERE = ("0.0.0.0", "::")  # noqa: S104  (compared with, not listened on)


class Server(BaseApplication):  # type: ignore[misc]
    """Gunicorn with padlab's options instead of a configuration file."""

    def __init__(self, settings: Settings, options: dict[str, Any]) -> None:
        self._settings = settings
        self._options = options
        super().__init__()

    def load_config(self) -> None:
        """Hand the options to gunicorn."""
        for name, value in self._options.items():
            self.cfg.set(name, value)

    def load(self) -> Any:
        """Build the application, in each worker."""
        return create_app(self._settings)


def require_free_port(host: str, port: int) -> None:
    """Check that the server can listen.

    Raises
    ------
    ConfigError
        If the port is in use or the address is not this machine's.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        raise ConfigError(
            f"padlab cannot listen on {host}, port {port} ({error.strerror or error}); "
            f"choose another with --port (for instance --port {port + 1}) or --host"
        ) from error


def run(settings: Settings, *, host: str, port: int, workers: int) -> None:
    """Serve until stopped; clips that are pending are rendered meanwhile."""
    # A process of its own that shares nothing with the web workers, and a group of its own, so that its workers can be
    # stopped with it; it reads the same settings.
    master = os.getpid()
    command = [sys.executable, "-m", "webapp.cli.companion", str(master)]
    renderer = subprocess.Popen(command, start_new_session=True)  # noqa: S603  (the command is our own)
    try:
        Server(
            settings,
            {
                "bind": address(host, port),
                "workers": workers,
                # Sync workers would wait for slow browsers to close their connections.
                "worker_class": "gthread",
                "threads": THREADS,
                "keepalive": KEEPALIVE_SECONDS,
                "graceful_timeout": STOP_SECONDS,
                "loglevel": "warning",
                "proc_name": "padlab",
                "control_socket_disable": True,
            },
        ).run()
    finally:
        # Gunicorn's workers are forks of this process and pass here too when they end.
        if os.getpid() == master:
            _stop(renderer)


def _stop(renderer: "subprocess.Popen[bytes]") -> None:
    """Ask the renderer to end; what it has not finished is rendered at the next start."""
    renderer.terminate()
    try:
        renderer.wait(STOP_SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(renderer.pid, signal.SIGKILL)
        renderer.wait()


def address(host: str, port: int) -> str:
    """Return host and port as addresses write them."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def url(host: str, port: int) -> str:
    """Return an address that a browser on this machine can open."""
    return f"http://{address('localhost' if host in EVERYWHERE else host, port)}"


def check(settings: Settings) -> None:
    """Build the application once, so that what is wrong is said before anything is served.

    Raises
    ------
    WebappError
        As `webapp.create_app`.
    """
    made: Parts = create_app(settings).extensions["padlab"]
    # A connection must not be carried through gunicorn's fork: both sides would use it.
    made.database.dispose()


@click.command()
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", type=click.IntRange(1, 65535), default=8000, show_default=True)
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Web processes.")
def serve(host: str, port: int, workers: int) -> None:
    """Serve the pages, and render clips that are pending in the background."""
    require_free_port(host, port)
    settings = Settings.from_env()
    check(settings)
    click.echo(f"padlab listens on {url(host, port)}/ (stop with Ctrl-C)")
    run(settings, host=host, port=port, workers=workers)
