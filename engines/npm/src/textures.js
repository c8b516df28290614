// What a session asks of the textures of a frame.
import { check, wrong } from './errors.js';

const TEXTURE_BINDING = 4;
const RENDER_ATTACHMENT = 16;

const NORMALS = {
  plain: ['rgba16float', 'rgba32float', 'rgba8snorm'],
  unorm: ['rgb10a2unorm', 'rgba8unorm', 'bgra8unorm'],
  octahedral: ['rg16float', 'rg32float', 'rg8snorm'],
  octahedral_unorm: ['rg8unorm'],
};
const STORED_DEPTH = ['depth24plus', 'depth32float', 'depth16unorm', 'depth24plus-stencil8', 'depth32float-stencil8', 'r32float', 'r16float'];
const DEPTH = { standard: STORED_DEPTH, reversed: STORED_DEPTH, linear: ['r32float', 'r16float'] };

/** The view of an input, which must have the session's size, a format of its encoding, and one sample a pixel. */
export function inputView(what, texture, [width, height], encoding) {
  const formats = what === 'normals' ? NORMALS[encoding] : DEPTH[encoding];
  common(what, texture, formats, `one of ${formats.join(', ')} for ${encoding} ${what}`, TEXTURE_BINDING, 'TEXTURE_BINDING');
  check(texture.width === width && texture.height === height, `${what}: size`, `${width}x${height}`, `${texture.width}x${texture.height}`);
  return texture.createView({ dimension: '2d', arrayLayerCount: 1, mipLevelCount: 1, aspect: texture.format.startsWith('depth') ? 'depth-only' : 'all' });
}

/** The guard band that the session has around an output, which may be smaller by an even number of pixels. */
export function marginOf(texture, [width, height], format) {
  common('output', texture, [format], format, RENDER_ATTACHMENT, 'RENDER_ATTACHMENT');
  const rest = [width - texture.width, height - texture.height];
  const ok = rest.every((side) => side >= 0 && side % 2 === 0);
  check(ok, 'output: size', `${width}x${height}, or less by an even number of pixels`, `${texture.width}x${texture.height}`);
  return rest.map((side) => side / 2);
}

function common(what, texture, formats, expected, usage, usageName) {
  if (!texture?.createView) throw wrong(what, 'a GPUTexture', texture?.constructor?.name ?? typeof texture);
  check(formats.includes(texture.format), `${what}: format`, expected, texture.format);
  check(texture.sampleCount === 1, `${what}: samples`, 'one sample a pixel', `${texture.sampleCount}: resolve it first, or draw a prepass without multisampling`);
  check(texture.usage & usage, `${what}: usage`, usageName, `0x${texture.usage.toString(16)}`);
}

/** Refuses devices on which the program cannot run, and sizes that are too large for them. */
export function checkDevice(device, { buffers, passes, image }, [width, height], precision) {
  const { limits, features } = device;
  const side = limits.maxTextureDimension2D;
  const whole = [width, height].every((n) => Number.isInteger(n) && n >= 1 && n <= side);
  check(whole, 'size', `whole numbers from 1 to ${side}`, `${width}x${height}`);
  check(precision !== 'f16' || features.has('shader-f16'), "the device's features", "shader-f16 (or precision: 'f32')", 'none');
  const arrays = (bindings) => bindings.filter((binding) => !('uniform' in binding)).length;
  const least = (name, needed) => check(!(limits[name] < needed), `the device's limit ${name}`, `at least ${needed}`, limits[name]);
  least('maxStorageBuffersPerShaderStage', Math.max(...passes.map((pass) => arrays(pass.bindings))));
  // Devices of the compatibility mode may have none in fragment shaders.
  least('maxStorageBuffersInFragmentStage', arrays(image.bindings));
  least('maxComputeInvocationsPerWorkgroup', 256);
  least('maxComputeWorkgroupStorageSize', 16384);
  least('maxComputeWorkgroupsPerDimension', Math.max(...passes.flatMap((pass) => pass.workgroups)));
  const largest = Math.max(...buffers.map((buffer) => buffer.bytes));
  const most = Math.min(limits.maxStorageBufferBindingSize, limits.maxBufferSize);
  const advice = `${width}x${height} with ${precision}: ask for higher limits with requestDevice, use half floats, or half resolution`;
  check(largest <= most, "the device's limit maxStorageBufferBindingSize", `at least ${largest} bytes for ${advice}`, most);
}
