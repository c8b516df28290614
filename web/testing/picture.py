"""Pictures of the page and of files, and their differences."""

import base64
import dataclasses
import math

# Both functions give the same 8 bits: Chromium decodes and draws without colour management.
TEXELS = """
async (source, width, height) => {
    const paper = new OffscreenCanvas(width, height).getContext("2d");
    paper.drawImage(source, 0, 0);
    const { data } = paper.getImageData(0, 0, width, height);
    let text = "";
    for (let i = 0; i < data.length; i += 32768) {
        text += String.fromCharCode(...data.subarray(i, i + 32768));
    }
    return { width, height, rgba: btoa(text) };
}"""


@dataclasses.dataclass
class Picture:
    width: int
    height: int
    rgba: bytes

    def columns(self, first, end):
        """Those columns, as a picture."""
        rows = range(0, len(self.rgba), 4 * self.width)
        return Picture(end - first, self.height, b"".join(self.rgba[r + 4 * first : r + 4 * end] for r in rows))

    def spread(self):
        """The standard deviation of its values: 0 where it is blank."""
        values = [v for c in range(3) for v in self.rgba[c::4]]
        mean = sum(values) / len(values)
        return math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))


def on_page(page):
    """The picture on the canvas."""
    return of(page.run(f"({TEXELS})(paper, paper.width, paper.height)"))


def in_file(page, url):
    """The picture in an image file, decoded by the page's browser."""
    load = f"fetch('{url}').then((r) => r.blob()).then((b) => createImageBitmap(b, {{ colorSpaceConversion: 'none' }}))"
    return of(page.run(f"{load}.then((image) => ({TEXELS})(image, image.width, image.height))"))


def of(found):
    return Picture(found["width"], found["height"], base64.b64decode(found["rgba"]))


def psnr(a, b):
    """PSNR of 8-bit colours [dB]; infinite if they are equal."""
    if (a.width, a.height) != (b.width, b.height):
        raise AssertionError(f"sizes: {a.width}x{a.height} and {b.width}x{b.height}")
    square = sum((x - y) ** 2 for c in range(3) for x, y in zip(a.rgba[c::4], b.rgba[c::4]))
    return math.inf if square == 0 else 10 * math.log10(255**2 * 3 * a.width * a.height / square)
