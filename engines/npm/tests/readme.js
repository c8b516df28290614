// Runs the README's code in a browser, as it is, but for sizes that a software device can manage. tests/readme.test.mjs judges.
const SMALL = [96, 54];
const post = (name, value) => fetch(`/report/${name}`, { method: 'POST', body: JSON.stringify(value) });
/** Passes of three.js are drawn once in a frame of the browser. */
const nextFrame = () => new Promise(requestAnimationFrame);
const wait = () => new Promise((resolve) => setTimeout(resolve, 50));

/** A block as a module that also exports these names. */
async function run(code, sizes, names = []) {
  for (const size of sizes) {
    if (!code.includes(size)) throw new Error(`README: expected ${size}, found none`);
    code = code.replaceAll(size, SMALL.join(size.match(/[^0-9]+/)[0]));
  }
  const url = URL.createObjectURL(new Blob([`${code}\nexport { ${names.join()} };`], { type: 'text/javascript' }));
  return import(url);
}

/** Mean of a canvas [0 to 255]. */
function mean(canvas) {
  const picture = new OffscreenCanvas(canvas.width, canvas.height);
  picture.getContext('2d').drawImage(canvas, 0, 0);
  const { data } = picture.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  return data.reduce((sum, value, i) => (i % 4 < 3 ? sum + value : sum), 0) / (0.75 * data.length);
}

/** The first picture: it appears by itself; then both views. */
async function first(code) {
  const { renderer, node, pipeline, scene, camera } = await run(code, ['640, 360'], ['renderer', 'node', 'pipeline', 'scene', 'camera']);
  await node.ao.ready();
  renderer.setAnimationLoop(null);
  const found = {};
  for (const view of ['lit', 'none']) {
    node.view = view;
    await nextFrame();
    pipeline.render();
    found[view] = mean(renderer.domElement);
  }
  return { found, renderer, scene, camera };
}

/** The pass in GTAONode's place. */
async function inPlace(code, { renderer, scene, camera }) {
  const { RenderPipeline } = await import('three/webgpu');
  const { lit, node } = (await run(code, [])).scenePass(scene, camera);
  const pipeline = new RenderPipeline(renderer, lit);
  while (!node.isReady) {
    pipeline.render();
    await wait();
    if (node.error) throw node.error;
  }
  await nextFrame();
  pipeline.render();
  return mean(renderer.domElement);
}

/** A session: a wall that fills the picture, and one whose right half is nearer. */
async function session(code) {
  const { device, ambientOcclusion } = await run(code, ['1280, 720']);
  const [width, height] = SMALL;
  const complaints = [];
  device.onuncapturederror = ({ error }) => complaints.push(error.message);
  const fill = (format, values) => {
    const texture = device.createTexture({ size: SMALL, format, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST });
    device.queue.writeTexture({ texture }, values, { bytesPerRow: values.byteLength / height }, SMALL);
    return texture;
  };
  const stored = (distance) => (1 / distance - 1 / 0.1) / (1 / 100 - 1 / 0.1);
  const normals = fill('rgba32float', Float32Array.from({ length: 4 * width * height }, (_, i) => Number(i % 4 === 2)));
  const projection = [height / width, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.1, 0];
  const found = [];
  for (const step of [0, 0.3]) {
    const depth = fill('r32float', Float32Array.from({ length: width * height }, (_, i) => stored(i % width < width / 2 ? 2 : 2 - step)));
    const encoder = device.createCommandEncoder();
    const texture = ambientOcclusion(encoder, depth, normals, projection);
    const bytesPerRow = 256;
    const buffer = device.createBuffer({ size: bytesPerRow * height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, SMALL);
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const halves = new Uint16Array(buffer.getMappedRange(), (bytesPerRow * height) / 2, width);
    const number = (bits) => (bits >> 10 ? 2 ** ((bits >> 10) - 25) * (1024 + (bits & 1023)) : bits * 2 ** -24);
    found.push({ format: texture.format, middleRow: Array.from(halves, number) });
  }
  return { found, complaints };
}

try {
  const blocks = await (await post('blocks', {})).json();
  const started = await first(blocks[0]);
  await post('progress', {});
  const place = await inPlace(blocks[1], started);
  await post('progress', {});
  await post('done', { first: started.found, inPlace: place, session: await session(blocks[2]), count: blocks.length });
} catch (error) {
  await post('done', { error: error.stack });
}
