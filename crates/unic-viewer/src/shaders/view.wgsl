// View, lights and shadows: shared by all shaders that shade a point of the world.

struct View {
    clip_from_world: mat4x4f,
    // Clip space of the key light, and of the view from above, for shadows.
    key_from_world: mat4x4f,
    above_from_world: mat4x4f,
    // Rays through the picture: eye + forward + x * right + y * up with x and y in -1 to 1.
    eye: vec3f,
    ground_height: f32,
    right: vec3f,
    // Side of the region that shadows cover, metres.
    shadow_extent: f32,
    up: vec3f,
    // Number of samples of a shadow.
    taps: u32,
    forward: vec3f,
    // Unit vector to the key light.
    to_key: vec3f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var key_depth: texture_depth_2d;
@group(0) @binding(2) var above_depth: texture_depth_2d;
@group(0) @binding(3) var compare: sampler_comparison;

const KEY_COLOUR = vec3f(3.05, 2.85, 2.6);
const SKY_COLOUR = vec3f(0.66, 0.74, 0.86);
const BOUNCE_COLOUR = vec3f(0.46, 0.42, 0.38);
const HORIZON = vec3f(0.56, 0.60, 0.66);
const ZENITH = vec3f(0.17, 0.26, 0.40);
const PI = 3.14159265;
// Each sample turns by the golden angle, so that any number of them is spread over the disk.
const GOLDEN_ANGLE = 2.39996323;

fn disk_sample(i: u32, count: u32) -> vec2f {
    let angle = GOLDEN_ANGLE * f32(i);
    return sqrt((f32(i) + 0.5) / f32(count)) * vec2f(cos(angle), sin(angle));
}

fn sky_colour(direction: vec3f) -> vec3f {
    let height = clamp(direction.y, -0.2, 1.0);
    return mix(HORIZON, ZENITH, smoothstep(-0.05, 0.75, height));
}

// Share of the key light that reaches a point: the mean over a disk of the shadow map.
fn key_visibility(position: vec3f, normal: vec3f) -> f32 {
    // Off the surface, so that it does not shade itself.
    let offset = position + normal * (0.006 + 0.0015 * view.shadow_extent);
    let clip = view.key_from_world * vec4f(offset, 1.0);
    let place = clip.xy * vec2f(0.5, -0.5) + 0.5;
    let inside = all(place > vec2f(0.0)) && all(place < vec2f(1.0)) && clip.z < 1.0;
    // 2.2 cm: the penumbra of a large lamp.
    let radius = 0.022 / view.shadow_extent;
    var lit = 0.0;
    for (var i = 0u; i < view.taps; i++) {
        let tap = place + disk_sample(i, view.taps) * radius;
        lit += textureSampleCompareLevel(key_depth, compare, tap, clip.z - 0.0006);
    }
    return select(1.0, lit / f32(view.taps), inside);
}

// Share of the sky that is seen from a point: what is above it, by distance.
fn sky_visibility(position: vec3f) -> f32 {
    let clip = view.above_from_world * vec4f(position, 1.0);
    let place = clip.xy * vec2f(0.5, -0.5) + 0.5;
    let size = vec2f(textureDimensions(above_depth));
    let radius = 0.24 / view.shadow_extent;
    // Depth spans twice the extent of the sides.
    let metres = 2.0 * view.shadow_extent;
    var hidden = 0.0;
    for (var i = 0u; i < view.taps; i++) {
        let tap = (place + disk_sample(i, view.taps) * radius) * size;
        let texel = clamp(vec2i(tap), vec2i(0), vec2i(size) - 1);
        let above = (clip.z - textureLoad(above_depth, texel, 0)) * metres - 0.03;
        // What is far above hides less of the sky.
        hidden += select(0.0, 1.0 / (1.0 + above * above * 6.0), above > 0.0);
    }
    let inside = all(place > vec2f(0.0)) && all(place < vec2f(1.0)) && clip.z < 1.0;
    return select(1.0, 1.0 - 0.75 * hidden / f32(view.taps), inside);
}
