// Skins the body into the pose of the tick.

// Positions and normals of the body, world space.
@group(0) @binding(9) var<storage, read_write> shown: array<f32>;

@compute @workgroup_size(64)
fn pose(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let world = skinned(vertices[i]);
    shown[6u * i] = world.x;
    shown[6u * i + 1u] = world.y;
    shown[6u * i + 2u] = world.z;
}
