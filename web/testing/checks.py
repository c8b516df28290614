"""Checks of the page. A check takes a desk and returns what it has measured; what does not hold is an
AssertionError."""

import math
import pathlib

from . import picture

SEEDS = pathlib.Path(__file__).resolve().parents[2] / "fuzz/seeds/gltf"
# Pictures of the native renderer, as crates/aonet_view/tests/golden.rs makes them: the controls that show the same here,
# and how close it must come [dB]. Measured with SwiftShader here and lavapipe there: 35.7, 36.9, 32.8, 35.0 and 31.1; the
# two rasterise edges differently.
GOLDEN = {
    "shaded": ({"left": "balanced", "right": "balanced", "split": 1, "show": "shaded"}, 30),
    "split": ({"left": "off", "right": "balanced", "split": 0.5, "show": "shaded"}, 30),
    "visibility": ({"left": "balanced", "right": "paper", "split": 0.5, "show": "ao"}, 30),
    "classic": ({"left": "gtao", "right": "vbao", "split": 0.5, "show": "ao"}, 30),
    "normals": ({"left": "balanced", "right": "balanced", "split": 1, "show": "normals"}, 30),
    "second": ({"show": "second"}, 30),
    "shares": ({"show": "shares", "second_layer": "behind"}, 25),
}


def expect(condition, sentence):
    if not condition:
        raise AssertionError(sentence)


def without_webgpu(desk):
    """The page explains it, and shows no controls that do nothing."""
    expect("WebGPU" in desk.message(), f"the page says {desk.message()!r}")
    expect(not desk.page.run("document.getElementById('controls').checkVisibility()"), "controls without a picture")
    desk.screenshot("without_webgpu")
    return desk.message()


def pictures(desk):
    """Pictures agree with the native renderer's: every kind, networks and classic methods, on both sides of the slider."""
    measured = []
    for name, (controls, least) in GOLDEN.items():
        here = desk.set(**controls)
        expect(desk.message() == "", f"{name}: the page says {desk.message()!r}")
        apart = picture.psnr(here, desk.golden(name))
        desk.screenshot(name)
        expect(apart >= least, f"{name}: {apart:.1f} dB from the native picture, expected {least}")
        measured.append(f"{name} {apart:.1f} dB")
    return ", ".join(measured)


def surround(desk):
    """A guard band and a second layer show more occluders to the method that reads both."""
    def mean(**controls):
        return sum(desk.set(**controls).rgba[0::4])

    bare = mean(left="arcs", right="arcs", split=1, show="ao", second_layer="none")
    means = [mean(guard_band=0.15) / bare, mean(second_layer="behind") / bare]
    desk.screenshot("surround")
    expect(desk.message() == "", f"the page says {desk.message()!r}")
    expect(means[0] != 1 and means[1] < means[0], f"visibility {means} of that without them")
    desk.set(left="off", right="off", show="shaded", guard_band=0, second_layer="none")
    return f"visibility {100 * (means[0] - 1):.1f} % with a guard band, {100 * (means[1] - 1):.1f} % with both"


def reference(desk):
    """Rays converge, and the result is close to the network's."""
    network = desk.set(scale=0.25, left="balanced", right="balanced", split=1, show="ao")
    traced = desk.set(left="reference", right="reference")
    desk.screenshot("reference")
    expect(desk.message() == "", f"the page says {desk.message()!r}")
    expect("512 rays" in desk.text("times"), "not all rays were traced")
    pairs = list(zip(traced.rgba[0::4], network.rgba[0::4]))
    black = 100 * sum(a == 0 for a, _ in pairs) / len(pairs)
    apart = 10 * math.log10(255**2 * len(pairs) / max(1, sum((a - b) ** 2 for a, b in pairs)))
    # Measured: 0.2 % and 19.3 dB. At this size many pixels are edges.
    expect(black < 1, f"no ray leaves {black:.1f} % of the pixels: they start inside")
    expect(18.5 < apart < 30, f"the network is {apart:.1f} dB from the rays")
    desk.set(left="off", right="off", show="shaded", scale=0.5)
    return f"the network is {apart:.1f} dB from them, {black:.1f} % of the pixels see none"


def slider(desk):
    """One method is left of the slider, the other one right of it."""
    whole = [desk.set(left=method, right=method, split=0) for method in ("off", "balanced")]
    both = desk.set(left="off", right="balanced", split=0.2)
    # The slider itself is a column of its own. Python rounds halves to even numbers, the renderer does not.
    edge = math.floor(0.2 * both.width + 0.5)
    for i, (first, end) in enumerate([(0, edge), (edge + 1, both.width)]):
        same = both.columns(first, end).rgba == whole[i].columns(first, end).rgba
        expect(same, f"columns {first} to {end} are not of the method on that side")
    expect(whole[0].rgba != whole[1].rgba, "both methods draw the same")
    names = [desk.text(f"{side}_name") for side in ("left", "right")]
    expect(names == ["no AO", "network"], f"the picture says that it shows {names}")
    desk.screenshot("slider")
    return f"column {edge} of {both.width}"


