// Ambient occlusion as a node of three.js's render pipeline, for its WebGPURenderer.
import { HalfFloatType, LinearFilter, Node, NodeUpdateType, RedFormat, RenderTarget, RendererUtils } from 'three/webgpu';
import { builtinAOContext, float, mrt, normalView, pass, passTexture, renderGroup, screenUV, select, uniform, vec3, vec4 } from 'three/tsl';
import { AonetError, check } from './errors.js';
import { HalfSession } from './half.js';
import { Program } from './program.js';
import { Session } from './session.js';

const VIEWS = ['lit', 'ao', 'none'];

/** A number that may change between frames. The group is one that three.js also updates for objects that stay as they are. */
const changing = (value, type) => uniform(value, type).setGroup(renderGroup);

/** The GPUTexture of a texture of three.js, or nothing before it was drawn. three.js has no public way to it. */
const gpuTexture = (renderer, texture) => renderer.backend.get(texture).texture;

/** Refuses renderers whose frames the network cannot read. */
function checkRenderer(renderer) {
  const { backend } = renderer;
  check(backend?.isWebGPUBackend === true, 'renderer', 'a WebGPURenderer on WebGPU', `${backend?.constructor?.name ?? typeof backend}: this browser or forceWebGL has no WebGPU`);
  check(backend.compatibilityMode !== true, 'renderer', 'a device with core-features-and-limits', 'a device in compatibility mode, whose fragment shaders have no storage buffers');
  check(renderer.logarithmicDepthBuffer !== true, 'depth buffer', 'a standard or reversed one', 'a logarithmic one: leave logarithmicDepthBuffer out, or use reversedDepthBuffer');
}

/** Visibility of every pixel: 1 is open, 0 is closed. See types/three.d.ts. */
export class AonetNode extends Node {
  static get type() { return 'AonetNode'; }

  constructor(depthNode, normalNode, camera, options = {}) {
    super('vec4');
    for (const [what, node] of [['depth node', depthNode], ['normal node', normalNode]]) {
      check(node?.isTextureNode === true, what, "a texture node, such as prepass.getTextureNode('depth')", node?.constructor?.name ?? typeof node);
    }
    check(camera?.isCamera === true, 'camera', 'a camera', camera?.constructor?.name ?? typeof camera);
    const { model = 'balanced', radius = 0.5, intensity = 1, halfResolution = false, normals = 'plain', normalSpace = 'view', precision = 'auto' } = options;
    this.depthNode = depthNode;
    this.normalNode = normalNode;
    this.camera = camera;
    this.radius = radius;
    this.intensity = changing(intensity);
    this.halfResolution = halfResolution;
    this.updateBeforeType = NodeUpdateType.FRAME;
    this.isReady = false;
    this.onError = (error) => console.error(error.message);
    this.error = null;
    this._options = { normals, normalSpace, precision, output: 'r16float' };
    this._program = model instanceof Program ? Promise.resolve(model) : Program.load(model);
    // Whoever awaits it gets the error; frames report it once.
    this._program.catch(() => {});
    this._ready = new Promise((resolve, reject) => (this._settle = { resolve, reject }));
    this._ready.catch(() => {});
    this._session = null;
    this._working = null;
    this._opened = false;
    this._target = new RenderTarget(1, 1, { depthBuffer: false, format: RedFormat, type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter });
    this._target.texture.name = 'aonet visibility';
    this._textureNode = passTexture(this, this._target.texture);
  }

  /** The texture of visibility without `intensity`. */
  getTextureNode() {
    return this._textureNode;
  }

  /** Visibility at the pixel that is drawn, to the power of `intensity`: for `builtinAOContext`. */
  getVisibilityNode() {
    return this._textureNode.sample(screenUV).r.max(0).pow(this.intensity);
  }

  /** Resolves once the network is compiled, which the first frames start; rejects with what went wrong. */
  ready() {
    return this._ready;
  }

  setup(builder) {
    // Both passes are built, and so drawn, before this node.
    const properties = builder.getNodeProperties(this);
    properties.depthNode = this.depthNode;
    properties.normalNode = this.normalNode;
    return this._textureNode;
  }

  updateBefore({ renderer }) {
    if (!this._opened) this._open(renderer);
    if (this.error) return;
    try {
      this._update(renderer);
    } catch (error) {
      this._fail(error);
    }
  }

