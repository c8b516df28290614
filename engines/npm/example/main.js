// The same scene without ambient occlusion, with three.js's GTAONode, and with aonet.
import * as THREE from 'three/webgpu';
import { builtinAOContext, mrt, normalView, pass, screenUV, vec3, vec4 } from 'three/tsl';
import { ao } from 'three/addons/tsl/display/GTAONode.js';
import { aonetPass } from 'aonet/three';
import { makeScene } from './scene.js';

const wanted = new URLSearchParams(location.search);
const still = wanted.has('still');
const size = wanted.get('size')?.split('x').map(Number);
const control = (id) => document.getElementById(id);

/** What a canvas shows: a node for each view. */
const KINDS = {
  none: ({ scene, camera }) => ({ lit: pass(scene, camera), ao: vec4(1), set() {} }),

  'GTAONode of three.js': ({ scene, camera }) => {
    const prepass = pass(scene, camera, { samples: 0 }).setMRT(mrt({ output: normalView }));
    const gtao = ao(prepass.getTextureNode('depth'), prepass.getTextureNode(), camera);
    const visibility = gtao.getTextureNode().sample(screenUV).r;
    const lit = pass(scene, camera);
    lit.contextNode = builtinAOContext(visibility);
    return { lit, ao: vec4(vec3(visibility), 1), set: ({ radius }) => (gtao.radius.value = radius) };
  },

  aonet: ({ scene, camera }) => {
    const node = aonetPass(scene, camera); // this line is all it takes
    return {
      lit: node, ao: node, of: node.ao,
      set({ radius, intensity, half, view }) {
        node.ao.radius = radius;
        node.ao.intensity.value = intensity;
        node.ao.halfResolution = half;
        node.view = view;
      },
    };
  },
};

async function start(name) {
  const canvas = document.createElement('canvas');
  const figure = document.createElement('figure');
  figure.append(canvas, Object.assign(document.createElement('figcaption'), { textContent: name }));
  control('pictures').append(figure);
  const [width, height] = size ?? [canvas.clientWidth * devicePixelRatio, canvas.clientHeight * devicePixelRatio].map(Math.round);
  const renderer = new THREE.WebGPURenderer({ canvas, antialias: !still });
  renderer.setSize(width, height, false);
  await renderer.init();
  const stage = makeScene(width / height);
  const kind = KINDS[name](stage);
  const pipeline = new THREE.RenderPipeline(renderer);
  if (kind.of) kind.of.onError = (error) => (control('message').textContent = error.message);
  return { name, canvas, renderer, pipeline, kind, stage };
}

function settings() {
  return { radius: Number(control('radius').value), intensity: Number(control('intensity').value), half: control('half').checked, view: control('view').value };
}

function draw({ pipeline, kind, stage }, seconds) {
  const now = settings();
  kind.set(now);
  const node = kind[now.view];
  if (pipeline.outputNode !== node) {
    pipeline.outputNode = node;
    pipeline.needsUpdate = true;
  }
  const angle = still ? 0.64 : 0.64 + 0.25 * Math.sin(0.3 * seconds);
  stage.camera.position.set(4.86 * Math.sin(angle), 2.2, 4.86 * Math.cos(angle));
  stage.camera.lookAt(-0.25, 0.65, -0.7);
  pipeline.render();
}

const all = [];
for (const name of Object.keys(KINDS)) all.push(await start(name));
const loop = (ms) => {
  all.forEach((one) => draw(one, ms / 1000));
  if (!still) requestAnimationFrame(loop);
};
if (!still) requestAnimationFrame(loop);

/** For pictures: draws until the network is compiled, then returns the canvases as PNG. */
window.pictures = async (view) => {
  control('view').value = view;
  const { of } = all.at(-1).kind;
  const found = {};
  for (const one of all) {
    do {
      draw(one, 0);
      await new Promise((resolve) => setTimeout(resolve, 30));
    } while (one.kind.of === of && of && !of.isReady && !of.error);
    draw(one, 0);
    found[one.name] = one.canvas.toDataURL('image/png');
  }
  return found;
};
