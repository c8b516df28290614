// The numbers of a frame: the uniform buffer that shaders see as `frame`. See "The frame" in docs/program_format.md.
import { check } from './errors.js';

export const FRAME_BYTES = 112;

/**
 * How a projection matrix projects onto a picture: focal lengths and the place of the camera's axis [px].
 * @param {ArrayLike<number>} m 16 numbers, column by column, for column vectors; view space looks along -Z.
 */
export function lensOf(m, width, height) {
  check(m?.length === 16 && Array.from(m).every(Number.isFinite), 'projection', '16 finite numbers, column by column', String(m));
  const perspective = m[11] === -1 && m[15] === 0;
  check(perspective || (m[11] === 0 && m[15] === 1), 'projection', 'a last row of (0, 0, -1, 0) or (0, 0, 0, 1)', `(${m[3]}, ${m[7]}, ${m[11]}, ${m[15]})`);
  check(m[0] > 0 && m[5] !== 0, 'projection', 'scales of x and y that are not 0', `${m[0]} and ${m[5]}`);
  const up = m[5] < 0 ? -1 : 1;
  const axis = perspective ? [-m[8], -m[9]] : [m[12], m[13]];
  return {
    perspective,
    focal: [0.5 * width * m[0], 0.5 * height * m[5] * up],
    centre: [0.5 * width * (1 + axis[0]), 0.5 * height * (1 - axis[1] * up)],
  };
}

/** Slope and offset that make a distance, or with perspective its inverse, of a stored depth. */
function depthLine(encoding, perspective, near, far) {
  if (encoding === 'linear') return [1, 0];
  const planes = perspective ? '0 < near < far' : '0 <= near < far, both finite';
  const ok = near >= 0 && far > near && (perspective ? near > 0 : Number.isFinite(far));
  check(ok, 'planes of the camera', planes, `near ${near}, far ${far}`);
  const at = (distance) => (perspective ? 1 / distance : distance);
  const [at0, at1] = encoding === 'reversed' ? [at(far), at(near)] : [at(near), at(far)];
  return [at1 - at0, at0];
}

/** Those numbers as bytes. `margin` is the guard band [px], columns on each side and rows above and below. */
export function frameBytes({ depth, normalSpace }, [width, height], margin, frame) {
  const { near, far, radius, viewFromWorld } = frame;
  check(radius > 0 && Number.isFinite(radius), 'radius', 'a finite length above 0, in world units', radius);
  // Matrices are those of the picture; the session sees the guard band as well.
  const inner = [width - 2 * margin[0], height - 2 * margin[1]];
  const lens = frame.lens ?? lensOf(frame.projection, ...inner);
  const bytes = new DataView(new ArrayBuffer(FRAME_BYTES));
  const floats = (at, ...values) => values.forEach((value, i) => bytes.setFloat32(at + 4 * i, value, true));
  const words = (at, ...values) => values.forEach((value, i) => bytes.setUint32(at + 4 * i, value, true));
  let turn = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0];
  if (normalSpace === 'world') {
    const ok = viewFromWorld?.length === 16 && Array.from(viewFromWorld).every(Number.isFinite);
    check(ok, 'viewFromWorld', '16 finite numbers, because normals are in world space', String(viewFromWorld));
    turn = turn.map((_, i) => (i % 4 === 3 ? 0 : viewFromWorld[i]));
  }
  floats(0, ...turn);
  words(48, width, height);
  floats(56, ...depthLine(depth, lens.perspective, near, far));
  floats(64, ...(lens.perspective ? [1 / lens.focal[1], 0] : [0, 1 / lens.focal[1]]));
  floats(72, lens.centre[0] + margin[0], lens.centre[1] + margin[1]);
  floats(80, lens.focal[1] / lens.focal[0], radius, Math.log2(radius * lens.focal[1]));
  words(96, ...margin);
  return bytes.buffer;
}
