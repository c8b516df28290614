"""A headless Chromium, controlled over a pipe: https://chromedevtools.github.io/devtools-protocol/."""

import base64
import json
import os
import select
import shutil
import subprocess
import tempfile
import time

NAMES = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"]
# SwiftShader is a software device, which Chromium offers to pages only when asked to. A canvas takes its pictures only where
# the browser itself draws with it, through Vulkan.
WEBGPU = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan"]
WEBGPU += ["--use-vulkan=swiftshader", "--use-gl=angle", "--use-angle=swiftshader"]


class Absent(Exception):
    """Something that the test needs is missing."""


def executable():
    """The browser's path: the environment variable CHROMIUM, or the first installed one."""
    found = [path for path in map(shutil.which, [os.environ.get("CHROMIUM", "")] + NAMES) if path]
    if not found:
        raise Absent(f"no browser: install one of {', '.join(NAMES)}, or set CHROMIUM")
    return found[0]


class Browser:
    """One page in a browser of its own."""

    def __init__(self, flags=(), size=(800, 900)):
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        (to_browser, self.write_end), (self.read_end, from_browser) = os.pipe(), os.pipe()

        def places_of_the_pipe():
            # Duplicates first, because either may have the other's number.
            ends = [os.dup(end) for end in (to_browser, from_browser)]
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        command = [executable(), "--headless=new", "--remote-debugging-pipe", "--hide-scrollbars", "--force-color-profile=srgb"]
        command += [f"--user-data-dir={self.folder.name}", "--no-first-run", "--disable-background-networking", *flags]
        if os.geteuid() == 0:
            # As root, in a container, the browser's own sandbox does not start.
            command += ["--no-sandbox"]
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen([*command, "about:blank"], close_fds=False, preexec_fn=places_of_the_pipe, **quiet)
        os.close(to_browser)
        os.close(from_browser)
        self.received, self.next_id, self.session, self.console = b"", 0, None, []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log"]:
            self.call(f"{domain}.enable")
        self.resize(size)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.write_end)
        os.close(self.read_end)
        self.folder.cleanup()

    def call(self, method, timeout_s=120, **params):
        """The result of a method of the protocol."""
        self.next_id += 1
        message = {"id": self.next_id, "method": method, "params": params}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.write_end, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + timeout_s
        while True:
            answer = self.receive(until, method)
            if answer.get("id") == self.next_id:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]
            self.hear(answer)

    def receive(self, until, method):
        while b"\0" not in self.received:
            ready, _, _ = select.select([self.read_end], [], [], max(0, until - time.monotonic()))
            chunk = os.read(self.read_end, 1 << 16) if ready else b""
            if not chunk:
                raise RuntimeError(f"{method}: the browser {'is gone' if ready else 'does not answer'}")
            self.received += chunk
        message, self.received = self.received.split(b"\0", 1)
        return json.loads(message)

    def hear(self, event):
        """Keeps the page's error messages."""
        if len(self.console) == 5:
            return
        params = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = params["exceptionDetails"]
            self.console.append(details.get("exception", {}).get("description", details["text"]))
        elif event.get("method") == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
            self.console.append(" ".join(str(a.get("value", a.get("description", ""))) for a in params["args"]))

    def open(self, url, before=None):
        """Goes to a page; the script `before` runs before those of the page."""
        if before:
            self.call("Page.addScriptToEvaluateOnNewDocument", source=before)
        self.call("Page.navigate", url=url)

    def resize(self, size, scale=1, mobile=False):
        """The page's size [CSS px], and device pixels in each of them."""
        width, height = size
        of = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": mobile}
        self.call("Emulation.setDeviceMetricsOverride", **of)

    def run(self, script):
        """The value of an expression, which may be a promise."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            details = found["exceptionDetails"]
            raise RuntimeError(details.get("exception", {}).get("description", details["text"]))
        return found["result"].get("value")

    def wait(self, script, timeout_s=180):
        """Waits until an expression is true."""
        until = time.monotonic() + timeout_s
        while not self.run(script):
            if time.monotonic() > until:
                raise RuntimeError(f"waited {timeout_s} s for {script}; the page says {self.console}")
            time.sleep(0.1)

    def screenshot(self, path):
        """A screenshot of the whole page, as PNG."""
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))