def radius(desk):
    """A longer radius is displayed as longer, and finds more occluders."""
    means, said = [], []
    desk.set(left="gtao", right="gtao", split=1, show="ao")
    for exponent in (-1.8, -1.2):
        means.append(sum(desk.set(radius=exponent).rgba[0::4]) / 255)
        said.append(float(desk.text("radius_text").split()[0]))
    desk.set(show="shaded")
    expect(abs(said[1] - said[0] * 10**0.6) < 0.05 * said[1], f"the page says that radii are {said}")
    expect(means[1] < 0.98 * means[0], f"visibilities of {means[0]:.0f} and {means[1]:.0f} pixels")
    return f"visibility {100 * (means[1] / means[0] - 1):.0f} %"


def input_moves(desk):
    """Mouse, wheel, touch and keys move the viewer; opposite keys return it. The border can be dragged."""
    start = desk.set(left="off", right="off")
    moves = {"mouse": desk.drag, "finger": desk.swipe, "wheel": desk.roll, "key": lambda: desk.press("ArrowLeft")}
    last = start
    for name, move in moves.items():
        move()
        now = desk.picture()
        expect(now.rgba != last.rgba, f"the {name} moves nothing")
        last = now
    desk.press("ArrowUp")
    desk.press("ArrowDown")
    back = picture.psnr(desk.picture(), last)
    expect(back > 40, f"up and down again is {back:.1f} dB from where it was")
    desk.set(split=0.5)
    view = desk.text("view")
    desk.drag()
    split, expected = desk.page.run("[+split.value, 0.5 + 30 / picture.clientWidth]")
    expect(abs(split - expected) < 0.01, f"the border is at {split} instead of {expected:.3f}")
    expect(desk.text("view") == view, "the border moves the viewer")
    desk.set(split=1)
    return ", ".join([*moves, "border"])


def files(desk):
    """A broken file is named and changes nothing; a valid file is shown."""
    before = desk.set(left="gtao", right="gtao")
    desk.let_fall("broken.glb", b"glTF, but not for long")
    expect("broken.glb" in desk.message(), f"the page says {desk.message()!r} of a broken file")
    expect(desk.picture().rgba == before.rgba, "a broken file changes the picture")
    desk.screenshot("broken_file")
    sound = SEEDS / "triangle.glb"
    desk.let_fall(sound.name, sound.read_bytes())
    expect(desk.message() == "", f"the page says {desk.message()!r} of {sound.name}")
    now = desk.set(split=1, show="normals")
    seen = [now.rgba[i : i + 3] for i in range(0, len(now.rgba), 4) if now.rgba[i : i + 3] != bytes(3)]
    # It lies flat, and the camera of files looks down by 0.35 rad (PITCH of src/stage.rs).
    expected = [255 * (0.5 + 0.5 * n) for n in (0, math.cos(0.35), math.sin(0.35))]
    near = all(abs(a - b) < 2 for texel in set(seen) for a, b in zip(texel, expected))
    expect(seen and near, f"normals {set(seen)}, expected {expected}")
    # Its image is broken.
    torn = SEEDS / "everything.glb"
    desk.let_fall(torn.name, torn.read_bytes())
    expect('not shown: image "wood"' in desk.message(), f"the page says {desk.message()!r} of {torn.name}")
    desk.set(show="shaded")
    return f"{sound.name} covers {len(seen)} pixels"


def sizes(desk):
    """On a phone the canvas has all pixels and nothing scrolls sideways; a canvas without a size is harmless."""
    desk.set(left="off", right="off", show="shaded", scale=1)
    phone = (360, 740)
    desk.page.resize(phone, scale=2, mobile=True)
    canvas = "document.getElementById('picture')"
    desk.page.wait(f"{canvas}.width === 2 * {canvas}.clientWidth && document.body.dataset.state === 'resting'")
    over = desk.page.run("document.scrollingElement.scrollWidth") - phone[0]
    expect(over <= 0, f"the page is {over} px wider than a phone")
    desk.screenshot("phone")
    for display in ["none", "block"]:
        desk.page.run(f"{canvas}.style.display = '{display}'")
        desk.page.wait(f"({canvas}.width === 1) === {str(display == 'none').lower()}")
        desk.rest()
    expect(desk.message() == "", f"the page says {desk.message()!r}")
    expect(desk.picture().spread() > 10, "blank after it had no size")
    desk.page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    desk.screenshot("dark")
    measured = desk.page.run(f"{canvas}.width + ' px'")
    desk.set(scale=0.5)
    return measured


def lost_device(desk):
    """A lost device ends the page with a message."""
    desk.page.run("device.destroy()")
    desk.page.wait("document.body.dataset.state === 'stopped'")
    expect("device is gone" in desk.message(), f"the page says {desk.message()!r}")
    desk.screenshot("lost_device")
    return desk.message()


WITH_WEBGPU = [pictures, surround, reference, slider, radius, sizes, input_moves, files, lost_device]
