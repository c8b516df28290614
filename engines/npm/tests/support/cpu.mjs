// The program `aonet` as the reference.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { exr, png } from './exr.mjs';

/** Runs the program that the variable AONET names. */
export function aonet(...args) {
  const program = process.env.AONET;
  if (!program) throw new Error('AONET: expected the path of the program aonet, found nothing');
  return execFileSync(program, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}

/** A folder that exists while `use` runs. */
export async function inFolder(use) {
  const folder = mkdtempSync(join(tmpdir(), 'aonet-'));
  try {
    return await use(folder);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** What `aonet export --program` writes for these arguments. */
export const exported = (...args) =>
  inFolder((folder) => {
    aonet('export', ...args, '--program', folder);
    const blob = readFileSync(join(folder, 'program.bin'));
    const bytes = blob.buffer.slice(blob.byteOffset, blob.byteOffset + blob.length);
    return { document: JSON.parse(readFileSync(join(folder, 'program.json'), 'utf8')), blob: bytes };
  });

/** Visibility of a G-buffer by the CPU, at 32-bit precision. `command` is infer or a method's name. */
export const cpu = ({ width, height, depth, normals }, { model, method, radius, fovY, orthoHeight, margin = [0, 0] }) =>
  inFolder((folder) => {
    const [frame, ao, view] = ['frame.exr', 'ao.png', 'view.json'].map((name) => join(folder, name));
    const component = (c) => Float32Array.from({ length: width * height }, (_, i) => normals[3 * i + c]);
    const channels = { depth, 'normal.X': component(0), 'normal.Y': component(1), 'normal.Z': component(2) };
    const display = [margin[0], margin[1], width - 1 - margin[0], height - 1 - margin[1]];
    writeFileSync(frame, exr(channels, width, height, display));
    const [w, h] = [width - 2 * margin[0], height - 2 * margin[1]];
    const camera = orthoHeight ? { ortho_height: orthoHeight } : { fov_y_deg: (fovY * 180) / Math.PI };
    writeFileSync(view, JSON.stringify({ eye: [0, 0, 1], target: [0, 0, 0], width: w, height: h, radius, ...camera }));
    const command = method ? ['classic', method] : ['infer'];
    const options = method ? [] : ['--model', model, '--precision', 'f32'];
    aonet(...command, frame, '-o', ao, '--view', view, ...options);
    return png(readFileSync(ao));
  });

/** Mean and largest difference of two images. */
export function difference(a, b) {
  if (a.length !== b.length) throw new Error(`images: expected ${a.length} pixels, found ${b.length}`);
  const all = Array.from(a, (value, i) => Math.abs(value - b[i]));
  return { mean: all.reduce((sum, d) => sum + d, 0) / all.length, max: Math.max(...all) };
}
