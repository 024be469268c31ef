// The paper's way out of the body: the nearest vertex, its tangent plane, and out along its normal.

fn to_item(vertex: u32, p: vec3<f32>) -> f32 {
    return squared(body_vertex(vertex) - p);
}

@compute @workgroup_size(64)
fn drag(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let at = place_of(i);
    let p = to_world(at, states[i].value.xyz);
    let vertex = nearest(p, seeds[i]);
    seeds[i] = vertex;
    if (vertex == NO_ITEM) {
        return;
    }
    let b = body_vertex(vertex);
    let n = vec3<f32>(body[6u * vertex + 3u], body[6u * vertex + 4u], body[6u * vertex + 5u]);
    // How far off the vertex it ends, metres.
    let relaxation = tick[HANDLING].x;
    if (dot(p - b, n) < 0.0) {
        states[i].value = pushed(states[i].value, at, b + n * relaxation);
    }
}
