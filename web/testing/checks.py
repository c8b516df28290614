"""What must hold of the page. A check takes a desk and returns what it has measured; what does not hold is an
AssertionError."""

import math
import pathlib

from . import picture

SEEDS = pathlib.Path(__file__).resolve().parents[2] / "fuzz/seeds/gltf"
# A method, and how close its picture must come to the native one [dB]: somewhat below what was measured with SwiftShader
# here and lavapipe there (see the README). The rasterisers differ along edges.
METHODS = {"off": 30, "gtao": 30, "vbao": 30, "network": 30, "paper": 30}
# As many rays as the page traces.
RAYS = 512


def expect(condition, sentence):
    if not condition:
        raise AssertionError(sentence)


def without_webgpu(desk):
    """Says so in a sentence, and shows no dead controls."""
    expect("WebGPU" in desk.message(), f"the page says {desk.message()!r}")
    expect(not desk.page.run("document.getElementById('controls').checkVisibility()"), "controls without a picture")
    desk.screenshot("without_webgpu")
    return desk.message()


def like_native(desk, what, least, **of):
    """How far the picture is from the native renderer's [dB]."""
    here = desk.picture()
    expect(desk.message() == "", f"{what}: the page says {desk.message()!r}")
    expect(here.spread() > 10, f"{what}: a blank picture, of spread {here.spread():.1f}")
    apart = picture.psnr(here, desk.native(what, (here.width, here.height), **of))
    expect(apart >= least, f"{what}: {apart:.1f} dB from the native picture, expected {least}")
    return f"{what} {apart:.1f} dB"


def methods(desk):
    """Every method draws what the native renderer draws."""
    measured = []
    for method, least in METHODS.items():
        desk.set(left=method, right=method)
        measured.append(like_native(desk, method, least, method=method))
        desk.screenshot(method)
    return ", ".join(measured)


def reference(desk):
    """Rays converge to what as many of them are on the native device."""
    desk.set(left="reference", right="reference", show="ao")
    measured = like_native(desk, "reference", 30, method="reference", show="ao", spp=RAYS)
    desk.screenshot("reference")
    desk.set(left="off", right="off", show="shaded")
    return measured


def kinds(desk):
    """So does every kind of picture."""
    measured = []
    desk.set(left="network", right="network")
    for show, least in {"ao": 30, "normals": 30}.items():
        desk.set(show=show)
        measured.append(like_native(desk, show, least, method="network", show=show))
        desk.screenshot(show)
    desk.set(show="shaded")
    return ", ".join(measured)


def slider(desk):
    """Left of it is one method, right of it the other."""
    whole = [desk.set(left=method, right=method, split=0) for method in ("off", "network")]
    both = desk.set(left="off", right="network", split=0.25)
    # The slider itself is a column of its own. Python rounds halves to even numbers, the renderer does not.
    edge = math.floor(0.25 * both.width + 0.5)
    for i, (first, end) in enumerate([(0, edge), (edge + 1, both.width)]):
        same = both.columns(first, end).rgba == whole[i].columns(first, end).rgba
        expect(same, f"columns {first} to {end} are not of the method on that side")
    expect(whole[0].rgba != whole[1].rgba, "both methods draw the same")
    desk.screenshot("slider")
    return f"column {edge} of {both.width}"


def radius(desk):
    """The radius counts, and is what the native renderer makes of it."""
    before = desk.set(left="network", right="network", show="ao")
    after = desk.set(radius=-1)
    expect(before.rgba != after.rgba, "another radius draws the same")
    measured = like_native(desk, "radius", 30, method="network", show="ao")
    desk.set(show="shaded")
    return measured


def hands(desk):
    """Mouse, wheel, finger and keys move the viewer; keys go back where they came from."""
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
    return ", ".join(moves)


def files(desk):
    """A file that is broken is named and changes nothing; one that is sound is shown as the native renderer shows it."""
    before = desk.set(left="network", right="network")
    desk.let_fall("broken.glb", b"glTF, but not for long")
    expect("broken.glb" in desk.message(), f"the page says {desk.message()!r} of a broken file")
    expect(desk.picture().rgba == before.rgba, "a broken file changes the picture")
    desk.screenshot("broken_file")
    sound = SEEDS / "everything.glb"
    desk.let_fall(sound.name, sound.read_bytes())
    measured = like_native(desk, sound.name, 30, scene=str(sound), method="network")
    desk.screenshot("file")
    return measured


def sizes(desk):
    """A phone has all of its pixels and nothing to scroll sideways; a canvas without a size does no harm."""
    desk.set(left="off", right="off", scale=1)
    desk.page.resize((360, 740), scale=2, mobile=True)
    canvas = "document.getElementById('picture')"
    desk.page.wait(f"{canvas}.width === 2 * {canvas}.clientWidth && document.body.dataset.state === 'resting'")
    over = desk.page.run("document.scrollingElement.scrollWidth - innerWidth")
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
    return desk.page.run(f"{canvas}.width + ' px'")


def lost_device(desk):
    """A device that goes is an end with a sentence."""
    desk.page.run("device.destroy()")
    desk.page.wait("document.body.dataset.state === 'stopped'")
    expect("device is gone" in desk.message(), f"the page says {desk.message()!r}")
    desk.screenshot("lost_device")
    return desk.message()


WITH_WEBGPU = [methods, reference, kinds, slider, radius, hands, files, sizes, lost_device]
