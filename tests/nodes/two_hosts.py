"""Two hosts on one network, as two network namespaces of this machine."""

import shutil
import subprocess
import time
from contextlib import ExitStack

TOOLS = ("unshare", "nsenter", "ip", "mount")


class TwoHosts:
    """Hosts ``a`` and ``b`` without shared memory between them; a context manager.

    Raises
    ------
    OSError
        This machine does not allow network namespaces.
    """

    def __enter__(self) -> "TwoHosts":
        if missing := [tool for tool in TOOLS if shutil.which(tool) is None]:
            raise OSError(f"without {missing}")
        self._made = ExitStack()
        self._holders: dict[str, int] = {}
        try:
            # A user namespace lets anybody be root in it; the second host lives in the first's.
            self._hold("a", ["unshare", "--user", "--map-root-user", "--net", "--mount"])
            self._hold("b", [*self.on("a"), "unshare", "--net", "--mount"])
            wire = ["link", "add", "wire", "type", "veth", "peer", "name", "wire"]
            self._run("a", ["ip", *wire, "netns", str(self._holders["b"])])
            for host, address in (("a", "10.99.0.1/24"), ("b", "10.99.0.2/24")):
                self._run(host, ["mount", "-t", "tmpfs", "tmpfs", "/dev/shm"])
                self._run(host, ["ip", "address", "add", address, "dev", "wire"])
                for device in ("lo", "wire"):
                    self._run(host, ["ip", "link", "set", device, "up"])
            self._wait_for_wire()
        except (OSError, subprocess.SubprocessError) as error:
            self._made.close()
            raise OSError(f"no namespaces here: {error}") from error
        return self

    def __exit__(self, *_: object) -> None:
        self._made.close()

    def on(self, host: str) -> list[str]:
        """Return the words before a command that run it on a host."""
        target = str(self._holders[host])
        options = ["--user", "--net", "--mount", "--preserve-credentials", "--wd=."]
        return ["nsenter", "--target", target, *options]

    def _hold(self, host: str, unshared: list[str]) -> None:
        # `read` keeps it, and the namespaces with it, until its input is closed.
        holder = subprocess.Popen(
            [*unshared, "sh", "-c", "echo $$; read _"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._made.callback(holder.communicate)
        assert holder.stdout is not None
        said = holder.stdout.readline()
        if not said:
            raise OSError(holder.communicate()[1].strip())
        self._holders[host] = int(said)

    def _run(self, host: str, command: list[str]) -> str:
        done = subprocess.run(
            [*self.on(host), *command], check=True, capture_output=True, text=True
        )
        return done.stdout

    def _wait_for_wire(self) -> None:
        # The kernel tells of a link up to a second late, and who begins before that never listens
        # there: DDS looks for networks once.
        end = time.monotonic() + 30.0
        for host in self._holders:
            while "state UP" not in self._run(host, ["ip", "link", "show", "wire"]):
                if time.monotonic() > end:
                    raise OSError(f"the wire of {host} does not come up")
                time.sleep(0.02)
