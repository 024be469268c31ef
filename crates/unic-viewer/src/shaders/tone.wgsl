// From light to the colours of a display.

@group(0) @binding(0) var light: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Pixel {
    @builtin(position) clip: vec4f,
    @location(0) place: vec2f,
}

@vertex
fn tone_vertex(@builtin(vertex_index) index: u32) -> Pixel {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Pixel(vec4f(corner * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), corner);
}

// Filmic curve: a fit to the reference of the Academy Color Encoding System (Narkowicz 2016).
fn filmic(x: vec3f) -> vec3f {
    let y = x * 0.62;
    return clamp(y * (2.51 * y + 0.03) / (y * (2.43 * y + 0.59) + 0.14), vec3f(0.0), vec3f(1.0));
}

@fragment
fn tone_fragment(in: Pixel) -> @location(0) vec4f {
    let colour = filmic(textureSampleLevel(light, smooth_sampler, in.place, 0.0).rgb);
    let srgb = select(1.055 * pow(colour, vec3f(1.0 / 2.4)) - 0.055, colour * 12.92, colour <= vec3f(0.0031308));
    // A noise of half a step hides the bands of slow gradients.
    let seed = dot(floor(in.clip.xy), vec2f(0.06711056, 0.00583715));
    let dither = (fract(52.9829189 * fract(seed)) - 0.5) / 255.0;
    return vec4f(srgb + dither, 1.0);
}
