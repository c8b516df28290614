// Runs a program on a GPUDevice, for frames of one size.
import { AonetError, check, wrong } from './errors.js';
import { FRAME_BYTES, frameBytes } from './frame.js';
import { Program } from './program.js';
import { checkDevice, inputView, marginOf } from './textures.js';

// By their numbers, as not every host has the names: GPUBufferUsage, GPUShaderStage, GPUTextureUsage.
const [COPY_DST, UNIFORM, STORAGE] = [0x8, 0x40, 0x80];
const [FRAGMENT, COMPUTE] = [2, 4];
const [COPY_SRC_TEXTURE, TEXTURE_BINDING, RENDER_ATTACHMENT] = [1, 4, 16];
const OUTPUTS = ['r8unorm', 'r16float', 'r32float', 'rgba8unorm', 'rgba16float', 'rgba32float'];
const TYPES = { uniform: 'uniform', read: 'read-only-storage', write: 'storage' };

/** A program on a device. */
export class Session {
  #device;
  #program;
  #choices;
  #format;
  #layers;
  #frameLayout;
  #frame;
  #shaders;
  #modules = new Map();
  #pipelines = new Map();
  #weights = [];
  #state = null;
  #bound = null;
  #own = null;
  #lost = null;
  #last = Promise.resolve();
  #destroyed = false;

  /** Compiles a program and allocates what it needs for frames of a size. See types/index.d.ts. */
  static async create(device, program, options) {
    check(device?.createComputePipelineAsync, 'device', 'a GPUDevice', device?.constructor?.name ?? typeof device);
    check(program instanceof Program, 'program', 'a Program: await Program.load()', program?.constructor?.name ?? typeof program);
    const session = new Session(device, program, options ?? {});
    await session.resize(options?.width, options?.height);
    return session;
  }

