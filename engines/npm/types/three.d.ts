import type { Camera, Node, PassNode, Scene, TextureNode, UniformNode } from 'three/webgpu';
import type { NormalEncoding, NormalSpace, Precision, Program, ShippedModel } from './index.js';

export interface AonetOptions {
  /** The network, `balanced` by default: a name, the address of a `program.json`, or a program. */
  model?: ShippedModel | (string & {}) | URL | Program;
  /** AO radius [world units], above 0; 0.5 by default. */
  radius?: number;
  /** Power of visibility, 1 by default: 0 is none, 2 is darker than rays would find. */
  intensity?: number;
  /** Whether a quarter of the pixels is computed; false by default. */
  halfResolution?: boolean;
  /** Encoding of the normals' texture, `plain` by default, as `mrt({ output: normalView })` writes them. */
  normals?: NormalEncoding;
  /** Space of the normals, `view` by default. */
  normalSpace?: NormalSpace;
  /** `auto`, the default, is `f16` where the device has it. */
  precision?: Precision | 'auto';
}

/**
 * Visibility of every pixel as a texture node: 1 is open, 0 is closed. It reads the depth and the normals of a pass without multisampling, and runs once
 * a frame, before the pass that uses it. Until the network is compiled, which the first frames start, everything is open.
 */
export class AonetNode extends Node {
  constructor(depthNode: TextureNode, normalNode: TextureNode, camera: Camera, options?: AonetOptions);

  /** AO radius [world units], above 0. */
  radius: number;
  /** Power of visibility; set its `value`. */
  readonly intensity: UniformNode<'float', number>;
  /** Whether a quarter of the pixels is computed. The change comes some frames later, when it is compiled. */
  halfResolution: boolean;
  /** Whether an image was computed. */
  readonly isReady: boolean;
  /** What went wrong; the node then keeps its last image. */
  readonly error: Error | null;
  /** Called once, with what went wrong; writes to the console unless it is set. */
  onError: (error: Error) => void;

  /** The texture of visibility, without `intensity`. */
  getTextureNode(): TextureNode;
  /** Visibility at the pixel that is drawn, to the power of `intensity`: for `builtinAOContext`. */
  getVisibilityNode(): Node<'float'>;
  /** Resolves with the first image; rejects with what went wrong. */
  ready(): Promise<void>;
  dispose(): void;
}

/**
 * A node to use where GTAONode is used.
 * @param depthNode Depth of a pass that has one sample a pixel: `prepass.getTextureNode('depth')`.
 * @param normalNode Its normals.
 * @param camera The pass's camera, perspective or orthographic.
 * @throws {AonetError} For arguments of another kind. What is wrong with renderer, textures or device comes with the frames: `onError`, `ready()`.
 */
export function aonet(depthNode: TextureNode, normalNode: TextureNode, camera: Camera, options?: AonetOptions): AonetNode;

/** What is shown: the lit scene, visibility alone, or the scene without ambient occlusion. */
export type AonetView = 'lit' | 'ao' | 'none';

/** The scene as a node, with its parts. */
export interface AonetPassNode extends Node<'vec4'> {
  readonly ao: AonetNode;
  /** Depth and normals. */
  readonly prepass: PassNode;
  /** The lit scene. */
  readonly scenePass: PassNode;
  view: AonetView;
}

/**
 * The scene with ambient occlusion, which darkens ambient light alone: a prepass for depth and normals, the network, and the pass that lights.
 * @throws {AonetError} As {@link aonet}.
 */
export function aonetPass(scene: Scene, camera: Camera, options?: AonetOptions & { view?: AonetView }): AonetPassNode;
