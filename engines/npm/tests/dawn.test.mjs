// Images of sessions on Dawn in Node, on a software driver, against the CPU program's.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { HalfSession, Program, Session } from '../src/index.js';
import { cpu, difference, exported } from './support/cpu.mjs';
import { device as open, floats, padded, readBack } from './support/dawn.mjs';
import { VIEW_FROM_WORLD, gbuffer, perspective } from './support/scene.mjs';

const [WIDTH, HEIGHT, FOV_Y, RADIUS] = [128, 72, Math.PI / 3, 0.6];
const [NEAR, FAR] = [0.1, 100];
// Measured with 32-bit floats: at most 2.3e-6 on average and 3.5e-5 anywhere, of which the file of 16 bits has 7.6e-6. Where a search is at a
// threshold, single pixels differ more. The survey of `balanced` has one value for a patch, so that its neighbours differ, too: 1.5e-5 on
// average, 21 pixels by up to 3.1e-3.
const [MEAN, MOST, OTHERS] = [2e-5, 1e-3, 42];

let device;
const own = (name) => ({
  document: JSON.parse(readFileSync(new URL(`../programs/${name}/program.json`, import.meta.url), 'utf8')),
  blob: new Uint8Array(readFileSync(new URL(`../programs/${name}/program.bin`, import.meta.url))).buffer,
});
const shipped = ({ document, blob }) => Program.from(document, blob);
const projection = perspective(FOV_Y, WIDTH / HEIGHT, NEAR, FAR);
const scene = gbuffer(WIDTH, HEIGHT, FOV_Y);
const standard = (depth) => depth.map((d) => (Number.isFinite(d) ? (1 / d - 1 / NEAR) / (1 / FAR - 1 / NEAR) : 1));
const frame = { projection, near: NEAR, far: FAR, radius: RADIUS };
const options = { width: WIDTH, height: HEIGHT, depth: 'linear', output: 'r32float' };
const inputs = (of, depth = of.depth, normals = of.normals) => ({
  depth: floats(device, of, depth, 'r32float'),
  normals: floats(device, of, padded(normals), 'rgba32float'),
});

before(async () => { device = await open(['shader-f16']); });
after(() => {
  const { errors } = device;
  device.destroy();
  assert.deepEqual(errors, []);
});

function near(found, expected, mean = MEAN, most = MOST) {
  const error = difference(found, expected);
  const others = found.filter((value, i) => !(Math.abs(value - expected[i]) <= most)).length;
  const seen = `mean ${error.mean.toExponential(1)}, max ${error.max.toExponential(1)}, ${others} above ${most}`;
  assert.ok(error.mean <= mean && error.max <= 10 * most && others <= OTHERS, seen);
  return seen;
}

const expected = new Map();
async function reference(model) {
  if (!expected.has(model)) expected.set(model, (await cpu(scene, { model, radius: RADIUS, fovY: FOV_Y })).values);
  const values = expected.get(model);
  assert.ok(Math.min(...values) < 0.6 && Math.max(...values) === 1, 'something to see');
  return values;
}

for (const model of ['fast', 'balanced']) {
  test(`${model} gives the CPU's image`, async (t) => {
    const session = await Session.create(device, await shipped(own(model)), options);
    const textures = inputs(scene);
    const run = () => readBack(device, (encoder) => session.encode(encoder, textures, frame));
    t.diagnostic(near(await run(), await reference(model)));
    // Another frame in the same buffers is the same.
    assert.deepEqual(await run(), await run());
    session.destroy();
    assert.throws(() => session.encode(device.createCommandEncoder(), textures, frame), /destroyed/);
  });
}

test('a classic method gives the CPU\'s image', async (t) => {
  const session = await Session.create(device, await shipped(await exported('agtao:tuned')), options);
  const values = await readBack(device, (encoder) => session.encode(encoder, inputs(scene), frame));
  t.diagnostic(near(values, (await cpu(scene, { method: 'agtao:tuned', radius: RADIUS, fovY: FOV_Y })).values));
});

test('two layers: the second depth is read', async (t) => {
  const session = await Session.create(device, await shipped(await exported('arcs:deep', '--layers', '2')), options);
  const second = floats(device, scene, scene.depth.map((d) => d + 0.3), 'r32float');
  const run = (textures) => readBack(device, (encoder) => session.encode(encoder, textures, frame));
  const [far, near] = [await run({ ...inputs(scene), second: floats(device, scene, scene.depth, 'r32float') }), await run({ ...inputs(scene), second })];
  t.diagnostic(`layers change the image by ${difference(far, near).mean}`);
  assert.ok(difference(far, near).mean > 1e-3);
  await assert.rejects(run(inputs(scene)), /second: expected a texture/);
});

test('stored depth, unorm and world-space normals, after a resize', async (t) => {
  const session = await Session.create(device, await shipped(own('fast')), {
    ...options, width: 50, height: 40, depth: 'standard', normals: 'plain', normalSpace: 'world',
  });
  await session.resize(WIDTH, HEIGHT);
  assert.deepEqual([session.width, session.height], [WIDTH, HEIGHT]);
  const textures = inputs(scene, standard(scene.depth), scene.world);
  const viewFromWorld = VIEW_FROM_WORLD;
  const values = await readBack(device, (encoder) => session.encode(encoder, textures, { ...frame, viewFromWorld }));
  // 32-bit floats of stored depth are coarse at a distance.
  t.diagnostic(near(values, await reference('fast'), 3e-4, 5e-2));
  const wrong = await readBack(device, (encoder) => session.encode(encoder, textures, { ...frame, viewFromWorld: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }));
  assert.ok(difference(wrong, await reference('fast')).mean > 1e-2, 'another rotation gives another image');

  const unorm = await Session.create(device, await shipped(own('fast')), { ...options, normals: 'unorm' });
  const bytes = Uint8Array.from(padded(scene.normals), (n) => Math.round(255 * (0.5 * n + 0.5)));
  const rounded = device.createTexture({ size: [WIDTH, HEIGHT], format: 'rgba8unorm', usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST });
  device.queue.writeTexture({ texture: rounded }, bytes, { bytesPerRow: 4 * WIDTH }, [WIDTH, HEIGHT]);
  const of8bits = await readBack(device, (encoder) => unorm.encode(encoder, { ...inputs(scene), normals: rounded }, frame));
  t.diagnostic(near(of8bits, await reference('fast'), 1e-2, 0.2));
});

