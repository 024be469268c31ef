// Linear blend skinning of one vertex.

struct Vertex {
    // Position in the bind pose, metres.
    rest: vec3<f32>,
    // The vertex's weights are `first..first + count`, in descending order.
    first: u32,
    // Mean displacement of the prior, metres.
    mean: vec3<f32>,
    count: u32,
}

struct Weight {
    joint: u32,
    weight: f32,
}

@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> weights: array<Weight>;

// Skinned position: the weighted sum of the rest position transformed by each joint.
fn skinned(vertex: Vertex) -> vec3<f32> {
    var sum = vec3<f32>();
    for (var k = 0u; k < vertex.count; k++) {
        let entry = weights[vertex.first + k];
        let joint = JOINTS + 2u * entry.joint;
        sum += (rotated(tick[joint], vertex.rest) + tick[joint + 1u].xyz) * entry.weight;
    }
    return sum;
}

// Skinning rotation: the normalised blend of the joints' quaternions in the hemisphere of the
// heaviest one's.
fn skinning_rotation(vertex: Vertex) -> vec4<f32> {
    if (vertex.count == 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let heaviest = weights[vertex.first];
    let leading = tick[JOINTS + 2u * heaviest.joint];
    var sum = leading * heaviest.weight;
    for (var k = 1u; k < vertex.count; k++) {
        let entry = weights[vertex.first + k];
        let q = tick[JOINTS + 2u * entry.joint];
        sum += q * select(entry.weight, -entry.weight, dot(q, leading) < 0.0);
    }
    return normalize(sum);
}
