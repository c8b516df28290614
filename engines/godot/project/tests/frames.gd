extends Node3D
## Draws a scene of boxes with every program and kind of camera, and writes visibility into the folder that follows "--" on the
## command line, where ../../tests/frames.rs compares it with the CPU's.

## Centre and half of the sides: those of ../../../bevy/tests/common/boxes.rs.
const BOXES := [
	[Vector3(0, -0.5, 0), Vector3(6, 0.5, 6)],
	[Vector3(0, 1.5, -3), Vector3(6, 1.5, 0.25)],
	[Vector3(-1.4, 0.5, -1.2), Vector3(0.5, 0.5, 0.5)],
	[Vector3(0.2, 0.9, -1.9), Vector3(0.4, 0.9, 0.4)],
	[Vector3(1.5, 0.3, -0.4), Vector3(0.6, 0.3, 0.4)],
	[Vector3(0.4, 0.15, 0.6), Vector3(0.9, 0.15, 0.2)],
]
const TARGET := Vector3(0, 0.5, -1)
const SIZE := Vector2i(160, 90)
## Godot draws the first frames without some pipelines.
const SETTLED := 4

var folder := OS.get_cmdline_user_args()[0]
var environment := Environment.new()


func _ready() -> void:
	environment.background_mode = Environment.BG_COLOR
	environment.background_color = Color.WHITE
	environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	environment.ambient_light_color = Color.WHITE
	environment.ambient_light_energy = 0.8
	var material := StandardMaterial3D.new()
	material.roughness = 1.0
	material.metallic_specular = 0.0
	for each: Array in BOXES:
		var mesh := BoxMesh.new()
		mesh.size = 2.0 * each[1]
		mesh.material = material
		var instance := MeshInstance3D.new()
		instance.mesh = mesh
		instance.position = each[0]
		add_child(instance)
	await _programs()
	await _cameras()
	await _viewports()
	await _settings()
	await _mistakes()
	await _readme()
	get_tree().quit()


static func load_program(which: String) -> AonetProgram:
	return load("res://addons/aonet/programs/%s.tres" % which)


func new_probe(which: String) -> Probe:
	var probe := Probe.new()
	probe.program = load_program(which)
	return probe


func new_camera(effect: CompositorEffect) -> Camera3D:
	var camera := Camera3D.new()
	camera.fov = rad_to_deg(0.9)
	camera.near = 0.1
	camera.far = 30.0
	camera.look_at_from_position(Vector3(1.6, 2.2, 3.4), TARGET)
	camera.environment = environment
	if effect != null:
		camera.compositor = Compositor.new()
		camera.compositor.compositor_effects = [effect]
	return camera


## A viewport that draws what a camera sees.
func new_viewport(camera: Camera3D, size := SIZE) -> SubViewport:
	var viewport := SubViewport.new()
	viewport.size = size
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	viewport.add_child(camera)
	add_child(viewport)
	return viewport


func frames(count := SETTLED) -> void:
	for i in count:
		await RenderingServer.frame_post_draw


func write(file: String, bytes: PackedByteArray) -> void:
	FileAccess.open(folder.path_join(file), FileAccess.WRITE).store_buffer(bytes)
	print("wrote ", file)


## Writes the visibility of the last frame.
func write_visibility(file: String, probe: Probe, size := SIZE) -> void:
	assert(not probe.stock_ran(size), "Godot's own search ran")
	write(file + ".r16", probe.read(size, &"aonet", &"visibility"))


## The numbers of a frame by the projection that cameras have, and by that which shaders see. Versions of Godot differ in which of
## them effects get.
func both_numbers(camera: Camera3D, probe: Probe) -> PackedByteArray:
	var of_camera := AonetEffect.frame_bytes(camera.get_camera_projection(), SIZE, 1.0)
	return of_camera + AonetEffect.frame_bytes(probe.projection, SIZE, 1.0)


func _programs() -> void:
	for which: String in ["fast", "balanced", "high", "agtao", "balanced_f16"]:
		var probe := new_probe(which)
		var viewport := new_viewport(new_camera(probe))
		await frames()
		write_visibility(which, probe)
		viewport.free()


