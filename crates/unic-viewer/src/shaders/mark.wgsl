// Flat marks on the ground: ribbons and rings.

struct MarkPoint {
    @location(0) position: vec3f,
    @location(1) colour: vec4f,
}

struct Shown {
    @builtin(position) clip: vec4f,
    @location(0) colour: vec4f,
}

@vertex
fn mark_vertex(in: MarkPoint) -> Shown {
    return Shown(view.clip_from_world * vec4f(in.position, 1.0), in.colour);
}

@fragment
fn mark_fragment(in: Shown) -> @location(0) vec4f {
    return vec4f(in.colour.rgb * in.colour.a, in.colour.a);
}
