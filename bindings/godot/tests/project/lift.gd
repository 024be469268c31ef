extends SkeletonModifier3D
# Moves the root, as inverse kinematics move limbs: after all animation, and for the picture alone.

var bone := 0
var offset := Vector3.ZERO


func _process_modification() -> void:
	var skeleton := get_skeleton()
	skeleton.set_bone_pose_position(bone, skeleton.get_bone_pose_position(bone) + offset)
