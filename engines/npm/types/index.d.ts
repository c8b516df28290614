/** An error of this package: it names the thing, what was expected and what was found. */
export class AonetError extends Error {
  readonly name: 'AonetError';
}

/** Networks that are part of the package. */
export type ShippedModel = 'fast' | 'balanced';

/**
 * What a texture of normals holds, in its first components; the length of the vectors does not matter.
 *
 * - `plain`: the vector. rgba16float, rgba32float, rgba8snorm.
 * - `unorm`: 0.5 + 0.5 times the vector. rgb10a2unorm, rgba8unorm, bgra8unorm.
 * - `octahedral`: the unfolded octahedron, -1 to 1. rg16float, rg32float, rg8snorm.
 * - `octahedral_unorm`: the same, 0 to 1. rg8unorm.
 */
export type NormalEncoding = 'plain' | 'unorm' | 'octahedral' | 'octahedral_unorm';

/**
 * What a texture of depth holds.
 *
 * - `standard`: 0 at the near plane, 1 at the far plane, where the background is. Any depth format, r32float, r16float.
 * - `reversed`: 1 at the near plane, 0 at the far plane, where the background is. The same formats.
 * - `linear`: the distance along the viewing axis [world units]; 0, infinite or NaN on the background. r32float, r16float.
 */
export type DepthEncoding = 'standard' | 'reversed' | 'linear';

/** Space of the normals: x right, y up, z towards the viewer in `view`; the world's axes in `world`. */
export type NormalSpace = 'view' | 'world';

/** Numbers of weights and activations. `f16` needs the device's feature `shader-f16`. */
export type Precision = 'f16' | 'f32';

/** Format of an output. Textures of `r32float` and `rgba32float` cannot be filtered on every device. */
export type OutputFormat = 'r8unorm' | 'r16float' | 'r32float' | 'rgba8unorm' | 'rgba16float' | 'rgba32float';

/** What the textures of a frame hold. */
export interface TextureEncodings {
  normals: NormalEncoding;
  normalSpace: NormalSpace;
  depth: DepthEncoding;
  /** 2 where the program reads a second texture of depth. */
  layers: 1 | 2;
}

/** A network or a classic method as a GPU runs it, for frames of any size. Sessions share it. */
export class Program {
  private constructor();

  /**
   * Fetches a program. In Node, addresses of files are read from the disk.
   * @param which `fast`, `balanced` (the default), or the address of a `program.json` that `aonet export --program` has written.
   * Its `program.bin` lies beside it.
   * @throws {AonetError} Where there is no such file, or it is not a program of this version.
   */
  static load(which?: ShippedModel | (string & {}) | URL): Promise<Program>;

  /**
   * A program from the contents of its two files.
   * @param document The parsed `program.json`.
   * @param blob The bytes of `program.bin`.
   * @throws {AonetError} For another format number, another length or another SHA-256 than the document names.
   */
  static from(document: object, blob: ArrayBuffer): Promise<Program>;

  /** What the textures of a frame hold, unless a session chooses otherwise. */
  readonly textures: TextureEncodings;

  /** The precisions that it can run with. */
  readonly precisions: Precision[];

  /** The encodings that it can read. */
  encodings(kind: 'normals'): NormalEncoding[];
  encodings(kind: 'depth'): DepthEncoding[];
}

export interface SessionOptions {
  /** Width of the frames [px], guard band included. */
  width: number;
  /** Height of the frames [px], guard band included. */
  height: number;
  /** By default what the program was exported with; that of shipped networks is `plain`. */
  normals?: NormalEncoding;
  /** By default what the program was exported with; that of shipped networks is `view`. */
  normalSpace?: NormalSpace;
  /** By default what the program was exported with; that of shipped networks is `standard`. */
  depth?: DepthEncoding;
  /** `auto`, the default, is `f16` where program and device have it. */
  precision?: Precision | 'auto';
  /** Format of outputs, `r16float` by default. */
  output?: OutputFormat;
}

