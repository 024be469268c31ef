// Coarse levels of the strain projection: samples, which sweeps over chords and stencils move, and
// what follows them. The kernels compute what `unic_core::projection` does, whose comments give the
// reasons.

// Where a sample started, metres.
struct Start {
    // Position at the start of a level.
    level: vec4<f32>,
    // Position at the start of the tick.
    tick: vec4<f32>,
}

// Interpolation from samples.
struct Row {
    samples: array<u32, 8>,
    weights: array<f32, 8>,
}

// Positions of all vertices, which the levels move.
@group(0) @binding(18) var<storage, read_write> projected: array<vec4<f32>>;
// Positions of the samples, metres.
@group(0) @binding(23) var<storage, read_write> samples: array<vec4<f32>>;
@group(0) @binding(29) var<storage, read_write> starts: array<Start>;
// Vertices that are samples.
@group(0) @binding(24) var<storage, read> vertices: array<u32>;
@group(0) @binding(27) var<storage, read> rows: array<Row>;
// Factor of what each row's target takes.
@group(0) @binding(28) var<storage, read> freedom: array<f32>;

// Starts that moves of samples count from.
const LEVEL = 0u;
const TICK = 1u;

// What the target of a row takes of the samples' moves since the start of the level or of the tick.
fn moved(row: u32, start: u32) -> vec4<f32> {
    var sum = vec3<f32>();
    for (var k = 0u; k < 8u; k++) {
        let sample = rows[row].samples[k];
        let since = select(starts[sample].level, starts[sample].tick, start == TICK);
        sum += (samples[sample] - since).xyz * rows[row].weights[k];
    }
    return vec4<f32>(sum * freedom[row], 0.0);
}

// Reads the positions of the samples.
@compute @workgroup_size(64)
fn gather_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= arrayLength(&vertices)) {
        return;
    }
    let position = projected[vertices[id.x]];
    samples[id.x] = position;
    starts[id.x] = Start(position, position);
}

// Starts a level at the positions that the coarser one has left.
@compute @workgroup_size(64)
fn start_level(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= arrayLength(&samples)) {
        return;
    }
    starts[id.x].level = samples[id.x];
}

// Moves the samples of the next level along. Rows of samples that the chords have moved are zero.
@compute @workgroup_size(64)
fn carry_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= arrayLength(&rows)) {
        return;
    }
    // Another invocation may read the position of a sample whose row is zero, so that it stays
    // untouched.
    if (freedom[i] != 0.0) {
        samples[i] += moved(i, LEVEL);
    }
}

// Moves all vertices along with the samples of the finest level.
@compute @workgroup_size(64)
fn follow_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= arrayLength(&rows)) {
        return;
    }
    projected[i] += moved(i, TICK);
}
