class_name Probe
extends AonetEffect
## An effect that remembers the textures of the last frame, by their size.

var buffers: Dictionary[Vector2i, RenderSceneBuffersRD]
var projection: Projection


func _before_opaque(data: RenderData) -> bool:
	var found: RenderSceneBuffersRD = data.get_render_scene_buffers()
	buffers[found.get_internal_size()] = found
	projection = data.get_render_scene_data().get_view_projection(0)
	return super(data)


## Texels of a texture of the last frame.
func read(size: Vector2i, context: StringName, name: StringName) -> PackedByteArray:
	return RenderingServer.get_rendering_device().texture_get_data(buffers[size].get_texture(context, name), 0)


## Whether Godot's own search has run.
func stock_ran(size: Vector2i) -> bool:
	return buffers[size].has_texture(&"rb_ssao", &"deinterleaved")
