extends SceneTree
# Contract: in a running engine a garment is where unic-core puts it for the same motion (99 of 100
# vertices within 0.01 mm, all within 1 mm), modifiers of the skeleton included. States, teleports and
# faults are as the page of the extension says.

const MODEL := "res://tshirt.unic"
const MOST_M := 1e-5
const LARGEST_M := 1e-3

var motion: Dictionary
var expected: PackedFloat32Array
var failures := 0


func _initialize() -> void:
	motion = JSON.parse_string(FileAccess.get_file_as_string("res://motion.json"))
	expected = FileAccess.get_file_as_bytes("res://expected.bin").to_float32_array()
	run()


func run() -> void:
	await process_frame
	await follows()
	await follows_modifiers()
	await fits_a_larger_character()
	await fits_a_rig_in_centimetres()
	await refuses_scales()
	await goes_on_from_a_state()
	await teleports_and_pauses()
	await says_what_does_not_fit()
	await dresses_its_own_character()
	await shows_what_it_says()
	print("%d failed" % failures)
	quit(1 if failures > 0 else 0)


func check(is_right: bool, what: String) -> void:
	print("%s: %s" % ["ok" if is_right else "FAILED", what])
	if not is_right:
		failures += 1


func make_skeleton() -> Skeleton3D:
	var skeleton := Skeleton3D.new()
	for joint in motion.names.size():
		skeleton.add_bone(motion.names[joint])
	for joint in motion.names.size():
		if motion.parents[joint] >= 0:
			skeleton.set_bone_parent(joint, int(motion.parents[joint]))
		var n: Array = motion.rests[joint]
		var basis := Basis(Quaternion(n[0], n[1], n[2], n[3]))
		skeleton.set_bone_rest(joint, Transform3D(basis, Vector3(n[4], n[5], n[6])))
	skeleton.reset_bone_poses()
	root.add_child(skeleton)
	return skeleton


func make_garment(skeleton: Skeleton3D) -> UnicGarment3D:
	var garment := UnicGarment3D.new()
	garment.model_file = MODEL
	garment.display = 1
	garment.character = NodePath("../" + skeleton.name)
	root.add_child(garment)
	return garment


func root_bone() -> int:
	return motion.parents.find(-1.0)


func place(frame: int) -> Vector3:
	var n: Array = motion.places[frame]
	return Vector3(n[0], n[1], n[2])


func pose(skeleton: Skeleton3D, frame: int, root_place: Vector3) -> void:
	skeleton.set_bone_pose_position(root_bone(), root_place)
	for joint in motion.names.size():
		var n: Array = motion.rotations[frame][joint]
		skeleton.set_bone_pose_rotation(joint, Quaternion(n[0], n[1], n[2], n[3]))


# Distances from the expected vertices of a frame, sorted, metres.
func distances(garment: UnicGarment3D, frame: int, offset := Vector3.ZERO, size := 1.0) -> PackedFloat32Array:
	var vertices := garment.vertices()
	var far := PackedFloat32Array()
	var first := frame * vertices.size() * 3
	for vertex in vertices.size():
		var at := first + 3 * vertex
		var place_there := Vector3(expected[at], expected[at + 1], expected[at + 2])
		far.append(vertices[vertex].distance_to(size * place_there + offset))
	far.sort()
	return far


func follow(name: String, frames: int, skeleton: Skeleton3D, poser: Callable) -> void:
	var garment := make_garment(skeleton)
	var most := 0.0
	var largest := 0.0
	for frame in frames:
		poser.call(frame)
		await process_frame
		var far := distances(garment, frame)
		if far.size() != int(motion.vertices):
			check(false, "%s, frame %d: %d vertices" % [name, frame, far.size()])
			break
		most = maxf(most, far[far.size() * 99 / 100])
		largest = maxf(largest, far[-1])
	check(most < MOST_M and largest < LARGEST_M and garment.fault() == "",
			"%s: %d frames, 99 %% within %.6f m, all within %.6f m" % [name, frames, most, largest])
	garment.free()
	skeleton.free()


