// Skin and cloth.

struct Part {
    // Linear colours.
    colour: vec3f,
    surface: u32,
    accent: vec3f,
    print: u32,
    // Where between the ticks `before` (0) and `now` (1) the shape is.
    share: f32,
    shading: u32,
    // 1 with a colour for each vertex.
    has_colours: u32,
    // 1 where `pattern` is a place on the cloth, 0 where it is a place in space.
    is_flat: u32,
}

@group(1) @binding(0) var<uniform> part: Part;
// Six numbers a vertex: position and normal.
@group(1) @binding(1) var<storage, read> now: array<f32>;
@group(1) @binding(2) var<storage, read> before: array<f32>;
// Colours in sRGB, four bytes each.
@group(1) @binding(3) var<storage, read> colours: array<u32>;

const SKIN = 0u;
const PLAIN = 1u;
const JERSEY = 2u;
const TWILL = 3u;
const LINEN = 4u;
const SATIN = 5u;

const PRINT_STRIPES = 1u;
const PRINT_CHECKS = 2u;
const PRINT_DOTS = 3u;

const SHADING_LIT = 0u;
const SHADING_NORMALS = 1u;
const SHADING_FLAT = 2u;

struct Corner {
    // Index of the vertex of the shape: several corners share it along a seam of the texture.
    @location(0) source: u32,
    // Place on the cloth, or at rest, metres.
    @location(1) pattern: vec3f,
}

struct Point {
    @builtin(position) clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) pattern: vec3f,
    @location(3) colour: vec3f,
}

fn interpolated(at: u32) -> vec3f {
    let a = vec3f(before[at], before[at + 1u], before[at + 2u]);
    let b = vec3f(now[at], now[at + 1u], now[at + 2u]);
    return mix(a, b, part.share);
}

@vertex
fn surface_vertex(in: Corner) -> Point {
    let position = interpolated(in.source * 6u);
    let normal = interpolated(in.source * 6u + 3u);
    // Colours are stored as sRGB: eight bits are too few for linear ones. There is no branch here, for
    // Mesa's lavapipe 22.3 compiles a vertex shader that branches by a uniform anew for every draw,
    // and keeps all of them.
    let at = min(in.source, arrayLength(&colours) - 1u);
    let own = pow(unpack4x8unorm(colours[at]).rgb, vec3f(2.2));
    let colour = select(part.colour, own, part.has_colours == 1u);
    return Point(view.clip_from_world * vec4f(position, 1.0), position, normal, in.pattern, colour);
}

@vertex
fn line_vertex(@builtin(vertex_index) index: u32) -> Point {
    let position = interpolated(index * 6u);
    var clip = view.clip_from_world * vec4f(position, 1.0);
    // In front of the surface, in a reversed depth.
    clip.z += 0.0004 * clip.w * clip.z / max(clip.w * clip.w, 1e-6) + 0.00002;
    return Point(clip, position, interpolated(index * 6u + 3u), vec3f(0.0), part.accent);
}

@fragment
fn line_fragment(in: Point) -> @location(0) vec4f {
    return vec4f(in.colour, 1.0);
}

@vertex
fn key_shadow_vertex(in: Corner) -> @builtin(position) vec4f {
    return view.key_from_world * vec4f(interpolated(in.source * 6u), 1.0);
}

@vertex
fn above_shadow_vertex(in: Corner) -> @builtin(position) vec4f {
    return view.above_from_world * vec4f(interpolated(in.source * 6u), 1.0);
}

// Depth alone is written.
@fragment
fn shadow_fragment() {}

fn hash(cell: vec2f) -> f32 {
    let n = u32(i32(cell.x)) * 1597334677u ^ u32(i32(cell.y)) * 3812015801u;
    let mixed = (n ^ (n >> 15u)) * 2246822519u;
    return f32((mixed ^ (mixed >> 13u)) & 0xffffu) / 65535.0;
}

fn noise(place: vec2f) -> f32 {
    let cell = floor(place);
    let t = smoothstep(vec2f(0.0), vec2f(1.0), place - cell);
    let low = mix(hash(cell), hash(cell + vec2f(1.0, 0.0)), t.x);
    let high = mix(hash(cell + vec2f(0.0, 1.0)), hash(cell + vec2f(1.0, 1.0)), t.x);
    return mix(low, high, t.y);
}

