extends Node3D
# A character, made from the model of its T-shirt, walks on the spot.

const SWINGS := {"L_hip": 0.4, "R_hip": -0.4, "L_shoulder": -0.3, "R_shoulder": 0.3}

var character: Skeleton3D
var seconds := 0.0


func _ready() -> void:
	character = UnicGarment3D.make_character($Shirt.model_file)
	character.name = "Character"
	add_child(character)


func _process(delta: float) -> void:
	seconds += delta
	var swing := sin(5.0 * seconds)
	for name in SWINGS:
		turn(name, Vector3.RIGHT, SWINGS[name] * swing)
	turn("spine1", Vector3.UP, 0.3 * cos(5.0 * seconds))


# Turns a bone from its rest.
func turn(name: String, axis: Vector3, angle: float) -> void:
	var bone := character.find_bone(name)
	var rest := character.get_bone_rest(bone).basis.get_rotation_quaternion()
	character.set_bone_pose_rotation(bone, Quaternion(axis, angle) * rest)
