// Products of matrices and nothing else: 8 independent sums in each subgroup.

enable f16;
enable wgpu_cooperative_matrix;

override ROUNDS: u32;

//{constants}

@group(0) @binding(0) var<storage, read_write> out: array<f32>;

var<workgroup> numbers: array<f16, SIDE * SIDE>;

@compute @workgroup_size(256)
fn peak(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    if (t < SIDE * SIDE) {
        numbers[t] = f16(t) / 256.0h;
    }
    workgroupBarrier();
    let a = coopLoad<Left>(&numbers[0], SIDE);
    let b = coopLoad<Right>(&numbers[0], SIDE);
    //{starts}
    for (var k = 0u; k < ROUNDS; k++) {
        //{steps}
    }
    // All subgroups of a workgroup have the same sums, and write them to the same place.
    let at = group.x * SUMS * SIDE * SIDE;
    //{stores}
}