// Height of the threads, 0 to 1, at a place in metres.
fn thread_height(place: vec2f) -> f32 {
    switch part.surface {
        case JERSEY: {
            // Columns of stitches that lean to both sides in turn.
            let p = place / vec2f(0.0024, 0.0020);
            let lean = abs(fract(p.x) - 0.5) * 1.3;
            let row = fract(p.y + lean) - 0.5;
            let column = abs(fract(p.x * 2.0) - 0.5);
            return (1.0 - 3.2 * row * row) * (1.0 - 1.6 * column * column);
        }
        case TWILL: {
            let p = place / 0.0022;
            let ridge = abs(fract(p.x + p.y) - 0.5) * 2.0;
            return mix(ridge, 1.0, 0.3 * abs(fract(p.x * 2.0 - p.y) - 0.5));
        }
        case LINEN: {
            let p = place / 0.0018;
            let cell = floor(p);
            // Threads differ in thickness.
            let thick = 0.75 + 0.5 * vec2f(hash(vec2f(cell.x, 7.0)), hash(vec2f(3.0, cell.y)));
            let bow = 1.0 - abs(fract(p) * 2.0 - 1.0) / thick;
            let over = (i32(cell.x) + i32(cell.y)) & 1;
            return clamp(select(bow.x, bow.y, over == 0), 0.0, 1.0);
        }
        case SATIN: {
            return abs(fract(place.y / 0.0009) - 0.5) * 2.0;
        }
        default: {
            return 0.5;
        }
    }
}

struct Cloth {
    // Factor of the colour.
    shade: f32,
    // Slope of the threads along the two directions of the pattern.
    slope: vec2f,
}

fn cloth_at(place: vec2f, pixel: vec2f) -> Cloth {
    // Threads that are thinner than a pixel are grey, not moiré.
    let visible = 1.0 - smoothstep(0.0005, 0.0014, max(pixel.x, pixel.y));
    let melange = 0.5 * noise(place / 0.004) + 0.5 * noise(place / 0.017);
    var cloth = Cloth(1.0 + 0.10 * (melange - 0.5), vec2f(0.0));
    if visible > 0.0 && part.surface >= JERSEY {
        let step = 0.0002;
        let height = thread_height(place);
        let along = vec2f(thread_height(place + vec2f(step, 0.0)), thread_height(place + vec2f(0.0, step)));
        cloth.slope = (along - height) * visible * 0.55;
        cloth.shade *= mix(1.0, 0.72 + 0.4 * height, visible);
    }
    return cloth;
}

// Colour of the print at a place in metres.
fn printed(place: vec2f, pixel: vec2f, base: vec3f) -> vec3f {
    let soft = max(pixel, vec2f(0.0004));
    switch part.print {
        case PRINT_STRIPES: {
            let period = 0.032;
            let d = abs(fract(place.y / period) - 0.5) * period;
            return mix(part.accent, base, smoothstep(-soft.y, soft.y, d - 0.0055));
        }
        case PRINT_CHECKS: {
            let period = 0.06;
            let d = abs(fract(place / period) - 0.5) * period;
            let band = 1.0 - smoothstep(-soft, soft, d - 0.014);
            let thread = 1.0 - smoothstep(-soft, soft, abs(d - 0.022) - 0.0016);
            let wide = mix(base, part.accent, 0.42 * band.x + 0.42 * band.y);
            return mix(wide, vec3f(0.9, 0.86, 0.74), 0.6 * max(thread.x, thread.y));
        }
        case PRINT_DOTS: {
            let period = 0.03;
            let row = floor(place.y / period);
            let p = vec2f(place.x / period + 0.5 * (row - 2.0 * floor(row * 0.5)), place.y / period);
            let d = length(fract(p) - 0.5) * period;
            let edge = max(soft.x, soft.y);
            return mix(part.accent, base, smoothstep(-edge, edge, d - 0.0058));
        }
        default: {
            return base;
        }
    }
}

// Light that a rough surface reflects to the eye (Walter et al. 2007, with Schlick's Fresnel).
fn specular(normal: vec3f, to_eye: vec3f, to_light: vec3f, roughness: f32, reflectance: f32) -> f32 {
    let half_way = normalize(to_eye + to_light);
    let alpha = roughness * roughness;
    let nh = max(dot(normal, half_way), 0.0);
    let nl = max(dot(normal, to_light), 0.0);
    let nv = max(dot(normal, to_eye), 1e-3);
    let d = nh * nh * (alpha * alpha - 1.0) + 1.0;
    let distribution = alpha * alpha / (PI * d * d);
    let k = alpha * 0.5;
    let geometry = 1.0 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k) * 4.0);
    let fresnel = reflectance + (1.0 - reflectance) * pow(1.0 - max(dot(half_way, to_eye), 0.0), 5.0);
    return distribution * geometry * fresnel * nl;
}

