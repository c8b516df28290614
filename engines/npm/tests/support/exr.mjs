// G-buffers as OpenEXR files without compression, and 16-bit grey PNGs: what `aonet infer` reads and writes.
import { inflateSync } from 'node:zlib';

const text = (value) => Buffer.from(`${value}\0`);
const ints = (...values) => Buffer.from(Int32Array.from(values).buffer);
const attribute = (name, type, value) => Buffer.concat([text(name), text(type), ints(value.length), value]);

/**
 * A file of float channels. `display` is the picture inside: [left, top, right, bottom], all inclusive.
 * @param {Record<string, Float32Array>} channels
 */
export function exr(channels, width, height, display = [0, 0, width - 1, height - 1]) {
  const names = Object.keys(channels).sort();
  const list = names.map((name) => Buffer.concat([text(name), ints(2, 0, 1, 1)]));
  const header = Buffer.concat([
    ints(20000630, 2),
    attribute('channels', 'chlist', Buffer.concat([...list, Buffer.from([0])])),
    attribute('compression', 'compression', Buffer.from([0])),
    attribute('dataWindow', 'box2i', ints(0, 0, width - 1, height - 1)),
    attribute('displayWindow', 'box2i', ints(...display)),
    attribute('lineOrder', 'lineOrder', Buffer.from([0])),
    attribute('pixelAspectRatio', 'float', Buffer.from(Float32Array.of(1).buffer)),
    attribute('screenWindowCenter', 'v2f', Buffer.from(Float32Array.of(0, 0).buffer)),
    attribute('screenWindowWidth', 'float', Buffer.from(Float32Array.of(1).buffer)),
    Buffer.from([0]),
  ]);
  const lineBytes = 4 * width * names.length;
  const first = header.length + 8 * height;
  const offsets = BigUint64Array.from({ length: height }, (_, y) => BigInt(first + y * (8 + lineBytes)));
  const lines = Array.from({ length: height }, (_, y) => {
    const rows = names.map((name) => Buffer.from(channels[name].slice(y * width, (y + 1) * width).buffer));
    return Buffer.concat([ints(y, lineBytes), ...rows]);
  });
  return Buffer.concat([header, Buffer.from(offsets.buffer), ...lines]);
}

/** Width, height and values in [0, 1] of a PNG of 16-bit grey. */
export function png(bytes) {
  let [at, width, height] = [8, 0, 0];
  const parts = [];
  while (at < bytes.length) {
    const [length, kind] = [bytes.readUInt32BE(at), bytes.toString('latin1', at + 4, at + 8)];
    const data = bytes.subarray(at + 8, at + 8 + length);
    if (kind === 'IHDR') {
      [width, height] = [data.readUInt32BE(0), data.readUInt32BE(4)];
      if (data[8] !== 16 || data[9] !== 0) throw new Error(`PNG: expected 16-bit grey, found depth ${data[8]}, colour ${data[9]}`);
    }
    if (kind === 'IDAT') parts.push(data);
    at += 12 + length;
  }
  const raw = inflateSync(Buffer.concat(parts));
  const stride = 2 * width;
  const lines = Buffer.alloc(stride * height);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (stride + 1)];
    for (let i = 0; i < stride; i++) {
      const left = i >= 2 ? lines[y * stride + i - 2] : 0;
      const up = y > 0 ? lines[(y - 1) * stride + i] : 0;
      const corner = i >= 2 && y > 0 ? lines[(y - 1) * stride + i - 2] : 0;
      const [a, b, c] = [left, up, corner].map((near) => Math.abs(left + up - corner - near));
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      const guess = [0, left, up, (left + up) >> 1, paeth][filter];
      lines[y * stride + i] = raw[y * (stride + 1) + 1 + i] + guess;
    }
  }
  const values = Float32Array.from({ length: width * height }, (_, i) => lines.readUInt16BE(2 * i) / 65535);
  return { width, height, values };
}
