// Next displacement: the decayed one plus the field's output, whose length is limited. An output
// that is not finite counts as zero.
fn updated(state: vec4<f32>, output: vec3<f32>) -> vec3<f32> {
    let size = dot(output, output);
    let limited = output * select(1.0, LIMIT / sqrt(size), sqrt(size) > LIMIT);
    return state.xyz * DECAY + select(vec3<f32>(), limited, size < 3.4e38) * (SCALE * state.w);
}
