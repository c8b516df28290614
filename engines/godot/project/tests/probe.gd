class_name Probe
extends AonetEffect
## An effect that remembers the textures of the last frame.

var buffers: RenderSceneBuffersRD
var projection: Projection


func _before_opaque(data: RenderData) -> bool:
	buffers = data.get_render_scene_buffers()
	projection = data.get_render_scene_data().get_view_projection(0)
	return super(data)


## Texels of a texture of the last frame.
func read(context: StringName, name: StringName) -> PackedByteArray:
	return RenderingServer.get_rendering_device().texture_get_data(buffers.get_texture(context, name), 0)


## Whether Godot's own search has run.
func stock_ran() -> bool:
	return buffers.has_texture(&"rb_ssao", &"deinterleaved")
