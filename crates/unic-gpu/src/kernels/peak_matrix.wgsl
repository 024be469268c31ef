// Only multiplies matrices: independent sums in each subgroup.

enable f16;
enable wgpu_cooperative_matrix;

override ROUNDS: u32;

//{constants}

// Number of subgroups in a workgroup; then one number of each invocation.
@group(0) @binding(0) var<storage, read_write> out: array<f32>;

var<workgroup> numbers: array<f16, SIDE * SIDE>;
// One matrix of each subgroup; subgroups beyond STAGED share.
var<workgroup> staged: array<f32, STAGED * SIDE * SIDE>;

@compute @workgroup_size(THREADS)
fn peak(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) t: u32,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(num_subgroups) subgroups: u32,
) {
    for (var e = t; e < SIDE * SIDE; e += THREADS) {
        numbers[e] = f16(e) / 256.0h;
    }
    workgroupBarrier();
    let a = coopLoad<Left>(&numbers[0], SIDE);
    let b = coopLoad<Right>(&numbers[0], SIDE);
    //{starts}
    for (var k = 0u; k < ROUNDS; k++) {
        //{steps}
    }
    let stage = subgroup % STAGED * SIDE * SIDE;
    var total = 0.0;
    //{totals}
    if (id.x == 0u) {
        out[0] = f32(subgroups);
    }
    out[1u + id.x] = total;
}
