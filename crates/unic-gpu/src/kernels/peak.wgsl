// Only multiplies and adds: 16 independent sums of four in each invocation.

override ROUNDS: u32;

//{constants}

@group(0) @binding(0) var<storage, read_write> out: array<vec4<f32>>;

@compute @workgroup_size(THREADS)
fn peak(@builtin(global_invocation_id) id: vec3<u32>) {
    let a = vec4<Real>(out[0]);
    let b = vec4<Real>(out[1]);
    //{starts}
    for (var k = 0u; k < ROUNDS; k++) {
        //{steps}
    }
    // Writing the sum keeps the compiler from removing the work.
    out[2u + id.x] = //{sum};
}
