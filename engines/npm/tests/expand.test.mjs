// Numbers of every size: this package's against those that the program `aonet` writes.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Program, evaluate } from '../src/program.js';
import { exported } from './support/cpu.mjs';

const KNOWN = [[1, 1], [2, 1], [1, 3], [128, 72], [640, 360], [1280, 720], [1920, 1080], [3840, 2160]];
const SIZES = Array.from({ length: 50 }, (_, i) => KNOWN[i] ?? [1 + ((i * i * 7919) % 2111), 1 + ((i * i * 104729) % 1181)]);

/** What a program of one size, as a file holds it, has in common with an expanded one. */
function ofFile({ buffers, shaders, passes, image }, blob) {
  const numbers = ({ offset, bytes }) => Array.from(new Uint32Array(blob, offset, bytes / 4));
  return {
    buffers: buffers.map(({ label, bytes, usage, cleared = false, contents }) => ({
      label, bytes, usage, cleared,
      numbers: usage === 'uniform' ? numbers(contents) : null,
      weights: Boolean(contents) && usage !== 'uniform',
    })),
    passes: passes.map((pass) => ({ ...pass, shader: shaders[pass.shader] })),
    image: { ...image, shader: shaders[image.shader] },
  };
}

function ofPackage({ buffers, passes, image }, shaders) {
  return {
    buffers: buffers.map((buffer) => ({ ...buffer, weights: Boolean(buffer.weights) })),
    passes: passes.map((pass) => ({ ...pass, shader: shaders[pass.shader] })),
    image: { ...image, shader: shaders[image.shader] },
  };
}

for (const [name, ...flags] of [['fast'], ['balanced', '--precision', 'f32'], ['gtao:tuned'], ['high', '--layers', '2']]) {
  test(`${[name, ...flags].join(' ')}: numbers of ${SIZES.length} sizes are those of the crate`, async () => {
    const { document, blob } = await exported(name, ...flags);
    const program = await Program.from(document, blob);
    const shaders = program.shaders({ ...program.textures, precision: document.precision });
    assert.deepEqual(shaders, document.shaders);
    let variants = new Set();
    for (const [width, height] of SIZES) {
      const one = await exported(name, ...flags, '--size', `${width}x${height}`);
      assert.equal(one.document.format, 1);
      const found = ofPackage(program.at(width, height), shaders);
      assert.deepEqual(found, ofFile(one.document, one.blob), `${width}x${height}`);
      variants.add(found.passes.map((pass) => shaders.indexOf(pass.shader)).join());
    }
    // Networks cut dispatches in several ways; the sizes must include them.
    assert.ok(variants.size >= (name.includes(':') ? 1 : 3), `${variants.size} ways of cutting`);
  });
}

test('a wrong number is noticed', async () => {
  const { document, blob } = await exported('fast');
  const one = await exported('fast', '--size', '65x43');
  const program = await Program.from(document, blob);
  const shaders = document.shaders;
  assert.notDeepEqual(ofPackage(program.at(66, 43), shaders), ofFile(one.document, one.blob));
});

test('shaders of other choices are those that are exported with them', async () => {
  const { document, blob } = await exported('fast');
  const program = await Program.from(document, blob);
  for (const normals of program.encodings('normals')) {
    for (const depth of program.encodings('depth')) {
      for (const precision of program.precisions) {
        const other = await exported('fast', '--normals', normals, '--depth', depth, '--precision', precision);
        assert.deepEqual(program.shaders({ normals, depth, precision }), other.document.shaders);
      }
    }
  }
});

test('weights of 16 bits as 32-bit floats are near those of 32 bits', async () => {
  const [halves, floats] = [await exported('fast'), await exported('fast', '--precision', 'f32')];
  const program = await Program.from(halves.document, halves.blob);
  const exact = await Program.from(floats.document, floats.blob);
  const [a, b] = [program.at(64, 64, 'f32'), exact.at(64, 64)];
  let compared = 0;
  a.buffers.forEach((buffer, i) => {
    if (!buffer.weights) return;
    const [found, expected] = [program.weights(buffer.weights, 'f32'), exact.weights(b.buffers[i].weights, 'f32')].map((bytes) => new Float32Array(bytes));
    assert.equal(found.length, expected.length);
    // Half floats keep 11 bits, below 2^-14 fewer.
    found.forEach((value, k) => assert.ok(Math.abs(value - expected[k]) <= Math.max(2 ** -11 * Math.abs(expected[k]), 2 ** -25)));
    compared += found.length;
  });
  assert.ok(compared > 1000);
});

test('formulas', () => {
  const of = { width: 65, height: 43, real_bytes: 2 };
  assert.equal(evaluate({ add: ['real_bytes', { mul: [3, { div_ceil: ['width', 16] }] }] }, of), 17);
  assert.equal(evaluate({ max: ['width', 'height'] }, of), 65);
  assert.throws(() => evaluate({ halve: [1, 2] }, of), /number: expected width, height.*found \{"halve":\[1,2\]\}/);
  assert.throws(() => evaluate('depth', of), /found "depth"/);
});

test('files that do not belong together are refused', async () => {
  const { document, blob } = await exported('fast');
  const other = blob.slice(0);
  new Uint8Array(other)[100] ^= 1;
  await assert.rejects(Program.from(document, other), /SHA-256/);
  await assert.rejects(Program.from(document, blob.slice(4)), /block: expected \d+ bytes/);
  await assert.rejects(Program.from(document, new Uint8Array(blob)), /an ArrayBuffer, found Uint8Array/);
  await assert.rejects(Program.from({ ...document, format: 3 }, blob), /format: expected 2, found 3/);
  await assert.rejects(Program.from({ format: 2 }, blob), /program: expected what .* writes, found other JSON/);
  await assert.rejects(Program.from(null, blob), /format: expected 2, found undefined/);
  await assert.rejects(Program.load('http://127.0.0.1:9/program.json'), /127.0.0.1:9/);
  await assert.rejects(Program.load('no name'), /fast, balanced or the address/);
});