  /** Until the network is there, and where it cannot be, everything is open. */
  _open(renderer) {
    this._opened = true;
    const state = RendererUtils.resetRendererState(renderer);
    renderer.setClearColor(0xffffff, 1);
    renderer.setRenderTarget(this._target);
    renderer.clear(true, false, false);
    RendererUtils.restoreRendererState(renderer, state);
  }

  _fail(error) {
    this.error = error;
    this._settle.reject(error);
    this.onError(error);
  }

  _update(renderer) {
    checkRenderer(renderer);
    const [depth, normals] = [this.depthNode, this.normalNode].map((node) => gpuTexture(renderer, node.value));
    if (!depth || !normals) return;
    this._prepare(renderer, depth);
    const session = this._session;
    if (session?.width !== depth.width || session.height !== depth.height) return;
    const { device } = renderer.backend;
    const output = this._output(renderer, depth);
    const encoder = device.createCommandEncoder({ label: 'aonet' });
    session.encode(encoder, { depth, normals, output }, this._frame());
    device.queue.submit([encoder.finish()]);
    if (!this.isReady) this._settle.resolve();
    this.isReady = true;
  }

  /** The render target's texture, of the frames' size. */
  _output(renderer, { width, height }) {
    this._target.setSize(width, height);
    renderer.initRenderTarget(this._target);
    return gpuTexture(renderer, this._target.texture);
  }

  _frame() {
    const { camera, radius } = this;
    const { near, far, projectionMatrix, matrixWorldInverse } = camera;
    return { projection: projectionMatrix.elements, viewFromWorld: matrixWorldInverse.elements, near, far, radius };
  }

  /** Starts what a frame of another size or kind needs; until it is there, the image of before stays. */
  _prepare(renderer, { width, height }) {
    const { device } = renderer.backend;
    const depth = renderer.reversedDepthBuffer ? 'reversed' : 'standard';
    const kind = `${this.halfResolution} ${depth}`;
    const fits = this._session && this._kind === kind && this._device === device;
    if (this._working || (fits && this._session.width === width && this._session.height === height)) return;
    const make = async () => {
      if (fits) return this._session.resize(width, height);
      const Kind = this.halfResolution ? HalfSession : Session;
      const session = await Kind.create(device, await this._program, { ...this._options, depth, width, height });
      this._session?.destroy();
      Object.assign(this, { _session: session, _kind: kind, _device: device });
      if (this._disposed) session.destroy();
    };
    this._working = make().catch((error) => this._fail(error)).finally(() => (this._working = null));
  }

  dispose() {
    this._disposed = true;
    this.error ??= new AonetError('aonet: node: expected one in use, found a disposed one');
    this._session?.destroy();
    this._target.dispose();
    super.dispose();
  }
}

/** A node of visibility from a prepass's depth and view-space normals. */
export const aonet = (depthNode, normalNode, camera, options) => new AonetNode(depthNode, normalNode, camera, options);

/** The scene with ambient occlusion: a prepass, the network, and the pass that lights. See types/three.d.ts. */
export function aonetPass(scene, camera, options = {}) {
  const prepass = pass(scene, camera, { samples: 0 }).setMRT(mrt({ output: normalView }));
  prepass.name = 'aonet prepass';
  prepass.transparent = false;
  const ao = aonet(prepass.getTextureNode('depth'), prepass.getTextureNode(), camera, options);
  const visibility = ao.getVisibilityNode();
  const lit = pass(scene, camera);
  const shown = changing(0, 'int');
  lit.contextNode = builtinAOContext(select(shown.equal(VIEWS.indexOf('none')), float(1), visibility));
  const node = select(shown.equal(VIEWS.indexOf('ao')), vec4(vec3(visibility), 1), lit);
  Object.defineProperties(node, {
    ao: { value: ao },
    prepass: { value: prepass },
    scenePass: { value: lit },
    view: {
      get: () => VIEWS[shown.value],
      set(view) {
        check(VIEWS.includes(view), 'view', `one of ${VIEWS.join(', ')}`, view);
        shown.value = VIEWS.indexOf(view);
      },
    },
  });
  node.view = options.view ?? 'lit';
  return node;
}