/** The textures of a frame. They need the usage TEXTURE_BINDING and one sample a pixel. */
export interface FrameTextures {
  /** As wide and high as the session. */
  depth: GPUTexture;
  /** As wide and high as the session. */
  normals: GPUTexture;
  /** Depth of what lies behind; only of programs with two layers. As wide and high as the session. */
  second?: GPUTexture;
  /**
   * Where visibility goes: usage RENDER_ATTACHMENT, the session's format and size. A smaller one, by an even number of pixels along each axis, is the
   * picture inside of a guard band. By default a texture of the session's own.
   */
  output?: GPUTexture;
}

/** The numbers of a frame. */
export interface FrameNumbers {
  /**
   * Projection of the picture without guard band: 16 numbers, column by column, for column vectors; view space looks along -Z. Perspective or
   * orthographic, off-centre and jittered ones as well. The row of depth is not read.
   */
  projection: ArrayLike<number>;
  /** Distance of the near plane [world units]. Not needed with `linear` depth. */
  near?: number;
  /** Distance of the far plane [world units]; infinite ones are allowed in perspective. Not needed with `linear` depth. */
  far?: number;
  /** AO radius [world units], above 0: the length of the rays that look for occluders. */
  radius: number;
  /** Rotation from world to view space, 16 numbers column by column. Only for normals in world space. */
  viewFromWorld?: ArrayLike<number>;
}

/** What {@link Session} and {@link HalfSession} can do. */
export interface AnySession {
  /** Width of the frames [px]. */
  readonly width: number;
  /** Height of the frames [px]. */
  readonly height: number;
  /** The numbers that it computes with. */
  readonly precision: Precision;
  /** Encodings of the textures. */
  readonly textures: TextureEncodings;
  /** Bytes on the device for activations; weights and outputs are not included. */
  readonly memoryBytes: number;
  /** The session's own output: visibility in [0, 1], 1 on the background. A change of size makes another. */
  readonly output: GPUTexture;

  /**
   * Changes the size of the frames. Until it has resolved, and after an error, the session keeps its size.
   * @throws {AonetError} For sizes that the device's limits or its memory do not allow.
   */
  resize(width: number, height: number): Promise<void>;

  /**
   * Encodes the passes of a frame. The frame's numbers are written to the device's queue at once: submit before the next frame is encoded.
   * @returns The output.
   * @throws {AonetError} For textures of another size, format or usage, for numbers out of range, and after the device was lost.
   */
  encode(encoder: GPUCommandEncoder, textures: FrameTextures, frame: FrameNumbers): GPUTexture;

  /** Frees what the session has made on the device, its own output included. */
  destroy(): void;
}

/** A program on a device, for frames of one size. */
export class Session implements AnySession {
  private constructor();

  /**
   * Compiles a program and allocates what it needs.
   * @throws {AonetError} For options out of range, and where the device lacks a feature, a limit or memory.
   */
  static create(device: GPUDevice, program: Program, options: SessionOptions): Promise<Session>;

  readonly width: number;
  readonly height: number;
  readonly precision: Precision;
  readonly textures: TextureEncodings;
  readonly memoryBytes: number;
  readonly output: GPUTexture;
  resize(width: number, height: number): Promise<void>;
  encode(encoder: GPUCommandEncoder, textures: FrameTextures, frame: FrameNumbers): GPUTexture;
  destroy(): void;
}

/**
 * A session that computes a quarter of the pixels and spreads them along surfaces. Width and height are those of the frames. Programs have one layer,
 * frames no guard band.
 */
export class HalfSession implements AnySession {
  private constructor();

  /** @throws {AonetError} As {@link Session.create}; and for programs with two layers. */
  static create(device: GPUDevice, program: Program, options: SessionOptions): Promise<HalfSession>;

  readonly width: number;
  readonly height: number;
  readonly precision: Precision;
  readonly textures: TextureEncodings;
  readonly memoryBytes: number;
  readonly output: GPUTexture;
  resize(width: number, height: number): Promise<void>;
  encode(encoder: GPUCommandEncoder, textures: Omit<FrameTextures, 'second'>, frame: FrameNumbers): GPUTexture;
  destroy(): void;
}
