// Ambient occlusion at half the resolution: every second pixel of every second row, and back along surfaces.
import { check } from './errors.js';
import { frameBytes, lensOf } from './frame.js';
import { Session } from './session.js';
import { inputView, marginOf } from './textures.js';

const [COPY_DST, UNIFORM] = [0x8, 0x40];
const [TEXTURE_BINDING, RENDER_ATTACHMENT] = [4, 16];

const COVER = `
@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}`;

const REDUCE = `
@group(0) @binding(0) var normals: texture_2d<f32>;
@group(0) @binding(1) var depths: texture_2d<f32>;
struct Half { @location(0) depth: vec4<f32>, @location(1) normal: vec4<f32> }
@fragment
fn main(@builtin(position) place: vec4<f32>) -> Half {
    let pixel = 2u * vec2<u32>(place.xy);
    return Half(textureLoad(depths, pixel, 0), textureLoad(normals, pixel, 0));
}`;

// A pixel that was computed keeps its value. Others take the mean of their two or four neighbours, weighted by how much these
// lie on the same surface: the depths that one relative step tells apart and the angle of the normals.
const ENLARGE = `
struct Lens { depth_line: vec2<f32>, perspective: u32 }
@group(0) @binding(0) var normals: texture_2d<f32>;
@group(0) @binding(1) var depths: texture_2d<f32>;
@group(0) @binding(2) var found: texture_2d<f32>;
@group(0) @binding(3) var<uniform> lens: Lens;
/// Relative difference of depth that halves a weight [guess].
const STEP: f32 = 0.02;
fn distance_at(pixel: vec2<u32>) -> f32 {
    let line = lens.depth_line.x * textureLoad(depths, pixel, 0).x + lens.depth_line.y;
    return select(line, 1.0 / max(line, 1e-9), lens.perspective == 1u);
}
@fragment
fn main(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(place.xy);
    let last = textureDimensions(found) - 1u;
    let depth = distance_at(pixel);
    let normal = textureLoad(normals, pixel, 0).xyz;
    var sum = 0.0;
    var total = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let cell = min(pixel / 2u + (pixel & vec2(1u)) * vec2(i & 1u, i >> 1u), last);
        let step = abs(distance_at(2u * cell) - depth) / (STEP * max(abs(depth), 1e-9));
        let turn = distance(textureLoad(normals, 2u * cell, 0).xyz, normal);
        let weight = 1.0 / (1.0 + step * step) / (1.0 + 16.0 * turn * turn) + 1e-6;
        sum += weight * textureLoad(found, cell, 0).x;
        total += weight;
    }
    return vec4(sum / total);
}`;

const halved = (size) => size.map((side) => Math.ceil(side / 2));

/** A session that computes a quarter of the pixels. It has the verbs of {@link Session}. */
export class HalfSession {
  #device;
  #inner;
  #format;
  #reduce;
  #enlarge;
  #lens;
  #state = null;

  /** As {@link Session.create}; width and height are those of the frames. Programs have one layer. */
  static async create(device, program, options = {}) {
    check(program?.textures?.layers === 1, 'program', 'one layer, at half resolution', `${program?.textures?.layers} layers`);
    const { width, height, output = 'r16float' } = options;
    const [halfWidth, halfHeight] = halved([width, height]);
    const inner = await Session.create(device, program, { ...options, width: halfWidth, height: halfHeight, output: 'r16float' });
    const session = new HalfSession(device, inner, output);
    session.#prepare();
    session.#allocate(width, height);
    return session;
  }

  /** Use {@link HalfSession.create}. */
  constructor(device, inner, format) {
    this.#device = device;
    this.#inner = inner;
    this.#format = format;
  }