  /** Use {@link Session.create}. */
  constructor(device, program, { normals, normalSpace, depth, precision = 'auto', output = 'r16float' }) {
    const written = program.textures;
    const best = device.features.has('shader-f16') && program.precisions.includes('f16') ? 'f16' : 'f32';
    const chosen = (kind, value, all) => (check(all.includes(value), kind, `one of ${all.join(', ')}`, value), value);
    this.#choices = {
      normals: chosen('normals', normals ?? written.normals, program.encodings('normals')),
      normalSpace: chosen('normalSpace', normalSpace ?? written.normalSpace, ['view', 'world']),
      depth: chosen('depth', depth ?? written.depth, program.encodings('depth')),
      precision: precision === 'auto' ? best : chosen('precision', precision, program.precisions),
    };
    this.#format = chosen('output', output, OUTPUTS);
    this.#layers = written.layers;
    this.#device = device;
    this.#program = program;
    this.#shaders = program.shaders(this.#choices);
    const texture = (binding) => ({ binding, visibility: COMPUTE | FRAGMENT, texture: { sampleType: 'unfilterable-float' } });
    this.#frameLayout = device.createBindGroupLayout({
      label: 'aonet frame',
      entries: [
        { binding: 0, visibility: COMPUTE | FRAGMENT, buffer: { type: 'uniform' } },
        ...[1, 2, 3].slice(0, 1 + this.#layers).map(texture),
      ],
    });
    this.#frame = device.createBuffer({ label: 'aonet frame', size: FRAME_BYTES, usage: UNIFORM | COPY_DST });
    device.lost.then((info) => (this.#lost = info));
  }

  /** Width of the frames [px]. */
  get width() { return this.#state.size[0]; }
  /** Height of the frames [px]. */
  get height() { return this.#state.size[1]; }
  /** The numbers that it computes with: `f16` or `f32`. */
  get precision() { return this.#choices.precision; }
  /** Encodings of the textures. */
  get textures() { return { ...this.#choices, layers: this.#layers }; }
  /** Bytes on the device that passes hand over; weights not included. */
  get memoryBytes() { return this.#state.memoryBytes; }

  /** The session's own output, which {@link Session.encode} writes where no other is given. */
  get output() {
    const [width, height] = this.#state.size;
    if (this.#own?.width !== width || this.#own.height !== height) {
      this.#own?.destroy();
      const usage = RENDER_ATTACHMENT | TEXTURE_BINDING | COPY_SRC_TEXTURE;
      this.#own = this.#device.createTexture({ label: 'aonet visibility', size: [width, height], format: this.#format, usage });
    }
    return this.#own;
  }

  /** Changes the size of the frames. Until it has resolved, and after an error, the session keeps its size. */
  resize(width, height) {
    const next = this.#last.then(() => this.#resize(width, height));
    this.#last = next.catch(() => {});
    return next;
  }

  async #resize(width, height) {
    this.#alive();
    if (this.#state?.size[0] === width && this.#state.size[1] === height) return;
    const { precision } = this.#choices;
    const sized = this.#program.at(width, height, precision);
    checkDevice(this.#device, sized, [width, height], precision);
    const passes = sized.passes.map((pass) => this.#pipeline(pass.shader, pass.bindings, pass.sees_frame));
    const image = this.#pipeline(sized.image.shader, sized.image.bindings, true, this.#format);
    const pipelines = await Promise.all([...passes, image]).catch((cause) => {
      throw new AonetError(`aonet: shaders: expected ones that the device accepts, found: ${cause.message}`, { cause });
    });
    this.#alive();
    const state = await this.#scoped(`memory for ${width}x${height}`, () => this.#allocate(sized, [width, height], pipelines));
    if (this.#destroyed) this.#release(state);
    this.#alive();
    if (this.#state) this.#release(this.#state);
    this.#state = state;
    this.#bound = null;
  }

  /** What is made for one size: buffers, and groups that bind them. */
  #allocate({ buffers, passes, image }, size, pipelines) {
    const device = this.#device;
    const made = buffers.map((buffer, i) => {
      const { label, bytes, usage, weights, numbers } = buffer;
      if (weights && this.#weights[i]) return this.#weights[i];
      const created = device.createBuffer({ label: `aonet ${label}`, size: bytes, usage: (usage === 'uniform' ? UNIFORM : STORAGE) | COPY_DST });
      if (weights) device.queue.writeBuffer((this.#weights[i] = created), 0, this.#program.weights(weights, this.#choices.precision));
      if (numbers) device.queue.writeBuffer(created, 0, Uint32Array.from(numbers));
      return created;
    });
    const ready = [...passes, { ...image, label: 'image', sees_frame: true }].map((pass, i) => {
      const entries = pass.bindings.map((binding, at) => ({ binding: at, resource: { buffer: made[Object.values(binding)[0]] } }));
      const { pipeline, layout } = pipelines[i];
      return { ...pass, pipeline, group: device.createBindGroup({ label: `aonet ${pass.label}`, layout, entries }) };
    });
    return {
      size,
      passes: ready.slice(0, -1),
      image: ready.at(-1),
      buffers: made.filter((_, i) => !buffers[i].weights),
      cleared: made.filter((_, i) => buffers[i].cleared),
      memoryBytes: buffers.reduce((sum, { bytes, weights, numbers }) => sum + (weights || numbers ? 0 : bytes), 0),
    };
  }

  /** A compiled shader; each is compiled once. */
  #pipeline(shader, bindings, seesFrame, format) {
    const found = this.#pipelines.get(shader);
    if (found) return found;
    const device = this.#device;
    const visibility = format ? FRAGMENT : COMPUTE;
    const entries = bindings.map((binding, at) => ({ binding: at, visibility, buffer: { type: TYPES[Object.keys(binding)[0]] } }));
    const layout = device.createBindGroupLayout({ entries });
    const pipelineLayout = device.createPipelineLayout({ bindGroupLayouts: seesFrame ? [this.#frameLayout, layout] : [layout] });
    if (!this.#modules.has(shader)) this.#modules.set(shader, device.createShaderModule({ code: this.#shaders[shader] }));
    const module = this.#modules.get(shader);
    const compiled = format
      ? device.createRenderPipelineAsync({
          layout: pipelineLayout,
          vertex: { module, entryPoint: 'cover' },
          fragment: { module, entryPoint: 'main', targets: [{ format }] },
        })
      : device.createComputePipelineAsync({ layout: pipelineLayout, compute: { module, entryPoint: 'main' } });
    const made = compiled.then((pipeline) => ({ pipeline, layout }));
    this.#pipelines.set(shader, made);
    return made;
  }

  /** Runs what allocates; the device's complaints about it become errors. */
  async #scoped(what, make) {
    for (const filter of ['validation', 'out-of-memory']) this.#device.pushErrorScope(filter);
    const made = make();
    const errors = [await this.#device.popErrorScope(), await this.#device.popErrorScope()];
    const found = errors.find(Boolean);
    if (!found) return made;
    this.#release(made);
    this.#weights = [];
    throw wrong(what, 'what the device can give', found.message || found.constructor.name);
  }

  #release(state) {
    state.buffers.forEach((buffer) => buffer.destroy());
  }

  #alive() {
    check(!this.#destroyed, 'session', 'one that was not destroyed', 'a destroyed one');
    const { reason, message } = this.#lost ?? {};
    check(!this.#lost, 'device', 'one that works', `a lost one (${reason || 'unknown'}: ${message}): create a new session on a new device`);
  }

  /**
   * Encodes the passes of a frame. Its numbers are written at once, so encode one frame of a session for each submission.
   * @returns {GPUTexture} The output, with visibility in [0, 1].
   */
  encode(encoder, textures, frame) {
    this.#alive();
    const { size, cleared, passes, image } = this.#state;
    const { depth, normals, second, output = this.output } = textures ?? {};
    const margin = marginOf(output, size, this.#format);
    const group = this.#bind(depth, normals, second);
    this.#device.queue.writeBuffer(this.#frame, 0, frameBytes(this.#choices, size, margin, frame ?? {}));
    for (const buffer of cleared) encoder.clearBuffer(buffer);
    const compute = encoder.beginComputePass({ label: 'aonet' });
    for (const pass of passes) {
      compute.setPipeline(pass.pipeline);
      if (pass.sees_frame) compute.setBindGroup(0, group);
      compute.setBindGroup(pass.sees_frame ? 1 : 0, pass.group);
      compute.dispatchWorkgroups(...pass.workgroups);
    }
    compute.end();
    const target = { view: output.createView(), loadOp: 'clear', clearValue: [1, 1, 1, 1], storeOp: 'store' };
    const draw = encoder.beginRenderPass({ label: 'aonet image', colorAttachments: [target] });
    draw.setPipeline(image.pipeline);
    draw.setBindGroup(0, group);
    draw.setBindGroup(1, image.group);
    draw.draw(3);
    draw.end();
    return output;
  }

  /** The textures of a frame as a group, which is kept while they stay the same. */
  #bind(depth, normals, second) {
    const bound = this.#bound;
    if (bound && bound.depth === depth && bound.normals === normals && bound.second === second) return bound.group;
    const { size } = this.#state;
    const views = [inputView('normals', normals, size, this.#choices.normals), inputView('depth', depth, size, this.#choices.depth)];
    if (this.#layers === 2) {
      check(second, 'second', 'a texture, because the program has two layers', second);
      views.push(inputView('second depth', second, size, this.#choices.depth));
    }
    const entries = [{ buffer: this.#frame }, ...views].map((resource, binding) => ({ binding, resource }));
    const group = this.#device.createBindGroup({ label: 'aonet frame', layout: this.#frameLayout, entries });
    this.#bound = { depth, normals, second, group };
    return group;
  }

  /** Frees what the session has made on the device, its own output included. */
  destroy() {
    if (this.#destroyed) return;
    this.#destroyed = true;
    if (this.#state) this.#release(this.#state);
    [this.#frame, this.#own, ...this.#weights].forEach((made) => made?.destroy());
  }
}
