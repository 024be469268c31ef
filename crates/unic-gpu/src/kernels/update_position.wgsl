// The sum, or the position where the sum leaves the numbers.
fn updated(value: vec3<f32>, output: vec3<f32>) -> vec3<f32> {
    let sum = value + output;
    return select(value, sum, all(abs(sum) <= vec3<f32>(FARTHEST)));
}
