// A GPUDevice in Node: Dawn (the npm package webgpu) on a software driver, SwiftShader as browsers contain it.
import { existsSync } from 'node:fs';

const DRIVERS = ['/usr/lib/chromium', '/usr/lib/chromium-browser', '/opt/google/chrome'].map((folder) => `${folder}/vk_swiftshader_icd.json`);

/** A device with the features that the adapter has of these. */
export async function device(features = [], limits = {}) {
  process.env.VK_DRIVER_FILES ??= DRIVERS.find(existsSync) ?? '';
  const { create, globals } = await import('webgpu');
  Object.assign(globalThis, globals);
  const gpu = create([]);
  const adapter = await gpu.requestAdapter();
  if (!adapter) throw new Error('Dawn: expected an adapter, found none: install chromium, whose driver is used');
  const requiredFeatures = features.filter((feature) => adapter.features.has(feature));
  const device = await adapter.requestDevice({ requiredFeatures, requiredLimits: limits });
  // Without a reference the instance would be collected.
  device.keep = [gpu, adapter];
  device.errors = [];
  device.addEventListener('uncapturederror', ({ error }) => device.errors.push(error.message));
  return device;
}

/** A texture of floats: 1 or 4 a pixel. */
export function floats(device, { width, height }, values, format) {
  const texture = device.createTexture({ size: [width, height], format, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST });
  const bytesPerRow = values.byteLength / height;
  device.queue.writeTexture({ texture }, values, { bytesPerRow }, [width, height]);
  return texture;
}

/** Three values a pixel as four. */
export const padded = (values) => Float32Array.from({ length: (values.length / 3) * 4 }, (_, i) => (i % 4 === 3 ? 0 : values[Math.floor(i / 4) * 3 + (i % 4)]));

/** Submits what `encode` encodes, and reads a texture of one 32-bit float a pixel back. */
export async function readBack(device, encode) {
  const encoder = device.createCommandEncoder();
  const texture = encode(encoder);
  const bytesPerRow = Math.ceil((4 * texture.width) / 256) * 256;
  const buffer = device.createBuffer({ size: bytesPerRow * texture.height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [texture.width, texture.height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(GPUMapMode.READ);
  const rows = new Float32Array(buffer.getMappedRange());
  return Float32Array.from({ length: texture.width * texture.height }, (_, i) => rows[Math.floor(i / texture.width) * (bytesPerRow / 4) + (i % texture.width)]);
}
