@tool
class_name AonetEffect
extends CompositorEffect
## Ambient occlusion learned from traced rays in one noise-free frame, for the Forward+ renderer.
##
## Add it to the effects of a [Compositor]. It takes the place of the environment's own ambient occlusion, which stays off: materials
## darken ambient light by it, as they do by Godot's own. The debug view [constant Viewport.DEBUG_DRAW_SSAO] shows it.

## Where the materials read visibility.
const CONTEXT := &"rb_ssao"
const FINAL := &"final"
## Visibility before [member intensity], in 16-bit floats, for effects of your own: 1 open, 0 closed.
const OWN := &"aonet"
const VISIBILITY := &"visibility"

## The network or classic method: a file of the folder [code]programs[/code].
@export var program: AonetProgram = null:
	set(value):
		_mutex.lock()
		program = value
		_stale = true
		_mutex.unlock()
## How far away a surface may be to occlude, in world units.
@export_range(0.01, 100.0, 0.01, "or_greater", "exp") var radius := 1.0
## Power of visibility.
@export_range(0.1, 4.0, 0.01, "or_greater") var intensity := 1.0
## How much direct light is darkened, too.
@export_range(0.0, 1.0, 0.01) var light_affect := 0.0
## How much it darkens light where a material has an occlusion map of its own.
@export_range(0.0, 1.0, 0.01) var ao_channel_affect := 0.0

var _session: AonetSession
var _stale := true
var _mutex := Mutex.new()
## Sentences that were printed already.
var _said: Dictionary[String, bool]


func _init() -> void:
	effect_callback_type = EFFECT_CALLBACK_TYPE_PRE_OPAQUE
	needs_normal_roughness = true
	access_resolved_depth = true


func _validate_property(property: Dictionary) -> void:
	# They are what this effect needs.
	var fixed := ["effect_callback_type", "needs_normal_roughness", "access_resolved_depth"]
	if property.name in fixed:
		property.usage = PROPERTY_USAGE_NONE


func _render_callback(type: int, data: RenderData) -> void:
	if type == EFFECT_CALLBACK_TYPE_PRE_OPAQUE:
		if _before_opaque(data):
			# Godot has decided already that its own search does not run. From now on its materials read the texture.
			_switch(data, true)
			RenderingServer.compositor_effect_set_callback(
				get_rid(), RenderingServer.COMPOSITOR_EFFECT_CALLBACK_TYPE_POST_OPAQUE, _render_callback
			)
	else:
		_switch(data, false)
		RenderingServer.compositor_effect_set_callback(
			get_rid(), RenderingServer.COMPOSITOR_EFFECT_CALLBACK_TYPE_PRE_OPAQUE, _render_callback
		)


## Whether the environment has ambient occlusion. Only the last two numbers matter: the others are of Godot's own search.
func _switch(data: RenderData, on: bool) -> void:
	var environment := data.get_environment()
	RenderingServer.environment_set_ssao(environment, on, 1, 2, 1.5, 0.5, 0.06, 0.98, light_affect, ao_channel_affect)


func _before_opaque(data: RenderData) -> bool:
	var buffers := data.get_render_scene_buffers() as RenderSceneBuffersRD
	var scene := data.get_render_scene_data()
	if buffers == null or scene == null or not _ready_to_run(data, buffers):
		return false
	var size := buffers.get_internal_size()
	if not _session.prepare(size):
		return _complain("%dx%d: expected shaders and memory that the device gives, found the error above" % [size.x, size.y])
	var views := buffers.get_view_count()
	_texture(buffers, OWN, VISIBILITY, RenderingDevice.DATA_FORMAT_R16_SFLOAT, RenderingDevice.TEXTURE_USAGE_COLOR_ATTACHMENT_BIT)
	_texture(buffers, CONTEXT, FINAL, RenderingDevice.DATA_FORMAT_R8_UNORM, RenderingDevice.TEXTURE_USAGE_STORAGE_BIT)
	for view in views:
		var textures := {
			"depth": buffers.get_depth_layer(view),
			"normals": buffers.get_texture_slice(&"forward_clustered", &"normal_roughness", view, 0, 1, 1),
			"raw": buffers.get_texture_slice(OWN, VISIBILITY, view, 0, 1, 1),
			"result": buffers.get_texture_slice(CONTEXT, FINAL, view, 0, 1, 1),
		}
		_session.encode(size, frame_bytes(scene.get_view_projection(view), size, radius), textures, intensity)
	return true


