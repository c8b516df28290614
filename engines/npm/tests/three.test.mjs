// Frames of three.js in a headless Chromium, through the node, against the CPU program on the same depth and normals.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { visit } from './support/chromium.mjs';
import { cpu, difference } from './support/cpu.mjs';

// Measured: 1.1e-4 on average, of which rounding to half floats is about as much; one or two pixels differ more, where a search is at a threshold.
const [MEAN, MOST, OTHERS] = [4e-4, 2e-3, 8];
const NAMES = { fast: 'fast', balanced: 'balanced', 'reversed depth': 'fast', 'orthographic, multisampled': 'fast', 'after a resize': 'fast' };

const frames = new Map();
const keep = (frame) => frames.set(frame.name, frame);
let report;
before(async () => {
  report = await visit('tests/page.html', { answer: (kind, body) => { if (kind === 'frame') keep(JSON.parse(body)); return ''; } });
  assert.equal(report.error, undefined);
}, { timeout: 3_600_000 });

for (const [name, model] of Object.entries(NAMES)) {
  test(`${name}: the CPU's image`, async (t) => {
    const { width, height, depth, normals, ao, radius, fovY, orthoHeight, formats, complaints, precision } = frames.get(name);
    assert.deepEqual(complaints, []);
    const distances = Float32Array.from(depth, (d) => (d < 0 ? Infinity : d));
    const unit = Float32Array.from(normals);
    for (let i = 0; i < unit.length; i += 3) {
      const length = Math.hypot(unit[i], unit[i + 1], unit[i + 2]) || 1;
      const background = distances[i / 3] === Infinity;
      for (let c = 0; c < 3; c++) unit[i + c] = background ? 0 : unit[i + c] / length;
    }
    const { values } = await cpu({ width, height, depth: distances, normals: unit }, { model, radius, fovY, orthoHeight });
    assert.ok(Math.min(...values) < 0.5, 'something to see');
    const error = difference(Float32Array.from(ao), values);
    const others = values.filter((value, i) => Math.abs(value - ao[i]) > MOST).length;
    t.diagnostic(`${formats.join(', ')}, ${precision}: mean ${error.mean.toExponential(1)}, max ${error.max.toExponential(1)}, ${others} above ${MOST}`);
    assert.ok(error.mean <= MEAN && others <= OTHERS, `mean ${error.mean}, ${others} pixels above ${MOST}`);
    // A test that a wrong image fails: the same one, mirrored.
    const mirrored = Float32Array.from(ao, (_, i) => ao[i - (i % width) + width - 1 - (i % width)]);
    assert.ok(difference(mirrored, values).mean > 10 * MEAN);
  });
}

test('views, intensity, radius and half resolution', (t) => {
  const { start, lit, litStrong, none, ao, strong, off, full, half, small, complaints } = report.views;
  t.diagnostic(JSON.stringify(report.views));
  assert.deepEqual(complaints, []);
  assert.equal(start, none, 'everything is open until the network is compiled');
  assert.ok(lit < none - 2 && litStrong < lit - 2, 'ambient occlusion darkens');
  assert.ok(ao > lit, 'the picture of visibility is mostly white');
  assert.ok(strong < ao - 2 && off > 254, 'intensity is a power');
  assert.ok(Math.abs(half - full) < 0.02 && half !== full, 'half resolution is near the full one');
  assert.ok(small > half + 0.02, 'a smaller radius is brighter');
});

test('without WebGPU everything is open', () => assert.ok(report.meanOnWebGl > 254, String(report.meanOnWebGl)));

for (const [name, expected] of Object.entries({
  WebGL: /WebGPURenderer on WebGPU, found WebGLBackend/,
  'logarithmic depth': /depth buffer: expected a standard or reversed one, found a logarithmic one/,
  'compatibility mode': /core-features-and-limits, found a device in compatibility mode/,
  'multisampled prepass': /samples: expected one sample a pixel, found 4/,
  'no such model': /nothing\/program.json: expected a file of a program, found 404/,
  'wrong encoding': /normals: format: expected one of rgb10a2unorm.*found rgba16float/,
  radius: /radius: expected a finite length above 0, in world units, found NaN/,
  'too large': /maxStorageBufferBindingSize: expected at least \d+ bytes.*half resolution, found 134217728/,
  'lost device': /device: expected one that works, found a lost one/,
  'no texture node': /depth node: expected a texture node/,
  'no camera': /camera: expected a camera, found Scene/,
  view: /view: expected one of lit, ao, none, found split/,
})) {
  test(`mistake: ${name}`, () => assert.match(report.mistakes[name], expected));
}
