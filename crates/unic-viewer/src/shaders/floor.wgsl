// Sky, and the floor with shadows and a grid of metres.

struct Ray {
    @builtin(position) clip: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn sky_vertex(@builtin(vertex_index) index: u32) -> Ray {
    // One triangle that covers the picture, at the far plane of a reversed depth.
    let place = vec2f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0);
    return Ray(vec4f(place, 0.0, 1.0), place);
}

@fragment
fn sky_fragment(in: Ray) -> @location(0) vec4f {
    let direction = normalize(view.forward + in.place.x * view.right + in.place.y * view.up);
    return vec4f(sky_colour(direction), 1.0);
}

struct FloorPoint {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
}

@vertex
fn floor_vertex(@builtin(vertex_index) index: u32) -> FloorPoint {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let position = vec3f(view.eye.x, view.ground_height, view.eye.z)
        + vec3f(corner.x, 0.0, corner.y) * 60.0;
    return FloorPoint(view.clip_from_world * vec4f(position, 1.0), position);
}

// Share of a line of `width` metres, at each whole multiple of `spacing`, in a pixel.
fn line_share(place: vec2f, spacing: f32, width: f32) -> f32 {
    let scaled = place / spacing;
    let pixel = max(fwidth(scaled), vec2f(1e-5));
    let half_width = 0.5 * width / spacing;
    let distance = abs(fract(scaled - 0.5) - 0.5);
    let soft = max(pixel, vec2f(half_width));
    let lines = (1.0 - smoothstep(soft * 0.5, soft * 1.5, distance)) * min(half_width * 2.0 / soft, vec2f(1.0));
    return max(lines.x, lines.y);
}

@fragment
fn floor_fragment(in: FloorPoint) -> @location(0) vec4f {
    let away = in.position - view.eye;
    let distance = length(away.xz);
    let lines = line_share(in.position.xz, 1.0, 0.012);
    let fine = line_share(in.position.xz, 0.25, 0.006);
    let near = exp(-distance * distance / 90.0);
    var albedo = vec3f(0.36, 0.35, 0.335);
    albedo *= 1.0 + (0.22 * lines - 0.06 * fine) * near;
    let normal = vec3f(0.0, 1.0, 0.0);
    let key = KEY_COLOUR * max(view.to_key.y, 0.0) * key_visibility(in.position, normal);
    let sky = sky_visibility(in.position);
    var colour = albedo * (key * 0.42 + SKY_COLOUR * 0.62 * sky * sky);
    // The horizon takes the floor in, without an edge.
    let haze = 1.0 - exp(-distance * distance / 260.0);
    colour = mix(colour, sky_colour(normalize(away) * vec3f(1.0, 0.0, 1.0)), haze);
    return vec4f(colour, 1.0);
}
