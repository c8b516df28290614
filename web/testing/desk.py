"""A page in a browser, and the server that it comes from."""

import base64
import functools
import http.server
import json
import threading

from . import picture

# Runs before the page's own scripts. It sets controls, drops files, loses the device, copies pictures, and starts with few
# pixels, because software draws them.
HELPERS = """
addEventListener("DOMContentLoaded", () => {
    document.getElementById("scale").value = "0.5";
    const canvas = document.getElementById("picture");
    canvas.addEventListener("draw", () => {
        window.paper = new OffscreenCanvas(canvas.width, canvas.height);
        paper.getContext("2d").drawImage(canvas, 0, 0);
    });
});
window.set = (id, value) => {
    const control = document.getElementById(id);
    control.value = value;
    control.dispatchEvent(new Event(control.tagName === "SELECT" ? "change" : "input"));
};
window.let_fall = (name, bytes) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([Uint8Array.from(atob(bytes), (c) => c.charCodeAt(0))], name));
    document.body.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
};
if (globalThis.GPUAdapter) {
    const request = GPUAdapter.prototype.requestDevice;
    GPUAdapter.prototype.requestDevice = async function (...of) {
        return window.device = await request.apply(this, of);
    };
}
"""


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def serve(folder):
    """The address of a folder, for as long as this process runs."""
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


class Desk:
    def __init__(self, page, url, out):
        """The page is at `url`, pictures of the native renderer in `golden/` below it; screenshots go to `out`."""
        self.page, self.url, self.out = page, url, out
        self.page.open(url, HELPERS)
        self.rest()

    def rest(self):
        """Waits until nothing moves any more."""
        self.page.wait("['resting', 'stopped'].includes(document.body?.dataset.state)")

    def set(self, **controls):
        """The picture with these controls, drawn once."""
        self.page.run(";".join(f"set({json.dumps(control)}, {json.dumps(str(value))})" for control, value in controls.items()))
        self.rest()
        return self.picture()

    def picture(self):
        return picture.on_page(self.page)

    def message(self):
        return self.page.run("(of => of.hidden ? '' : of.textContent)(document.getElementById('message'))")

    def text(self, name):
        """The text of an element of the page."""
        return self.page.run(f"document.getElementById({json.dumps(name)}).textContent")

    def screenshot(self, name):
        self.page.screenshot(self.out / f"{name}.png")

    def golden(self, name):
        """A picture of the native renderer."""
        return picture.in_file(self.page, f"{self.url}golden/{name}.png")

    def act(self, method, *events):
        """Sends input to the browser, and waits for the page."""
        for event in events:
            self.page.call(f"Input.{method}", **event)
        self.page.run("new Promise(requestAnimationFrame)")
        self.rest()

    def middle(self):
        box = "(b => [b.x + b.width / 2, b.y + b.height / 2])(document.getElementById('picture').getBoundingClientRect())"
        return self.page.run(box)

    def drag(self):
        x, y = self.middle()
        at = lambda dx, kind: {"type": kind, "x": x + dx, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        self.act("dispatchMouseEvent", at(0, "mousePressed"), at(30, "mouseMoved"), at(30, "mouseReleased"))

    def swipe(self):
        x, y = self.middle()
        at = lambda dy, kind: {"type": kind, "touchPoints": [{"x": x, "y": y + dy}]}
        self.act("dispatchTouchEvent", at(0, "touchStart"), at(15, "touchMove"), at(30, "touchMove"), {"type": "touchEnd", "touchPoints": []})

    def roll(self):
        x, y = self.middle()
        self.act("dispatchMouseEvent", {"type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": 100})

    def press(self, key):
        self.page.run("document.getElementById('picture').focus()")
        self.act("dispatchKeyEvent", *({"type": kind, "key": key, "code": key} for kind in ("keyDown", "keyUp")))

    def let_fall(self, name, content):
        """Drops a file on the page."""
        drawn = self.page.run("Number(document.body.dataset.drawn)")
        self.page.run(f"let_fall({json.dumps(name)}, {json.dumps(base64.b64encode(content).decode())})")
        self.page.wait(f"Number(document.body.dataset.drawn) > {drawn}")
        self.rest()