test('a guard band', async (t) => {
  const margin = [16, 10];
  const wide = gbuffer(WIDTH, HEIGHT, FOV_Y, margin);
  const session = await Session.create(device, await shipped(own('fast')), { ...options, width: wide.width, height: wide.height });
  const output = device.createTexture({ size: [WIDTH, HEIGHT], format: 'r32float', usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC });
  const values = await readBack(device, (encoder) => session.encode(encoder, { ...inputs(wide), output }, frame));
  t.diagnostic(near(values, (await cpu(wide, { model: 'fast', radius: RADIUS, fovY: FOV_Y, margin })).values));
  assert.ok(difference(values, await reference('fast')).mean > 1e-4, 'the guard band changes the image');
});

test('half resolution is near the full one', async (t) => {
  const [width, height] = [127, 71];
  const odd = gbuffer(width, height, FOV_Y);
  const size = { ...options, width, height };
  const of = { ...frame, projection: perspective(FOV_Y, width / height, NEAR, FAR) };
  const run = async (Kind) => {
    const session = await Kind.create(device, await shipped(own('fast')), size);
    return readBack(device, (encoder) => session.encode(encoder, inputs(odd), of));
  };
  const [full, half] = [await run(Session), await run(HalfSession)];
  const error = difference(half, full);
  t.diagnostic(`mean ${error.mean}, max ${error.max}`);
  assert.ok(error.mean > 1e-4 && error.mean < 0.03, `mean ${error.mean}`);
  const background = odd.depth.findIndex((d) => d === Infinity);
  assert.equal(half[background], 1);
});

test('mistakes are errors that say what is wrong', async () => {
  const program = await shipped(own('fast'));
  const make = (changed) => Session.create(device, program, { ...options, ...changed });
  await assert.rejects(Session.create({}, program, options), /device: expected a GPUDevice/);
  await assert.rejects(Session.create(device, {}, options), /a Program: await Program.load\(\)/);
  await assert.rejects(make({ width: 0 }), /size: expected whole numbers from 1 to \d+, found 0x72/);
  await assert.rejects(make({ height: undefined }), /found 128xundefined/);
  await assert.rejects(make({ width: 1e6 }), /found 1000000x72/);
  await assert.rejects(make({ normals: 'rgb' }), /normals: expected one of .*octahedral.*found rgb/);
  await assert.rejects(make({ output: 'rgba8uint' }), /output: expected one of r8unorm/);
  await assert.rejects(make({ precision: 'bf16' }), /precision: expected one of f16, f32/);
  if (!device.features.has('shader-f16')) await assert.rejects(make({ precision: 'f16' }), /shader-f16/);
  // 128 MiB is what a device has unless it was asked for more.
  await assert.rejects(make({ width: 7680, height: 4320, precision: 'f32' }), /maxStorageBufferBindingSize: expected at least \d+ bytes for 7680x4320/);

  const session = await make({});
  const good = inputs(scene);
  const encode = (textures, numbers) => session.encode(device.createCommandEncoder(), { ...good, ...textures }, { ...frame, ...numbers });
  const small = inputs(gbuffer(16, 16, FOV_Y));
  assert.throws(() => encode({ depth: small.depth }), /depth: size: expected 128x72, found 16x16/);
  assert.throws(() => encode({ normals: undefined }), /normals: expected a GPUTexture, found undefined/);
  assert.throws(() => encode({ normals: good.depth }), /normals: format: expected one of rgba16float.*found r32float/);
  assert.throws(() => encode({ output: good.depth }), /output: usage: expected RENDER_ATTACHMENT/);
  const samples = device.createTexture({ size: [WIDTH, HEIGHT], format: 'depth32float', sampleCount: 4, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.RENDER_ATTACHMENT });
  const stored = await make({ depth: 'standard' });
  assert.throws(() => stored.encode(device.createCommandEncoder(), { ...good, depth: samples }, frame), /depth: samples: expected one/);
  assert.throws(() => stored.encode(device.createCommandEncoder(), good, { ...frame, far: 0.05 }), /0 < near < far, found near 0.1, far 0.05/);
  assert.throws(() => encode({}, { radius: -1 }), /radius: expected a finite length above 0/);
  assert.throws(() => encode({}, { projection: [1, 2] }), /projection: expected 16 finite numbers/);
  assert.throws(() => encode({}, { projection: new Array(16).fill(1) }), /last row/);
  await assert.rejects(session.resize(0, 10), /size/);
  // After an error the session works as before.
  near(await readBack(device, (encoder) => session.encode(encoder, good, frame)), await reference('fast'));
});

test('a lost device is reported', async () => {
  const other = await open();
  const session = await Session.create(other, await shipped(own('fast')), { ...options, width: 16, height: 16 });
  other.destroy();
  await other.lost;
  assert.throws(() => session.encode(null, {}, frame), /a lost one.*new session on a new device/);
  await assert.rejects(session.resize(8, 8), /a lost one/);
});
