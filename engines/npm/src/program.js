// Programs as `aonet export --program` writes them: docs/program_format.md of aonet describes the files.
import { check, wrong } from './errors.js';

/** The format that this version reads. */
const FORMAT = 2;
/** Bytes of a number that activations and weights are made of. */
const REAL_BYTES = { f16: 2, f32: 4 };

// Bundlers find the files by these very expressions.
const SHIPPED = {
  fast: () => [
    new URL('../programs/fast/program.json', import.meta.url),
    new URL('../programs/fast/program.bin', import.meta.url),
  ],
  balanced: () => [
    new URL('../programs/balanced/program.json', import.meta.url),
    new URL('../programs/balanced/program.bin', import.meta.url),
  ],
};

/** A network or a classic method as a GPU runs it, for frames of any size. */
export class Program {
  #document;
  #blob;

  /** Use {@link Program.load} or {@link Program.from}. */
  constructor(document, blob) {
    this.#document = document;
    this.#blob = blob;
  }

  /**
   * Fetches a program: `fast`, `balanced`, or the address of a `program.json` beside its `program.bin`.
   * @param {string | URL} [which]
   */
  static async load(which = 'balanced') {
    const named = typeof which === 'string' && Object.hasOwn(SHIPPED, which);
    const json = named ? SHIPPED[which]()[0] : address(which);
    const [document, fetched] = await Promise.all([fetchAs(json, 'json'), named ? fetchAs(SHIPPED[which]()[1], 'arrayBuffer') : null]);
    const file = document?.blob?.file;
    check(fetched || typeof file === 'string', `${json}: blob.file`, 'the name of a file', file);
    return Program.from(document, fetched ?? (await fetchAs(new URL(file, json), 'arrayBuffer')));
  }

  /**
   * A program from the contents of its two files.
   * @param {object} document The parsed JSON.
   * @param {ArrayBuffer} blob
   */
  static async from(document, blob) {
    check(document?.format === FORMAT, 'program: format', FORMAT, document?.format);
    check(blob instanceof ArrayBuffer, 'program: block', 'an ArrayBuffer', blob?.constructor?.name ?? typeof blob);
    const { bytes, sha256 } = document.blob ?? {};
    check(Number.isInteger(bytes) && Array.isArray(document.passes), 'program', 'what `aonet export --program` writes', 'other JSON');
    check(blob.byteLength === bytes, 'program: block', `${bytes} bytes`, `${blob.byteLength} bytes`);
    // Pages that are not secure contexts cannot compute digests.
    if (sha256 && globalThis.crypto?.subtle) {
      const digest = new Uint8Array(await crypto.subtle.digest('SHA-256', blob));
      const found = Array.from(digest, (byte) => byte.toString(16).padStart(2, '0')).join('');
      check(found === sha256, 'program: SHA-256 of the block', sha256, `${found}: the two files do not belong together`);
    }
    return new Program(document, blob);
  }

  /** What the textures of a frame hold, unless a session chooses otherwise. */
  get textures() {
    const { normals, normal_space: normalSpace, depth, layers } = this.#document.textures;
    return { normals, normalSpace, depth, layers: layers === 'two' ? 2 : 1 };
  }

  /** The precisions that it can run with. */
  get precisions() {
    return Object.keys(this.#document.choices.precision);
  }

  /** Names of encodings: `normals` or `depth`. */
  encodings(kind) {
    return Object.keys(this.#document.choices[kind]);
  }

  /** The shaders for these choices. */
  shaders({ normals, depth, precision }) {
    const { choices, textures, precision: written, shaders } = this.#document;
    const swaps = [
      [choices.normals[textures.normals], choices.normals[normals]],
      [choices.depth[textures.depth], choices.depth[depth]],
      [choices.precision[written], choices.precision[precision]],
    ];
    return shaders.map((source) => swaps.reduce((text, [from, to]) => text.replace(from, to), source));
  }

  /** Buffers and passes for frames of a size: numbers in place of formulas. */
  at(width, height, precision = this.#document.precision) {
    const { buffers, passes, image, enough_workgroups: enough } = this.#document;
    const of = { width, height, real_bytes: REAL_BYTES[precision] };
    const number = (formula) => evaluate(formula, of);
    return {
      buffers: buffers.map(({ label, bytes, usage, contents, cleared = false }) => ({
        label, bytes: number(bytes), usage, cleared,
        // Weights do not depend on the size.
        weights: contents && !contents.numbers ? contents : null,
        numbers: contents?.numbers?.map(number) ?? null,
      })),
      passes: passes.map(({ variants, ...pass }) => {
        const sized = variants.map(({ shader, workgroups }) => ({ shader, workgroups: workgroups.map(number) }));
        const busy = ({ workgroups: [x, y, z] }) => x * y * z >= enough;
        return { ...pass, ...(sized.find(busy) ?? sized[sized.length - 1]) };
      }),
      image,
    };
  }

  /** The bytes that a buffer of weights starts with. */
  weights({ words, reals }, precision) {
    const { offset, bytes } = words ?? reals;
    const stored = this.#blob.slice(offset, offset + bytes);
    if (words || precision === this.#document.precision) return stored;
    check(this.#document.precision === 'f16', 'precision', this.#document.precision, precision);
    return Float32Array.from(new Uint16Array(stored), half).buffer;
  }
}

/** A number of 16 bits as a number. */
function half(bits) {
  const [sign, exponent, mantissa] = [bits >> 15 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
  if (exponent === 31) return mantissa ? NaN : sign * Infinity;
  return exponent ? sign * 2 ** (exponent - 15) * (1 + mantissa / 1024) : sign * 2 ** -24 * mantissa;
}

/** The value of a formula: see "Numbers" in docs/program_format.md. */
export function evaluate(formula, of) {
  if (typeof formula === 'number') return formula;
  if (typeof formula === 'string' && Object.hasOwn(of, formula)) return of[formula];
  const [[operation, two]] = Object.entries(formula ?? 0).concat([[]]);
  const [a, b] = Array.isArray(two) ? two.map((part) => evaluate(part, of)) : [];
  switch (operation) {
    case 'add': return a + b;
    case 'mul': return a * b;
    case 'div_ceil': return Math.ceil(a / b);
    case 'max': return Math.max(a, b);
    default: throw wrong('program: number', 'width, height, real_bytes, add, mul, div_ceil or max', JSON.stringify(formula));
  }
}

function address(which) {
  try {
    return new URL(which, globalThis.document?.baseURI ?? globalThis.location?.href);
  } catch {
    throw wrong('program', `${Object.keys(SHIPPED).join(', ')} or the address of a program.json`, which);
  }
}

/** Node's `fetch` reads no files of the disk. */
const fromDisk = async (url) => new Response(await process.getBuiltinModule('node:fs').promises.readFile(url));

async function fetchAs(url, kind) {
  const disk = url.protocol === 'file:' && typeof globalThis.process?.getBuiltinModule === 'function';
  const response = await (disk ? fromDisk : fetch)(url).catch((cause) => { throw wrong(String(url), 'a file of a program', cause.message); });
  check(response.ok, String(url), 'a file of a program', `${response.status} ${response.statusText}`);
  return response[kind]().catch((cause) => { throw wrong(String(url), kind === 'json' ? 'JSON' : 'bytes', cause.message); });
}