fn lit_skin(albedo: vec3f, position: vec3f, normal: vec3f, to_eye: vec3f) -> vec3f {
    let nl = dot(normal, view.to_key);
    // Light that enters the skin leaves it red, past the edge of the shadow.
    let wrap = vec3f(0.42, 0.22, 0.16);
    let diffuse = max((vec3f(nl) + wrap) / (1.0 + wrap), vec3f(0.0));
    let visible = key_visibility(position, normal);
    let lit = min(diffuse, vec3f(visible) + 0.18 * wrap * diffuse);
    let sky = sky_visibility(position + normal * 0.03);
    let ambient = mix(BOUNCE_COLOUR * (0.35 + 0.65 * sky), SKY_COLOUR * sky, 0.5 + 0.5 * normal.y);
    let rim = pow(1.0 - max(dot(normal, to_eye), 0.0), 4.0) * 0.22 * SKY_COLOUR * sky;
    let gloss = specular(normal, to_eye, view.to_key, 0.48, 0.035) * KEY_COLOUR * visible;
    return albedo * (KEY_COLOUR * lit / PI * 1.25 + ambient * 0.52) + gloss * 0.6 + rim * albedo;
}

fn lit_cloth(albedo: vec3f, position: vec3f, normal: vec3f, to_eye: vec3f) -> vec3f {
    let nl = dot(normal, view.to_key);
    let wrap = 0.18;
    let visible = key_visibility(position, normal);
    let diffuse = max((nl + wrap) / (1.0 + wrap), 0.0);
    let sky = sky_visibility(position + normal * 0.03);
    let ambient = mix(BOUNCE_COLOUR * (0.3 + 0.7 * sky), SKY_COLOUR * sky, 0.5 + 0.5 * normal.y);
    // Fibres that stand off the cloth catch light at its edges.
    let grazing = pow(1.0 - max(dot(normal, to_eye), 0.0), 3.0);
    let is_satin = part.surface == SATIN;
    let fuzz = select(0.34, 0.12, is_satin) * grazing * (SKY_COLOUR * sky + KEY_COLOUR * visible * diffuse * 0.3);
    let roughness = select(0.78, 0.36, is_satin);
    let gloss = specular(normal, to_eye, view.to_key, roughness, 0.04) * KEY_COLOUR * visible;
    return albedo * (KEY_COLOUR * visible * diffuse / PI * 1.25 + ambient * 0.52)
        + fuzz * mix(albedo, vec3f(0.5), 0.3) + gloss * select(0.35, 1.6, is_satin);
}

@fragment
fn surface_fragment(in: Point, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let to_eye = normalize(view.eye - in.position);
    // Derivatives are taken before any branch.
    let dpx = dpdx(in.position);
    let dpy = dpdy(in.position);
    let dqx = dpdx(in.pattern);
    let dqy = dpdy(in.pattern);
    var normal = normalize(in.normal);
    let face = normalize(cross(dpy, dpx));
    let outward = face * sign(dot(face, to_eye));
    // A normal that has no direction, or points away from the eye, would shade the wrong side.
    if !(dot(in.normal, in.normal) > 1e-12) { normal = outward; }
    if dot(normal, outward) < 0.0 { normal = -normal; }
    if part.shading == SHADING_NORMALS {
        let shown = select(-normal, normal, is_front);
        return vec4f(pow(shown * 0.5 + 0.5, vec3f(2.2)), 1.0);
    }
    if part.shading == SHADING_FLAT {
        let soft = 0.72 + 0.28 * max(dot(normal, to_eye), 0.0);
        return vec4f(in.colour * soft, 1.0);
    }
    if part.surface == SKIN {
        return vec4f(lit_skin(in.colour, in.position, normal, to_eye), 1.0);
    }
    // The place on the cloth, and the two directions in the world in which it grows.
    var place = in.pattern.xy;
    var px = dqx.xy;
    var py = dqy.xy;
    if part.is_flat == 0u {
        // Without a texture, cloth is looked at from the front or from the side.
        let rest = abs(cross(dqx, dqy));
        if rest.x > rest.z {
            place = in.pattern.zy;
            px = dqx.zy;
            py = dqy.zy;
        }
    }
    let cloth = cloth_at(place, abs(px) + abs(py));
    var albedo = in.colour;
    if part.has_colours == 0u { albedo = printed(place, abs(px) + abs(py), albedo); }
    albedo *= cloth.shade;
    let area = px.x * py.y - px.y * py.x;
    if abs(area) > 1e-14 {
        let along_u = normalize((dpx * py.y - dpy * px.y) * sign(area));
        let along_v = normalize((dpy * px.x - dpx * py.x) * sign(area));
        normal = normalize(normal - along_u * cloth.slope.x - along_v * cloth.slope.y);
    }
    if !is_front { albedo *= 0.78; }
    return vec4f(lit_cloth(albedo, in.position, normal, to_eye), 1.0);
}
