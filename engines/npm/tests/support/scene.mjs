// A G-buffer by rays: a floor, a wall, and spheres on the floor.

const SPHERES = [[-1.2, 0.5, -0.2, 0.5], [0, 0.7, -0.8, 0.7], [1.1, 0.4, 0.3, 0.4], [0.2, 0.25, 0.7, 0.25]];
const EYE = [0.4, 1.5, 3.6];
const TILT = -0.33;

const add = (a, b, by) => a.map((v, i) => v + by * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** The camera's rotation from world to view space, column by column, 4x4. */
export const VIEW_FROM_WORLD = [1, 0, 0, 0, 0, Math.cos(TILT), -Math.sin(TILT), 0, 0, Math.sin(TILT), Math.cos(TILT), 0, 0, 0, 0, 1];
const toWorld = (v) => [0, 1, 2].map((row) => VIEW_FROM_WORLD.slice(4 * row, 4 * row + 3).reduce((sum, m, i) => sum + m * v[i], 0));
const toView = (v) => [0, 1, 2].map((row) => [0, 1, 2].reduce((sum, column) => sum + VIEW_FROM_WORLD[4 * column + row] * v[column], 0));

function hit(origin, way) {
  let best = { t: Infinity, normal: [0, 0, 0] };
  const found = (t, normal) => { if (t > 1e-4 && t < best.t) best = { t, normal }; };
  found(-origin[1] / way[1], [0, 1, 0]);
  // The wall is low, so that there is background above it.
  const wall = (-1.8 - origin[2]) / way[2];
  if (origin[1] + wall * way[1] < 1.6) found(wall, [0, 0, 1]);
  for (const [x, y, z, r] of SPHERES) {
    const from = add(origin, [x, y, z], -1);
    const [a, b, c] = [dot(way, way), dot(from, way), dot(from, from) - r * r];
    const root = b * b - a * c;
    if (root >= 0) {
      const t = (-b - Math.sqrt(root)) / a;
      found(t, add(from, way, t).map((v) => v / r));
    }
  }
  return best;
}

/** A perspective projection matrix for WebGPU, column by column. */
export function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, far / (near - far), -1, 0, 0, (near * far) / (near - far), 0];
}

/** Depth along the axis and normals in view space and in world space, of a picture `margin` [px] wider on each side. */
export function gbuffer(width, height, fovY, margin = [0, 0]) {
  const [w, h] = [width + 2 * margin[0], height + 2 * margin[1]];
  const focal = (0.5 * height) / Math.tan(fovY / 2);
  const depth = new Float32Array(w * h);
  const [normals, world] = [new Float32Array(3 * w * h), new Float32Array(3 * w * h)];
  for (let i = 0; i < w * h; i++) {
    const [x, y] = [i % w, Math.floor(i / w)];
    const way = [(x + 0.5 - w / 2) / focal, -(y + 0.5 - h / 2) / focal, -1];
    const { t, normal } = hit(EYE, toWorld(way));
    depth[i] = t;
    normals.set(toView(normal), 3 * i);
    world.set(normal, 3 * i);
  }
  return { width: w, height: h, depth, normals, world };
}
