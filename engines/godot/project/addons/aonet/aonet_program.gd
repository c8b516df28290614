@tool
class_name AonetProgram
extends Resource
## What a graphics processor does for a network or a classic method, for frames of any size.
##
## The files in the folder [code]programs[/code] are such resources. docs/program_format.md of aonet describes the list.

const FORMAT := 2

## The list of buffers and dispatches, as JSON.
@export_storage var document := ""
## Weights and shaders.
@export_storage var block := PackedByteArray()

var _parsed: Dictionary


## The list, or an empty one where the resource is not a program of this version.
func list() -> Dictionary:
	if _parsed.is_empty():
		var json := JSON.new()
		# Unlike parse_string, it prints nothing.
		var found: Variant = json.data if json.parse(document) == OK else null
		if found is Dictionary and int(found.get("format", 0)) == FORMAT and found.has("finish"):
			_parsed = found
	return _parsed


## A shader: one stage or two.
func shader(index: int) -> RDShaderSPIRV:
	var spirv := RDShaderSPIRV.new()
	var places: Dictionary = list().shaders[index]
	for stage: String in places:
		spirv.set("bytecode_" + stage, part(places[stage]))
	return spirv


## A part of the block.
func part(place: Dictionary) -> PackedByteArray:
	return block.slice(int(place.offset), int(place.offset) + int(place.bytes))


## The value of a number of the list for frames of a size.
func number(formula: Variant, size: Vector2i) -> int:
	if formula is float or formula is int:
		return int(formula)
	if formula is String:
		match formula:
			"width":
				return size.x
			"height":
				return size.y
			"real_bytes":
				return 2 if list().precision == "f16" else 4
	var operation: String = formula.keys()[0]
	var a := number(formula[operation][0], size)
	var b := number(formula[operation][1], size)
	match operation:
		"add":
			return a + b
		"mul":
			return a * b
		"div_ceil":
			return (a + b - 1) / b
	return maxi(a, b)


## The shader and the workgroups of a pass for frames of a size.
func variant(variants: Array, size: Vector2i) -> Dictionary:
	var chosen := {}
	for each: Dictionary in variants:
		var groups := Vector3i.ZERO
		for axis in 3:
			groups[axis] = number(each.workgroups[axis], size)
		chosen = {"shader": int(each.shader), "groups": groups}
		if groups.x * groups.y * groups.z >= int(list().enough_workgroups):
			break
	return chosen
