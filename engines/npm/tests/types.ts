// Uses every declaration. `tsc --noEmit` checks it; wrong uses must be errors.
import { AonetError, HalfSession, Program, Session, type AnySession, type FrameNumbers, type SessionOptions, type TextureEncodings } from 'aonet';
import { AonetNode, aonet, aonetPass, type AonetOptions, type AonetPassNode } from 'aonet/three';
import { mrt, normalView, pass } from 'three/tsl';
import { PerspectiveCamera, RenderPipeline, Scene, WebGPURenderer } from 'three/webgpu';

export async function plain(device: GPUDevice, depth: GPUTexture, normals: GPUTexture): Promise<GPUTexture> {
  const program: Program = await Program.load('fast');
  await Program.load(new URL('https://example.org/program.json'));
  await Program.load();
  const encodings: TextureEncodings = program.textures;
  const options: SessionOptions = { width: depth.width, height: depth.height, ...encodings, depth: 'reversed', precision: 'auto' };
  const sessions: AnySession[] = [await Session.create(device, program, options), await HalfSession.create(device, program, options)];
  const [session] = sessions;
  await session.resize(640, 360);
  const frame: FrameNumbers = { projection: new Float32Array(16), near: 0.1, far: 100, radius: 0.5 };
  const encoder = device.createCommandEncoder();
  try {
    return session.encode(encoder, { depth, normals }, frame);
  } catch (error) {
    if (error instanceof AonetError) console.error(error.name satisfies 'AonetError', session.memoryBytes, session.precision);
    throw error;
  } finally {
    session.destroy();
  }
}

export function three(renderer: WebGPURenderer, scene: Scene, camera: PerspectiveCamera): RenderPipeline {
  const options: AonetOptions = { model: 'balanced', radius: 0.5, intensity: 1.2, halfResolution: true };
  const whole: AonetPassNode = aonetPass(scene, camera, { ...options, view: 'ao' });
  whole.view = 'lit';
  whole.ao.radius = 1;
  whole.ao.intensity.value = 2;
  const prepass = pass(scene, camera, { samples: 0 }).setMRT(mrt({ output: normalView }));
  const node: AonetNode = aonet(prepass.getTextureNode('depth'), prepass.getTextureNode(), camera, options);
  node.onError = ({ message }) => console.warn(message);
  void node.ready();
  return new RenderPipeline(renderer, node.isReady ? node.getTextureNode() : whole);
}

export async function mistakes(device: GPUDevice, program: Program, scene: Scene, camera: PerspectiveCamera) {
  // @ts-expect-error A session has a size.
  await Session.create(device, program, { width: 1 });
  // @ts-expect-error There is no such encoding.
  await Session.create(device, program, { width: 1, height: 1, normals: 'rgb' });
  // @ts-expect-error A blob is an ArrayBuffer.
  await Program.from({}, 'bytes');
  // @ts-expect-error Programs come from load or from.
  new Program();
  // @ts-expect-error A frame has a radius.
  ({ projection: [] }) satisfies FrameNumbers;
  // @ts-expect-error There is no such view.
  aonetPass(scene, camera).view = 'split';
  // @ts-expect-error A node reads textures.
  aonet(scene, scene, camera);
}