  get width() { return this.#state.size[0]; }
  get height() { return this.#state.size[1]; }
  get precision() { return this.#inner.precision; }
  get textures() { return this.#inner.textures; }
  get memoryBytes() { return this.#inner.memoryBytes; }
  get output() { return this.#state.output; }

  #prepare() {
    const device = this.#device;
    const pipeline = (label, main, formats) => {
      const module = device.createShaderModule({ label, code: main + COVER });
      const targets = formats.map((format) => ({ format }));
      return device.createRenderPipeline({ label, layout: this.#layout(formats.length === 2 ? 2 : 4), vertex: { module }, fragment: { module, targets } });
    };
    this.#reduce = pipeline('aonet reduce', REDUCE, ['r32float', 'rgba16float']);
    this.#enlarge = pipeline('aonet enlarge', ENLARGE, [this.#format]);
    this.#lens = device.createBuffer({ label: 'aonet lens', size: 16, usage: UNIFORM | COPY_DST });
  }

  #layout(count) {
    const texture = { sampleType: 'unfilterable-float' };
    const kinds = [{ texture }, { texture }, { texture }, { buffer: { type: 'uniform' } }].slice(0, count);
    const layout = this.#device.createBindGroupLayout({ entries: kinds.map((kind, binding) => ({ binding, visibility: 2, ...kind })) });
    return this.#device.createPipelineLayout({ bindGroupLayouts: [layout] });
  }

  #allocate(width, height) {
    const size = [width, height];
    const make = (label, format, size) =>
      this.#device.createTexture({ label: `aonet ${label}`, size, format, usage: TEXTURE_BINDING | RENDER_ATTACHMENT | 1 });
    const old = this.#state;
    this.#state = {
      size,
      depth: make('half depth', 'r32float', halved(size)),
      normals: make('half normals', 'rgba16float', halved(size)),
      output: make('visibility', this.#format, size),
    };
    if (old) this.#free(old);
  }

  #free({ depth, normals, output }) {
    [depth, normals, output].forEach((texture) => texture.destroy());
  }

  /** See {@link Session#resize}. */
  async resize(width, height) {
    await this.#inner.resize(...halved([width, height]));
    this.#allocate(width, height);
  }

  /** See {@link Session#encode}. The output has the size of the frames: there is no guard band. */
  encode(encoder, { depth, normals, output = this.output }, frame) {
    const { size, ...half } = this.#state;
    const { textures } = this.#inner;
    check(marginOf(output, size, this.#format).every((side) => side === 0), 'output: size', size.join('x'), `${output.width}x${output.height}`);
    const inputs = [inputView('normals', normals, size, textures.normals), inputView('depth', depth, size, textures.depth)];
    this.#draw(encoder, this.#reduce, inputs, [half.depth, half.normals]);
    // Pixel (x, y) of the small frame is pixel (2x, 2y) of the large one, so its camera is not exactly in the middle.
    const { perspective, focal, centre } = frame?.lens ?? lensOf(frame?.projection, ...size);
    const small = { perspective, focal: focal.map((f) => f / 2), centre: centre.map((c) => (c + 0.5) / 2) };
    const found = this.#inner.encode(encoder, { depth: half.depth, normals: half.normals }, { ...frame, lens: small });
    const line = new DataView(frameBytes(textures, size, [0, 0], { ...frame, lens: { perspective, focal, centre } }));
    const numbers = [line.getUint32(56, true), line.getUint32(60, true), Number(perspective), 0];
    this.#device.queue.writeBuffer(this.#lens, 0, Uint32Array.from(numbers));
    this.#draw(encoder, this.#enlarge, [...inputs, found.createView(), { buffer: this.#lens }], [output]);
    return output;
  }

  #draw(encoder, pipeline, resources, targets) {
    const entries = resources.map((resource, binding) => ({ binding, resource }));
    const group = this.#device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries });
    const colorAttachments = targets.map((target) => ({ view: target.createView(), loadOp: 'clear', storeOp: 'store' }));
    const pass = encoder.beginRenderPass({ colorAttachments });
    pass.setPipeline(pipeline);
    pass.setBindGroup(0, group);
    pass.draw(3);
    pass.end();
  }

  /** See {@link Session#destroy}. */
  destroy() {
    this.#inner.destroy();
    this.#free(this.#state);
    this.#lens.destroy();
  }
}