## Whether there is all that it needs; says so where there is not.
func _ready_to_run(data: RenderData, buffers: RenderSceneBuffersRD) -> bool:
	_mutex.lock()
	var of_now := program
	if _stale:
		_stale = false
		_session = null
		if of_now != null and not of_now.list().is_empty():
			_session = AonetSession.new(RenderingServer.get_rendering_device(), of_now)
	_mutex.unlock()
	if of_now == null:
		return _complain("program: expected a file of addons/aonet/programs, found none")
	if _session == null:
		return _complain("program: expected one of this version, found another: run engines/godot/build again")
	if not (radius > 0.0 and is_finite(radius)):
		return _complain("radius: expected a finite length above 0, found %f" % radius)
	if not (intensity > 0.0 and is_finite(intensity)):
		return _complain("intensity: expected a finite number above 0, found %f" % intensity)
	if not data.get_environment().is_valid():
		return _complain("environment: expected one (WorldEnvironment, or of the camera), found none")
	if not buffers.has_texture(&"forward_clustered", &"normal_roughness"):
		return _complain("normals: expected those of the renderer Forward+, found none")
	return true


func _complain(sentence: String) -> bool:
	if not _said.has(sentence):
		_said[sentence] = true
		push_error("aonet: " + sentence)
	return false


static func _texture(
	buffers: RenderSceneBuffersRD, context: StringName, name: StringName, format: RenderingDevice.DataFormat, usage: int
) -> void:
	if not buffers.has_texture(context, name):
		usage |= RenderingDevice.TEXTURE_USAGE_SAMPLING_BIT | RenderingDevice.TEXTURE_USAGE_CAN_COPY_FROM_BIT
		var samples := RenderingDevice.TEXTURE_SAMPLES_1
		buffers.create_texture(context, name, format, usage, samples, buffers.get_internal_size(), 0, 1, true, false)


## The numbers of a frame: see "The frame" in docs/program_format.md of aonet.
static func frame_bytes(projection: Projection, size: Vector2i, length: float) -> PackedByteArray:
	var bytes := PackedByteArray()
	bytes.resize(AonetSession.FRAME_BYTES)
	for i in 3:
		bytes.encode_float(20 * i, 1.0)  # Normals are in view space already.
	var perspective := projection.z.w != 0.0
	# Projections as shaders see them look down: rows of pixels begin at the top.
	var up := 1.0 if projection.y.y > 0.0 else -1.0
	var focal := 0.5 * Vector2(size) * Vector2(projection.x.x, projection.y.y * up)
	var axis := Vector2(projection.w.x, projection.w.y)
	if perspective:
		axis = -Vector2(projection.z.x, projection.z.y)
	var centre := 0.5 * Vector2(size) * Vector2(1.0 + axis.x, 1.0 - axis.y * up)
	var line := _depth_line(projection, perspective)
	var pixel := Vector2(1.0 / focal.y, 0.0) if perspective else Vector2(0.0, 1.0 / focal.y)
	bytes.encode_u32(48, size.x)
	bytes.encode_u32(52, size.y)
	var floats := [line.x, line.y, pixel.x, pixel.y, centre.x, centre.y, focal.y / focal.x, length]
	floats.append(log(length * focal.y) / log(2.0))
	for i in floats.size():
		bytes.encode_float(56 + 4 * i, floats[i])
	return bytes


## Slope and offset that make 1 / distance, or with a parallel projection the distance, of a stored depth.
static func _depth_line(projection: Projection, perspective: bool) -> Vector2:
	var scale := projection.z.z
	var offset := projection.w.z
	if projection.y.y > 0.0:
		# As cameras have it: -1 near and 1 far. Stored is 1 near and 0 far.
		scale *= -0.5
		offset *= -0.5
		if perspective:
			scale -= 0.5
		else:
			offset += 0.5
	# Perspective: stored = offset / distance - scale. Parallel: stored = offset - scale * distance.
	return Vector2(1.0 / offset, scale / offset) if perspective else Vector2(-1.0 / scale, offset / scale)
