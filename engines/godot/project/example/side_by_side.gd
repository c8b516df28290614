extends Control
## One scene three times: without ambient occlusion, with Godot's own, with aonet.
##
## Keys 1 to 4 choose the method, up and down the radius, left and right the intensity; space stops the turning.
## "-- --screenshot FILE.png" behind Godot's own arguments draws one picture and ends.

const PROGRAMS := ["agtao", "fast", "balanced", "high"]
const RADIUS := 1.0

var angle := 0.42
var is_turning := true
var cameras: Array[Camera3D] = []
var effect := AonetEffect.new()


func _ready() -> void:
	effect.program = load_program("balanced")
	effect.radius = RADIUS
	for which in 3:
		var container := SubViewportContainer.new()
		container.stretch = true
		container.anchor_left = which / 3.0
		container.anchor_right = (which + 1) / 3.0
		container.anchor_bottom = 1.0
		var viewport := SubViewport.new()
		viewport.screen_space_aa = Viewport.SCREEN_SPACE_AA_FXAA
		var camera := Camera3D.new()
		camera.fov = 40.0
		camera.near = 0.1
		camera.far = 60.0
		camera.environment = daylight()
		cameras.append(camera)
		viewport.add_child(camera)
		container.add_child(viewport)
		add_child(container)
	cameras[1].environment.ssao_enabled = true
	cameras[1].environment.ssao_radius = RADIUS
	cameras[2].compositor = Compositor.new()
	cameras[2].compositor.compositor_effects = [effect]
	build(self)
	var arguments := OS.get_cmdline_user_args()
	if arguments.size() == 2 and arguments[0] == "--screenshot":
		is_turning = false
		place()
		for i in 8:
			await RenderingServer.frame_post_draw
		get_viewport().get_texture().get_image().save_png(arguments[1])
		get_tree().quit()


func _process(seconds: float) -> void:
	if is_turning:
		angle += 0.2 * seconds
	place()


func _unhandled_key_input(event: InputEvent) -> void:
	var key := event as InputEventKey
	if not key.pressed:
		return
	match key.keycode:
		KEY_1, KEY_2, KEY_3, KEY_4:
			effect.program = load_program(PROGRAMS[key.keycode - KEY_1])
		KEY_UP:
			effect.radius *= 1.1
		KEY_DOWN:
			effect.radius /= 1.1
		KEY_RIGHT:
			effect.intensity *= 1.1
		KEY_LEFT:
			effect.intensity /= 1.1
		KEY_SPACE:
			is_turning = not is_turning


func load_program(which: String) -> AonetProgram:
	return load("res://addons/aonet/programs/%s.tres" % which)


func place() -> void:
	for camera in cameras:
		var eye := Vector3(sin(angle) * 7.6, 3.4, cos(angle) * 7.6)
		camera.look_at_from_position(eye, Vector3(0.35, 0.85, 0))


func daylight() -> Environment:
	var environment := Environment.new()
	environment.background_mode = Environment.BG_COLOR
	environment.background_color = Color(0.75, 0.8, 0.85)
	environment.ambient_light_source = Environment.AMBIENT_SOURCE_COLOR
	environment.ambient_light_color = Color.WHITE
	environment.ambient_light_energy = 0.75
	return environment


func build(parent: Node) -> void:
	var sun := DirectionalLight3D.new()
	sun.light_energy = 0.35
	sun.rotation = Vector3(-0.9, 0.6, 0.0)
	parent.add_child(sun)
	add_box(parent, Vector3(0, -0.25, 0), Vector3(14, 0.5, 14))
	for step in 6:
		add_box(parent, Vector3(-1.9, 0.15 + 0.3 * step, 1.2 - 0.45 * step), Vector3(1.3, 0.3, 0.45))
		add_box(parent, Vector3(-1.9, 0.15 * step, 1.2 - 0.45 * step), Vector3(1.3, 0.3 * step, 0.45))
	add_box(parent, Vector3(0.2, 1.4, -2.2), Vector3(6.4, 2.8, 0.3))
	for column in 4:
		var cylinder := CylinderMesh.new()
		cylinder.top_radius = 0.16
		cylinder.bottom_radius = 0.16
		cylinder.height = 2.2
		add_mesh(parent, cylinder, Vector3(-0.6 + 0.9 * column, 1.1, -1.4))
	add_box(parent, Vector3(0.75, 2.3, -1.4), Vector3(3.4, 0.2, 0.6))
	for ball in 3:
		var sphere := SphereMesh.new()
		sphere.radius = 0.3 + 0.12 * ball
		sphere.height = 2.0 * sphere.radius
		add_mesh(parent, sphere, Vector3(0.1 + 0.85 * ball, sphere.radius, 0.2 + 0.25 * ball))
	var torus := TorusMesh.new()
	torus.inner_radius = 0.3
	torus.outer_radius = 0.7
	add_mesh(parent, torus, Vector3(0.3, 0.2, 1.7))
	add_box(parent, Vector3(2.3, 0.5, -0.6), Vector3(0.9, 1.0, 0.7))
	add_box(parent, Vector3(2.4, 1.2, -0.6), Vector3(0.5, 0.4, 0.4))


func add_box(parent: Node, centre: Vector3, size: Vector3) -> void:
	var box := BoxMesh.new()
	box.size = size
	add_mesh(parent, box, centre)


func add_mesh(parent: Node, mesh: PrimitiveMesh, place_of_mesh: Vector3) -> void:
	var material := StandardMaterial3D.new()
	material.albedo_color = Color(0.85, 0.82, 0.76)
	material.roughness = 1.0
	material.metallic_specular = 0.1
	mesh.material = material
	var instance := MeshInstance3D.new()
	instance.mesh = mesh
	instance.position = place_of_mesh
	parent.add_child(instance)
