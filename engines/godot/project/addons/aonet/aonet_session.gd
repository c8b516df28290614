@tool
class_name AonetSession
extends RefCounted
## Runs a program on a [RenderingDevice]: the buffers, shaders and pipelines of one device.
##
## Use it on the rendering thread alone. Sizes that were not used for a while are forgotten.

## Frames after which the memory of a size is freed.
const PATIENCE := 120
## Where frames' numbers lie: see "The frame" in docs/program_format.md of aonet.
const FRAME_BYTES := 112

var _device: RenderingDevice
var _program: AonetProgram
## Shaders by their place in the list, and pipelines by shader.
var _shaders: Dictionary[int, RID]
var _pipelines: Dictionary[int, RID]
## The draw's pipeline by the format of the framebuffer.
var _draws: Dictionary[int, RID]
## Weights by their place in the list of buffers.
var _weights: Dictionary[int, RID]
var _sizes: Dictionary[Vector2i, Sized]
var _intensity: RID
var _frame := 0


## What belongs to frames of one size.
class Sized:
	var frame: RID
	var buffers: Array[RID]
	## Buffers that hold zeros at the beginning of every frame, and their bytes.
	var cleared: Array[Array]
	## Those that are not shared with other sizes.
	var own: Array[RID]
	## Dictionaries: shader, pipeline, sees_frame, bindings, groups.
	var passes: Array[Dictionary]
	var image_set: RID
	## Whether the device has given all of it.
	var complete := false
	var last := 0


func _init(device: RenderingDevice, program: AonetProgram) -> void:
	_device = device
	_program = program
	_intensity = device.uniform_buffer_create(16)


func _notification(what: int) -> void:
	if what == NOTIFICATION_PREDELETE:
		var all: Array[RID] = [_intensity]
		all.append_array(_weights.values())
		for sized: Sized in _sizes.values():
			all.append_array(sized.own)
		# Pipelines and sets of uniforms go with their shaders.
		all.append_array(_shaders.values())
		RenderingServer.call_on_render_thread(_free.bind(_device, all))


static func _free(device: RenderingDevice, all: Array[RID]) -> void:
	for rid in all:
		if rid.is_valid():
			device.free_rid(rid)


## Whether the device gives what a size needs. Call it before [method encode]; Godot prints why not.
func prepare(size: Vector2i) -> bool:
	return _sized(size).complete


## Encodes a frame of textures: visibility of "normals" and "depth" is drawn to "raw", and its [param power] is written to "result",
## whose format is R8. [param numbers] are those of [method AonetEffect.frame_bytes].
func encode(size: Vector2i, numbers: PackedByteArray, textures: Dictionary, power: float) -> void:
	_frame += 1
	var sized := _sized(size)
	_device.buffer_update(sized.frame, 0, FRAME_BYTES, numbers)
	_device.buffer_update(_intensity, 0, 16, PackedFloat32Array([power, 0, 0, 0]).to_byte_array())
	for each in sized.cleared:
		_device.buffer_clear(each[0], 0, each[1])
	var frame: Array[RDUniform] = [
		_uniform(RenderingDevice.UNIFORM_TYPE_UNIFORM_BUFFER, 0, sized.frame),
		_uniform(RenderingDevice.UNIFORM_TYPE_TEXTURE, 1, textures.normals),
		_uniform(RenderingDevice.UNIFORM_TYPE_TEXTURE, 2, textures.depth),
	]
	var compute := _device.compute_list_begin()
	for step in sized.passes:
		_device.compute_list_bind_compute_pipeline(compute, step.pipeline)
		if step.sees_frame:
			_device.compute_list_bind_uniform_set(compute, UniformSetCacheRD.get_cache(step.shader, 0, frame), 0)
		_device.compute_list_bind_uniform_set(compute, step.bindings, 1 if step.sees_frame else 0)
		var groups: Vector3i = step.groups
		_device.compute_list_dispatch(compute, groups.x, groups.y, groups.z)
		_device.compute_list_add_barrier(compute)
	_device.compute_list_end()
	_draw(sized, frame, textures.raw)
	_finish(size, textures)
	_forget()


## Draws visibility.
func _draw(sized: Sized, frame: Array[RDUniform], raw: RID) -> void:
	var attachments := RDFramebufferPass.new()
	attachments.color_attachments = PackedInt32Array([0])
	var framebuffer := FramebufferCacheRD.get_cache_multipass([raw], [attachments], 1)
	var image: Dictionary = _program.list().image
	var shader := _shader(int(image.shader))
	var list := _device.draw_list_begin(framebuffer)
	_device.draw_list_bind_render_pipeline(list, _draw_pipeline(shader, _device.framebuffer_get_format(framebuffer)))
	_device.draw_list_bind_uniform_set(list, UniformSetCacheRD.get_cache(shader, 0, frame), 0)
	_device.draw_list_bind_uniform_set(list, sized.image_set, 1)
	_device.draw_list_draw(list, false, 1, 3)
	_device.draw_list_end()