func follows() -> void:
	var skeleton := make_skeleton()
	skeleton.position = Vector3(3, 0, -2)
	await follow("a skeleton", int(motion.frames), skeleton, func(frame: int) -> void:
		pose(skeleton, frame, place(frame) - skeleton.position))


func follows_modifiers() -> void:
	if not ClassDB.class_exists("SkeletonModifier3D"):
		print("skipped: the engine is older than SkeletonModifier3D")
		return
	var skeleton := make_skeleton()
	var modifier: Node = load("res://lift.gd").new()
	modifier.bone = root_bone()
	skeleton.add_child(modifier)
	await follow("a modifier", 30, skeleton, func(frame: int) -> void:
		modifier.offset = Vector3(place(frame).x, 0, place(frame).z)
		pose(skeleton, frame, Vector3(0, place(frame).y, 0)))


func fits_a_larger_character() -> void:
	var skeleton := make_skeleton()
	skeleton.scale = Vector3(1.5, 1.5, 1.5)
	var garment := make_garment(skeleton)
	for frame in 20:
		pose(skeleton, frame, place(frame))
		await process_frame
	var far := distances(garment, 19, Vector3.ZERO, 1.5)
	check(far[far.size() * 99 / 100] < MOST_M and absf(garment.scale.x - 1.5) < 1e-3,
			"a character of 1.5 times the size: 99 %% within %.6f m" % far[far.size() * 99 / 100])
	garment.free()
	skeleton.free()


func fits_a_rig_in_centimetres() -> void:
	var skeleton := make_skeleton()
	skeleton.scale = Vector3(0.01, 0.01, 0.01)
	var garment := make_garment(skeleton)
	for frame in 5:
		pose(skeleton, frame, place(frame))
		await process_frame
	var far := distances(garment, 4, Vector3.ZERO, 0.01)
	check(garment.fault() == "" and far[-1] < LARGEST_M * 0.01 and absf(garment.scale.x - 0.01) < 1e-5,
			"a character scaled by 0.01: %s" % garment.fault())
	garment.free()
	skeleton.free()


func refuses_scales() -> void:
	for scale in [Vector3.ZERO, Vector3(-1, 1, 1), Vector3(1, 1, 0.5)]:
		var skeleton := make_skeleton()
		skeleton.scale = scale
		var garment := make_garment(skeleton)
		for frame in 3:
			pose(skeleton, frame, place(frame))
			await process_frame
		check("expected one positive scale along all axes" in garment.fault(),
				"a character scaled by %s: %s" % [scale, garment.fault()])
		skeleton.scale = Vector3.ONE
		garment.restart()
		await process_frame
		check(garment.fault() == "" and garment.vertices().size() > 0, "it goes on afterwards")
		garment.free()
		skeleton.free()


func goes_on_from_a_state() -> void:
	var skeleton := make_skeleton()
	var garment := make_garment(skeleton)
	check(garment.save_state().is_empty(), "no state before the first frame")
	for frame in 10:
		pose(skeleton, frame, place(frame))
		await process_frame
	var saved := garment.save_state()
	garment.free()
	garment = make_garment(skeleton)
	check(garment.restore_state(saved), "a state fits another garment of the model")
	pose(skeleton, 10, place(10))
	await process_frame
	var far := distances(garment, 10)
	check(far[far.size() * 99 / 100] < MOST_M, "a restored state goes on: %.6f m" % far[-1])
	saved[saved.size() - 1] ^= 1
	check(not garment.restore_state(saved), "a damaged state is refused")
	garment.free()
	skeleton.free()


func teleports_and_pauses() -> void:
	var skeleton := make_skeleton()
	var garment := make_garment(skeleton)
	for frame in 10:
		pose(skeleton, frame, place(frame))
		await process_frame
	var jump := Vector3(50, 0, 0)
	pose(skeleton, 9, place(9) + jump)
	await process_frame
	var kept := distances(garment, 9, jump)
	check(kept[-1] < LARGEST_M, "a teleport keeps the shape: %.6f m" % kept[-1])
	garment.paused = true
	var shown := garment.vertices()
	pose(skeleton, 0, place(0))
	await process_frame
	check(garment.vertices() == shown, "a paused garment stays")
	garment.paused = false
	await process_frame
	var far := distances(garment, 0)
	check(far[far.size() * 99 / 100] < MOST_M, "it starts anew afterwards: %.6f m" % far[-1])
	garment.free()
	skeleton.free()


