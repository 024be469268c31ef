extends SceneTree
# Prints the time of a frame with a tick for 1, 16 and 64 characters: with their garments, with garments
# that ignore the body, and without garments; and the memory of the garments. With a window it prints
# the time in which the engine takes new vertices, too.
# Start it by engine.sh, or with --fixed-fps of the model's rate.

const MODEL := "res://tshirt.unic"
const FRAMES := 60


func _initialize() -> void:
	run()


func run() -> void:
	await process_frame
	# Memory that was released stays with the process, so that crowds that grow are measured from one start.
	var before := resident_mib()
	for count in [1, 16, 64]:
		var bare := await frame_ms(count, false, false)
		var dressed := await frame_ms(count, true, true)
		print(("%d characters: %.2f ms a frame, %.2f ms without body contact, "
				+ "%.2f ms without garments, %d MiB more than before") % [
				count, dressed, await frame_ms(count, true, false), bare, resident_mib() - before])
	if DisplayServer.get_name() == "headless":
		print("skipped: nothing takes vertices without a window")
	else:
		await take_vertices()
	quit()


# Resident memory of the process, MiB; 0 where the system does not tell it.
func resident_mib() -> float:
	var status := FileAccess.open("/proc/self/status", FileAccess.READ)
	while status != null and not status.eof_reached():
		var line := status.get_line()
		if line.begins_with("VmRSS:"):
			return line.get_slice(":", 1).strip_edges().to_float() / 1024.0
	return 0.0


# Median time of a frame.
func frame_ms(count: int, is_dressed: bool, has_contact: bool) -> float:
	var skeletons: Array[Skeleton3D] = []
	for i in count:
		var skeleton := UnicGarment3D.make_character(MODEL)
		root.add_child(skeleton)
		skeletons.append(skeleton)
		if is_dressed:
			var garment := UnicGarment3D.new()
			garment.model_file = MODEL
			garment.display = 1
			garment.body_contact = has_contact
			skeleton.add_child(garment)
	var times: Array[float] = []
	for frame in FRAMES:
		var start := Time.get_ticks_usec()
		for skeleton in skeletons:
			var hip := skeleton.find_bone("L_hip")
			skeleton.set_bone_pose_rotation(hip, Quaternion(Vector3.RIGHT, 0.3 * sin(frame / 6.0)))
		await process_frame
		times.append((Time.get_ticks_usec() - start) / 1000.0)
	for skeleton in skeletons:
		skeleton.free()
	times.sort()
	return times[FRAMES / 2]


# Replacing a part of the vertex buffer, as the extension does, beside making the surface anew.
func take_vertices() -> void:
	var skeleton := UnicGarment3D.make_character(MODEL)
	root.add_child(skeleton)
	var garment := UnicGarment3D.new()
	garment.model_file = MODEL
	skeleton.add_child(garment)
	for frame in 3:
		await process_frame
	garment.paused = true
	var mesh: ArrayMesh = garment.mesh
	var arrays := mesh.surface_get_arrays(0)
	var bytes: PackedByteArray = RenderingServer.mesh_get_surface(mesh.get_rid(), 0).vertex_data
	var start := Time.get_ticks_usec()
	for i in FRAMES:
		mesh.surface_update_vertex_region(0, 0, bytes)
	var region := (Time.get_ticks_usec() - start) / 1000.0 / FRAMES
	start = Time.get_ticks_usec()
	for i in FRAMES:
		mesh.clear_surfaces()
		mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, arrays)
	var anew := (Time.get_ticks_usec() - start) / 1000.0 / FRAMES
	print("%d vertices: %.3f ms to replace them, %.3f ms to make the surface anew" % [
			arrays[Mesh.ARRAY_VERTEX].size(), region, anew])
