// The paper's intersection handling: a point below the tangent plane of its nearest body vertex is
// dragged to that vertex, and out along the vertex's normal.

// Squared distance to a vertex, m².
fn to_item(vertex: u32, p: vec3<f32>) -> f32 {
    return squared(body_vertex(vertex) - p);
}

@compute @workgroup_size(64)
fn drag(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let frame = state_frame(i);
    let p = to_world(frame, states[i].value.xyz);
    let vertex = nearest(p, seeds[i]);
    seeds[i] = vertex;
    if (vertex == NO_ITEM) {
        return;
    }
    let b = body_vertex(vertex);
    let n = vec3<f32>(body[6u * vertex + 3u], body[6u * vertex + 4u], body[6u * vertex + 5u]);
    // Distance from the vertex to the corrected position, metres.
    let relaxation = tick[HANDLING].x;
    if (dot(p - b, n) < 0.0) {
        states[i].value = pushed(states[i].value, frame, b + n * relaxation);
    }
}
