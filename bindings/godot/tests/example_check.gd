extends SceneTree
# Contract: the example project shows a garment that moves with its character, without a fault.
# engine.sh puts this script beside the project.

const FRAMES := 60


func _initialize() -> void:
	run()


func run() -> void:
	change_scene_to_file("res://main.tscn")
	await process_frame
	await process_frame
	var shirt: UnicGarment3D = current_scene.get_node("Shirt")
	var first := PackedVector3Array()
	for frame in FRAMES:
		await process_frame
		if first.is_empty():
			first = shirt.vertices()
	var last := shirt.vertices()
	var farthest := 0.0
	for vertex in first.size():
		farthest = maxf(farthest, first[vertex].distance_to(last[vertex]))
	var moves := farthest > 1e-3 and farthest < 1.0
	print("%s: the example, %d vertices that move by up to %.3f m, fault: \"%s\"" % [
			"ok" if moves and shirt.fault() == "" else "FAILED", last.size(), farthest, shirt.fault()])
	quit(0 if moves and shirt.fault() == "" else 1)