## Writes its power.
func _finish(size: Vector2i, textures: Dictionary) -> void:
	var index := int(_program.list().finish.shader)
	var uniforms: Array[RDUniform] = [
		_uniform(RenderingDevice.UNIFORM_TYPE_UNIFORM_BUFFER, 0, _intensity),
		_uniform(RenderingDevice.UNIFORM_TYPE_TEXTURE, 1, textures.raw),
		_uniform(RenderingDevice.UNIFORM_TYPE_IMAGE, 2, textures.result),
	]
	var compute := _device.compute_list_begin()
	_device.compute_list_bind_compute_pipeline(compute, _pipeline(index))
	_device.compute_list_bind_uniform_set(compute, UniformSetCacheRD.get_cache(_shader(index), 0, uniforms), 0)
	_device.compute_list_dispatch(compute, ceili(size.x / 8.0), ceili(size.y / 8.0), 1)
	_device.compute_list_end()


func _forget() -> void:
	for size: Vector2i in _sizes.keys():
		if _frame - _sizes[size].last > PATIENCE:
			# Sets of uniforms go with their buffers.
			_free(_device, _sizes[size].own)
			_sizes.erase(size)


## What a size needs; it is made where it is new.
func _sized(size: Vector2i) -> Sized:
	var sized: Sized = _sizes.get(size)
	if sized == null:
		sized = _make(size)
		_sizes[size] = sized
	sized.last = _frame
	return sized


func _make(size: Vector2i) -> Sized:
	var sized := Sized.new()
	var list := _program.list()
	sized.frame = _device.uniform_buffer_create(FRAME_BYTES)
	sized.own.append(sized.frame)
	for index in list.buffers.size():
		_make_buffer(sized, index, size)
		if not sized.buffers[index].is_valid():
			return sized
	for step: Dictionary in list.passes:
		var chosen := _program.variant(step.variants, size)
		if not _pipeline(chosen.shader).is_valid():
			return sized
		chosen.sees_frame = step.sees_frame
		chosen.pipeline = _pipeline(chosen.shader)
		chosen.shader = _shader(chosen.shader)
		chosen.bindings = _bindings(sized, step.bindings, chosen.shader, 1 if step.sees_frame else 0)
		sized.passes.append(chosen)
	if _shader(int(list.image.shader)).is_valid() and _pipeline(int(list.finish.shader)).is_valid():
		sized.image_set = _bindings(sized, list.image.bindings, _shader(int(list.image.shader)), 1)
		sized.complete = true
	return sized


func _make_buffer(sized: Sized, index: int, size: Vector2i) -> void:
	var entry: Dictionary = _program.list().buffers[index]
	if _weights.has(index):
		sized.buffers.append(_weights[index])
		return
	var contents: Dictionary = entry.get("contents", {})
	var bytes := PackedByteArray()
	if contents.has("numbers"):
		var values: Array = contents.numbers
		bytes.resize(4 * values.size())
		for i in values.size():
			bytes.encode_u32(4 * i, _program.number(values[i], size))
	elif not contents.is_empty():
		bytes = _program.part(contents.values()[0])
	var buffer: RID
	if entry.usage == "uniform":
		# Blocks of uniforms are a multiple of 16 bytes.
		bytes.resize(ceili(_program.number(entry.bytes, size) / 16.0) * 16)
		buffer = _device.uniform_buffer_create(bytes.size(), bytes)
	else:
		buffer = _device.storage_buffer_create(_program.number(entry.bytes, size), bytes)
	sized.buffers.append(buffer)
	if contents.has("words") or contents.has("reals"):
		_weights[index] = buffer
	else:
		sized.own.append(buffer)
	if entry.get("cleared", false):
		sized.cleared.append([buffer, _program.number(entry.bytes, size)])


## The set of a pass's own buffers.
func _bindings(sized: Sized, bindings: Array, shader: RID, index: int) -> RID:
	var uniforms: Array[RDUniform] = []
	for place in bindings.size():
		var kind: String = bindings[place].keys()[0]
		var type := RenderingDevice.UNIFORM_TYPE_STORAGE_BUFFER
		if kind == "uniform":
			type = RenderingDevice.UNIFORM_TYPE_UNIFORM_BUFFER
		uniforms.append(_uniform(type, place, sized.buffers[int(bindings[place][kind])]))
	return _device.uniform_set_create(uniforms, shader, index)


static func _uniform(type: RenderingDevice.UniformType, binding: int, id: RID) -> RDUniform:
	var uniform := RDUniform.new()
	uniform.uniform_type = type
	uniform.binding = binding
	uniform.add_id(id)
	return uniform


func _shader(index: int) -> RID:
	if not _shaders.has(index):
		_shaders[index] = _device.shader_create_from_spirv(_program.shader(index), "aonet %d" % index)
	return _shaders[index]


func _pipeline(index: int) -> RID:
	if not _pipelines.has(index):
		var shader := _shader(index)
		_pipelines[index] = _device.compute_pipeline_create(shader) if shader.is_valid() else RID()
	return _pipelines[index]


func _draw_pipeline(shader: RID, format: int) -> RID:
	if not _draws.has(format):
		var blend := RDPipelineColorBlendState.new()
		blend.attachments = [RDPipelineColorBlendStateAttachment.new()]
		_draws[format] = _device.render_pipeline_create(
			shader,
			format,
			RenderingDevice.INVALID_FORMAT_ID,
			RenderingDevice.RENDER_PRIMITIVE_TRIANGLES,
			RDPipelineRasterizationState.new(),
			RDPipelineMultisampleState.new(),
			RDPipelineDepthStencilState.new(),
			blend
		)
	return _draws[format]