func _cameras() -> void:
	var probe := new_probe("agtao")
	var camera := new_camera(probe)
	var viewport := new_viewport(camera)
	await frames()
	var numbers := both_numbers(camera, probe)
	camera.set_orthogonal(5.0, 0.1, 30.0)
	await frames()
	write_visibility("orthographic", probe)
	numbers += both_numbers(camera, probe)
	# The near plane is 0.1 high; the camera's axis meets it below and left of its centre.
	camera.set_frustum(0.1, Vector2(0.03, 0.02), 0.1, 30.0)
	await frames()
	write_visibility("off_centre", probe)
	numbers += both_numbers(camera, probe)
	write("numbers.bin", numbers)
	camera.set_perspective(rad_to_deg(0.9), 0.1, 30.0)
	viewport.size = Vector2i(200, 120)
	await frames()
	write_visibility("resized", probe, viewport.size)
	viewport.size = SIZE
	viewport.msaa_3d = Viewport.MSAA_4X
	await frames()
	write_visibility("multisampled", probe)
	viewport.free()


## Two viewports share an effect and an environment.
func _viewports() -> void:
	var probe := new_probe("agtao")
	var left := new_viewport(new_camera(probe))
	var turned := new_camera(probe)
	turned.look_at_from_position(Vector3(-1.5, 2, 3), TARGET)
	var right := new_viewport(turned, Vector2i(120, 90))
	await frames()
	write_visibility("left", probe)
	write_visibility("right", probe, right.size)
	left.free()
	right.free()


## The texture of the materials and the picture.
func _settings() -> void:
	var probe := new_probe("agtao")
	var viewport := new_viewport(new_camera(probe))
	viewport.use_hdr_2d = true
	await frames()
	write("lit.rgb16", viewport.get_texture().get_image().get_data())
	write("lit.r8", probe.read(SIZE, &"rb_ssao", &"final"))
	probe.intensity = 2.0
	await frames()
	write("intense.r8", probe.read(SIZE, &"rb_ssao", &"final"))
	probe.radius = 0.6
	probe.intensity = 1.0
	await frames()
	write_visibility("near", probe)
	probe.enabled = false
	await frames()
	write("off.rgb16", viewport.get_texture().get_image().get_data())
	# The environment's own is off before, and works again afterwards.
	environment.ssao_enabled = true
	await frames()
	write("stock.rgb16", viewport.get_texture().get_image().get_data())
	assert(probe.stock_ran(SIZE), "Godot's own search did not run")
	environment.ssao_enabled = false
	viewport.free()


## Each is an error on the console, and the picture has no ambient occlusion.
func _mistakes() -> void:
	var probe := new_probe("agtao")
	var camera := new_camera(probe)
	var viewport := new_viewport(camera)
	viewport.use_hdr_2d = true
	probe.radius = 0.0
	await frames()
	write("no_radius.rgb16", viewport.get_texture().get_image().get_data())
	probe.radius = 1.0
	probe.program = null
	await frames()
	write("no_program.rgb16", viewport.get_texture().get_image().get_data())
	probe.program = AonetProgram.new()
	await frames()
	write("no_list.rgb16", viewport.get_texture().get_image().get_data())
	probe.program = load_program("agtao")
	camera.environment = null
	await frames()
	camera.environment = environment
	await frames()
	write_visibility("mended", probe)
	# From here on Godot prints errors of its own.
	var broken: AonetProgram = load_program("agtao").duplicate()
	broken.block.fill(0)
	probe.program = broken
	await frames()
	write("no_shaders.rgb16", viewport.get_texture().get_image().get_data())
	viewport.free()


## What the README says to write, on a camera without environment and effects of its own.
func _readme() -> void:
	var world := WorldEnvironment.new()
	world.environment = environment
	world.set_script(load("res://readme.gd"))
	add_child(world)
	var camera := new_camera(null)
	camera.environment = null
	var viewport := new_viewport(camera)
	viewport.use_hdr_2d = true
	await frames()
	write("readme.rgb16", viewport.get_texture().get_image().get_data())
	viewport.free()
