// Next position: the sum with the field's output, or the same position if the sum is too large or
// not finite.
fn updated(state: vec4<f32>, output: vec3<f32>) -> vec3<f32> {
    let sum = state.xyz + output;
    return select(state.xyz, sum, all(abs(sum) <= vec3<f32>(FARTHEST)));
}