func says_what_does_not_fit() -> void:
	var skeleton := make_skeleton()
	skeleton.set_bone_name(skeleton.find_bone("L_elbow"), "lower arm")
	var garment := make_garment(skeleton)
	var reasons := []
	garment.faulted.connect(func(reason: String) -> void:
		reasons.append(reason)
		check(garment.fault() == reason, "a handler reads the fault"))
	for frame in 3:
		await process_frame
	check(reasons.size() == 1 and "expected the joints L_elbow, found none" in reasons[0],
			"a rig that does not fit is said once: %s" % [reasons])
	skeleton.set_bone_name(skeleton.find_bone("lower arm"), "rig_l_ELBOW")
	garment.restart()
	await process_frame
	check(reasons.size() == 2, "one bone has no namespace of its own")
	skeleton.set_bone_name(skeleton.find_bone("rig_l_ELBOW"), "l_ELBOW")
	garment.restart()
	await process_frame
	check(garment.fault() == "" and garment.vertices().size() > 0, "a restart tries again")
	garment.model_file = "res://absent.unic"
	await process_frame
	check("absent.unic" in garment.fault(), "a missing model is said: %s" % garment.fault())
	garment.model_file = MODEL
	skeleton.free()
	await process_frame
	check("expected a Skeleton3D" in garment.fault(), "so is a missing skeleton: %s" % garment.fault())
	garment.free()


func dresses_its_own_character() -> void:
	var skeleton := UnicGarment3D.make_character(MODEL)
	root.add_child(skeleton)
	check(skeleton.get_bone_count() == motion.names.size(), "a character with the model's joints")
	check(skeleton.get_node("Body").mesh.get_surface_count() == 1, "and a body")
	var garment := UnicGarment3D.new()
	garment.model_file = MODEL
	garment.sampling = 0.5
	# The parent, as by default.
	skeleton.add_child(garment)
	for frame in 3:
		await process_frame
	check(garment.fault() == "" and garment.tick_rate() == motion.fps, "wears the garment")
	skeleton.free()
	check(UnicGarment3D.make_character("res://test.gd") == null, "other files are no character")


func shows_what_it_says() -> void:
	if DisplayServer.get_name() == "headless":
		print("skipped: without a window nothing holds vertex buffers")
		return
	var skeleton := make_skeleton()
	var garment := make_garment(skeleton)
	for frame in 3:
		pose(skeleton, frame, place(frame))
		await process_frame
	var arrays: Array = garment.mesh.surface_get_arrays(0)
	var vertices := garment.vertices()
	var farthest := 0.0
	for vertex in vertices.size():
		farthest = maxf(farthest, vertices[vertex].distance_to(arrays[Mesh.ARRAY_VERTEX][vertex]))
	check(farthest < MOST_M, "the vertex buffer holds the vertices: %.6f m" % farthest)
	# Beside normals that are computed from the triangles of the buffer.
	var tool := SurfaceTool.new()
	tool.create_from(garment.mesh, 0)
	var bare := tool.commit_to_arrays()
	bare[Mesh.ARRAY_TEX_UV] = null
	bare[Mesh.ARRAY_NORMAL] = null
	bare[Mesh.ARRAY_TANGENT] = null
	tool.create_from_arrays(bare)
	tool.generate_normals()
	var normals: PackedVector3Array = tool.commit_to_arrays()[Mesh.ARRAY_NORMAL]
	var near := 0
	for vertex in vertices.size():
		if normals[vertex].dot(arrays[Mesh.ARRAY_NORMAL][vertex]) > 0.8:
			near += 1
	check(near > 0.9 * vertices.size(),
			"%d of %d normals are near those of the triangles" % [near, vertices.size()])
	check(garment.custom_aabb.grow(1e-3).encloses(bounds(vertices)), "the box is around them")
	garment.free()
	skeleton.free()


func bounds(vertices: PackedVector3Array) -> AABB:
	var box := AABB(vertices[0], Vector3.ZERO)
	for vertex in vertices:
		box = box.expand(vertex)
	return box
