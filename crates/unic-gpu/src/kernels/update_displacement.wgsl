// What is remembered, and the output shortened to its limit; one that is no number counts as zero.
fn updated(state: vec4<f32>, output: vec3<f32>) -> vec3<f32> {
    let size = dot(output, output);
    let shortened = output * select(1.0, LIMIT / sqrt(size), sqrt(size) > LIMIT);
    return state.xyz * DECAY + select(vec3<f32>(), shortened, size < 3.4e38) * (SCALE * state.w);
}
