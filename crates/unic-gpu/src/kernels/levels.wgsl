// Coarse levels of the strain projection: chords between samples, and what follows them. The kernels
// compute what `unic_core::projection` does, whose comments give the reasons.

// Chord with the limits of its length.
struct Chord {
    // Places in the samples.
    ends: vec2<u32>,
    // Shortest and longest length, metres.
    limits: vec2<f32>,
    // Share of a correction that each end takes.
    shares: vec2<f32>,
}

// Positions of a sample, metres.
struct Sample {
    now: vec4<f32>,
    // At the start of a level.
    before: vec4<f32>,
    // At the start of the tick.
    first: vec4<f32>,
}

// Interpolation from samples.
struct Row {
    samples: array<u32, 8>,
    weights: array<f32, 8>,
}

// Sweeps of a dispatch.
override SWEEPS: u32;
// Length below which a chord has no direction, metres.
override LEAST_LENGTH: f32;

// Positions of all vertices, which the levels move.
@group(0) @binding(18) var<storage, read_write> projected: array<vec4<f32>>;
@group(0) @binding(23) var<storage, read_write> samples: array<Sample>;
// Vertices that are samples.
@group(0) @binding(24) var<storage, read> vertices: array<u32>;
// Chords of one level, sorted by colour, and the end of each colour.
@group(0) @binding(25) var<storage, read> chords: array<Chord>;
@group(0) @binding(26) var<storage, read> ends: array<u32>;
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
        let sample = samples[rows[row].samples[k]];
        let since = select(sample.before, sample.first, start == TICK);
        sum += (sample.now - since).xyz * rows[row].weights[k];
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
    samples[id.x] = Sample(position, position, position);
}

// Starts a level at the positions that the coarser one has left.
@compute @workgroup_size(64)
fn start_level(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= arrayLength(&samples)) {
        return;
    }
    samples[id.x].before = samples[id.x].now;
}

// Brings the chords of one level into their limits. One workgroup sweeps, colour by colour.
@compute @workgroup_size(256)
fn sweep_chords(@builtin(local_invocation_index) lane: u32) {
    // A level without chords has a padded buffer, in which all colours end at 0.
    let colours = arrayLength(&ends);
    for (var sweep = 0u; sweep < SWEEPS; sweep++) {
        var start = 0u;
        for (var colour = 0u; colour < colours; colour++) {
            let end = ends[colour];
            for (var i = start + lane; i < end; i += 256u) {
                let chord = chords[i];
                let along = samples[chord.ends.y].now.xyz - samples[chord.ends.x].now.xyz;
                let size = length(along);
                if (size > LEAST_LENGTH) {
                    let wanted = min(max(size, chord.limits.x), chord.limits.y);
                    let correction = along * ((size - wanted) / size);
                    samples[chord.ends.x].now += vec4<f32>(correction * chord.shares.x, 0.0);
                    samples[chord.ends.y].now -= vec4<f32>(correction * chord.shares.y, 0.0);
                }
            }
            storageBarrier();
            start = end;
        }
    }
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
        samples[i].now += moved(i, LEVEL);
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
