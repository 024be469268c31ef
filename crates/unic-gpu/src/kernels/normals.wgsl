// Computes unit normals of vertices, weighted by area; zero for a vertex without sound faces.

override VERTICES: u32;

// The corners that follow vertex i in the faces around it are `corners[starts[i]..starts[i + 1]]`.
@group(0) @binding(0) var<storage, read> starts: array<u32>;
@group(0) @binding(1) var<storage, read> corners: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> shown: array<f32>;

fn position(i: u32) -> vec3<f32> {
    return vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
}

@compute @workgroup_size(64)
fn normals(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let a = position(i);
    // A gather over the faces around the vertex: the order of the sum is fixed, and no atomics are
    // needed.
    var sum = vec3<f32>();
    for (var k = starts[i]; k < starts[i + 1u]; k++) {
        let face = corners[k];
        sum += cross(position(face.x) - a, position(face.y) - a);
    }
    let size = length(sum);
    let normal = select(vec3<f32>(), sum / size, size > 0.0);
    shown[6u * i + 3u] = normal.x;
    shown[6u * i + 4u] = normal.y;
    shown[6u * i + 5u] = normal.z;
}
