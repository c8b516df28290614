// A small scene that needs no files: a room's corner with furniture made of boxes, a staircase and spheres.
import * as THREE from 'three/webgpu';

/** @returns {{ scene: THREE.Scene, camera: THREE.PerspectiveCamera }} */
export function makeScene(aspect = 16 / 9) {
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xb8c4d0);
  scene.add(new THREE.HemisphereLight(0xffffff, 0xd8d0c8, 2.6));
  const sun = new THREE.DirectionalLight(0xfff0dd, 0.9);
  sun.position.set(3, 6, 4);
  scene.add(sun);
  const add = (geometry, color, [x, y, z], turn = 0) => {
    const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial({ color, roughness: 0.9 }));
    mesh.position.set(x, y, z);
    mesh.rotation.y = turn;
    scene.add(mesh);
    return mesh;
  };
  const box = (...size) => new THREE.BoxGeometry(...size);
  add(box(9, 0.1, 7), 0xcfc6b8, [0, -0.05, 0]);
  add(box(9, 3.2, 0.1), 0xd8d8d4, [0, 1.55, -2.4]);
  add(box(0.1, 3.2, 7), 0xd0d4d8, [-3.2, 1.55, 0]);
  for (let i = 0; i < 5; i++) add(box(1.1, 0.22 * (i + 1), 0.36), 0xbfb4a4, [-2.4, 0.11 * (i + 1), 0.7 - 0.36 * i]);
  // A shelf with books.
  for (let i = 0; i < 4; i++) add(box(1.8, 0.06, 0.5), 0xa98a64, [1.9, 0.35 + 0.55 * i, -2.1]);
  for (const x of [1.0, 2.8]) add(box(0.06, 2.1, 0.5), 0xa98a64, [x, 1.05, -2.1]);
  const colors = [0x9c5b4a, 0x5f7d8c, 0x8c8a5f, 0x75608c, 0xb0a890];
  for (let i = 0; i < 21; i++) {
    const height = 0.28 + 0.05 * ((i * 7) % 4);
    add(box(0.12, height, 0.34), colors[i % 5], [1.15 + 0.2 * (i % 7), 0.38 + 0.55 * Math.floor(i / 7) + height / 2, -2.05], (i % 3) * 0.06);
  }
  // A table with legs, and things on and below it.
  add(box(1.7, 0.07, 1), 0xc09a70, [0.1, 0.75, -0.3], 0.25);
  for (const [x, z] of [[-0.6, -0.5], [0.9, -0.9], [-0.7, 0.35], [0.75, 0.1]]) add(box(0.08, 0.72, 0.08), 0xc09a70, [x, 0.36, z], 0.25);
  add(new THREE.SphereGeometry(0.22, 48, 24), 0xc8c4bc, [0.3, 1.0, -0.4]);
  add(new THREE.TorusGeometry(0.2, 0.07, 16, 48), 0x88a0a8, [-0.3, 0.86, -0.2]).rotation.x = Math.PI / 2;
  add(new THREE.SphereGeometry(0.3, 48, 24), 0xbfa8a0, [0.15, 0.3, -0.2]);
  add(new THREE.CylinderGeometry(0.32, 0.26, 0.6, 48, 1), 0xa8b49c, [1.6, 0.3, 0.7]);
  add(new THREE.TorusKnotGeometry(0.24, 0.08, 96, 16), 0xb8b8c0, [-1.3, 0.42, 0.9]);
  const camera = new THREE.PerspectiveCamera(45, aspect, 0.1, 50);
  camera.position.set(2.9, 2.2, 3.9);
  camera.lookAt(-0.25, 0.65, -0.7);
  return { scene, camera };
}
