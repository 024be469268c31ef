// Order of the cloth along its smoothed shape, and of its layers: vertices that are close to each other
// are pushed back into the order that they have at rest. The kernels compute what
// `unic_core::projection::order` does, whose comments give the reasons, and gather the pushes of each
// vertex.

// Where a vertex is at rest, metres.
struct Place {
    // Position; 0 for a vertex that is not pushed, else 1, or the sign of an outward normal.
    position: vec4<f32>,
    // Place on the smoothed shape, or outward normal; freedom of the vertex.
    compared: vec4<f32>,
    // Height in the layers.
    height: f32,
}

// Where a vertex was before the pushes, metres.
struct Found {
    position: vec4<f32>,
    // Place on the smoothed shape, or outward normal.
    compared: vec4<f32>,
    // Cell of the position. Kept, because other kernels may round it otherwise.
    cell: vec4<i32>,
}

// Interpolation from samples.
struct Row {
    samples: array<u32, 8>,
    weights: array<f32, 8>,
}

// Whether the order is that of layers.
override OF_LAYERS: bool;
// Least distance in the order, metres.
override GAP: f32;
// Largest distance that one push makes up for, in least distances.
override MOST_MISSING: f32;
// Distance from which vertices do not push each other, metres.
override NEAR: f32;
// Distance in the order up to which pairs are kept, metres.
override KEPT: f32;
// Distance on the smoothed shape from which pairs count, metres.
override APART: f32;
// Least difference of heights of two layers, metres.
override LEAST_RISE: f32;
// Distance at rest from which two layers do not push each other, metres.
override REACH: f32;
// Least cosine between the normals of two layers.
override LEAST_COSINE: f32;
// Size of a cell, metres.
override CELL_M: f32;
// Factors of the indices of a cell.
override FACTOR_X: i32;
override FACTOR_Y: i32;
override FACTOR_Z: i32;
// Place in `vectors` of the share of a given displacement that is left.
override SHARE: u32;
// Whether pushes are scaled by 1 - share^2.
override FADES: bool;

// Parts of a least distance in the sums, which are integers: their order changes nothing.
const FINE = 16384.0;

// Largest number of vertices that one is compared with. A limit for shapes that have gone wrong. The
// sums of so many pushes fit.
const MOST_STEPS = 4096u;

const NONE = 0xffffffffu;

// Vectors of the frame.
@group(0) @binding(0) var<storage, read> vectors: array<f32>;
@group(0) @binding(1) var<storage, read> places: array<Place>;
@group(0) @binding(2) var<storage, read_write> found: array<Found>;
// Last vertex of each bucket while they fill, and afterwards.
@group(0) @binding(3) var<storage, read_write> heads: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> filled: array<u32>;
// For each vertex the one before it in its bucket.
@group(0) @binding(5) var<storage, read_write> before: array<u32>;
// Positions of all vertices, metres: before a push, and after it.
@group(0) @binding(6) var<storage, read_write> now: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read_write> after: array<vec4<f32>>;
// Positions of the samples of the finest level, metres: before they are averaged, and after it.
@group(0) @binding(8) var<storage, read_write> samples: array<vec4<f32>>;
@group(0) @binding(9) var<storage, read_write> averaged: array<vec4<f32>>;
// Vertices that are samples.
@group(0) @binding(10) var<storage, read> vertices: array<u32>;
// End of each sample's neighbours, and the neighbours; or of the faces around each vertex, and their two
// other corners.
@group(0) @binding(11) var<storage, read> ends: array<u32>;
@group(0) @binding(12) var<storage, read> neighbours: array<u32>;
@group(0) @binding(13) var<storage, read> rows: array<Row>;

// Reads the positions of the samples.
@compute @workgroup_size(64)
fn gather_smoothed(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < arrayLength(&vertices)) {
        samples[id.x] = now[vertices[id.x]];
    }
}

// Averages each sample with its neighbours.
@compute @workgroup_size(64)
fn average(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= arrayLength(&ends)) {
        return;
    }
    let start = list_start(i);
    let end = ends[i];
    var sum = vec3<f32>();
    for (var k = start; k < end; k++) {
        sum += samples[neighbours[k]].xyz;
    }
    averaged[i] = vec4<f32>((samples[i].xyz + sum) / f32(1u + end - start), 0.0);
}

// Start of the neighbours or faces of one sample or vertex.
fn list_start(i: u32) -> u32 {
    if (i > 0u) {
        return ends[i - 1u];
    }
    return 0u;
}

// Keeps where the vertices and their smoothed places are, and empties the buckets.
@compute @workgroup_size(64)
fn keep_smoothed(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    empty_bucket(i);
    if (i >= arrayLength(&rows)) {
        return;
    }
    var smoothed = vec3<f32>();
    for (var k = 0u; k < 8u; k++) {
        smoothed += averaged[rows[i].samples[k]].xyz * rows[i].weights[k];
    }
    keep(i, smoothed);
}

// Keeps where the vertices and their outward normals are, and empties the buckets.
@compute @workgroup_size(64)
fn keep_layers(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    empty_bucket(i);
    if (i >= arrayLength(&places)) {
        return;
    }
    let own = now[i].xyz;
    var sum = vec3<f32>();
    for (var k = list_start(i); k < ends[i]; k++) {
        let corner = now[neighbours[2u * k]].xyz - own;
        sum += cross(corner, now[neighbours[2u * k + 1u]].xyz - own);
    }
    let size = length(sum);
    var outward = vec3<f32>();
    if (size > 0.0) {
        outward = sum / size * places[i].position.w;
    }
    keep(i, outward);
}

fn empty_bucket(i: u32) {
    if (i < arrayLength(&heads)) {
        atomicStore(&heads[i], NONE);
    }
}

fn keep(i: u32, compared: vec3<f32>) {
    let cell = vec3<i32>(floor(now[i].xyz / CELL_M));
    found[i] = Found(now[i], vec4<f32>(compared, 0.0), vec4<i32>(cell, 0));
}

// Bucket of a cell; their number is a power of two.
fn bucket(cell: vec3<i32>, buckets: u32) -> u32 {
    let mixed = (cell.x * FACTOR_X) ^ (cell.y * FACTOR_Y) ^ (cell.z * FACTOR_Z);
    return bitcast<u32>(mixed) & (buckets - 1u);
}

// Sorts the vertices that are pushed into buckets.
@compute @workgroup_size(64)
fn fill_buckets(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= arrayLength(&places) || places[i].position.w == 0.0) {
        return;
    }
    let cell = found[i].cell.xyz;
    before[i] = atomicExchange(&heads[bucket(cell, arrayLength(&heads))], i);
}

// Direction from a vertex to another one along the smoothed shape, and the weight of the pair.
fn along_shape(i: u32, other: u32) -> vec4<f32> {
    let on_shape = found[other].compared.xyz - found[i].compared.xyz;
    let size = length(on_shape);
    let apart = size / APART;
    let at_rest = places[other].compared.xyz - places[i].compared.xyz;
    let rest = places[other].position.xyz - places[i].position.xyz;
    // Written so that NaN pushes nothing.
    if (!(apart > 1.0 && dot(rest, at_rest) / length(at_rest) >= GAP)) {
        return vec4<f32>();
    }
    return vec4<f32>(on_shape / size, min(2.0 * (apart - 1.0), 1.0));
}

// Direction from a vertex to one of another layer along the normal of both, and the weight of the pair.
fn along_normal(i: u32, other: u32) -> vec4<f32> {
    let own_normal = found[i].compared.xyz;
    let other_normal = found[other].compared.xyz;
    let rise = places[other].height - places[i].height;
    let rest = places[other].position.xyz - places[i].position.xyz;
    let cosine = dot(own_normal, other_normal);
    if (!(abs(rise) >= LEAST_RISE && length(rest) < REACH && cosine > LEAST_COSINE)) {
        return vec4<f32>();
    }
    let at_rest = normalize(places[i].compared.xyz + places[other].compared.xyz) * sign(rise);
    if (!(dot(rest, at_rest) >= GAP)) {
        return vec4<f32>();
    }
    let agreement = (cosine - LEAST_COSINE) / (1.0 - LEAST_COSINE);
    return vec4<f32>(normalize(own_normal + other_normal) * sign(rise), min(2.0 * agreement, 1.0));
}

// Push of a vertex by another one, in half least distances, times its weight; and the weight.
fn push_by(i: u32, other: u32) -> vec4<f32> {
    let between = found[other].position.xyz - found[i].position.xyz;
    let near = dot(between, between) / (NEAR * NEAR);
    if (!(near < 1.0)) {
        return vec4<f32>();
    }
    var direction = vec4<f32>();
    if (OF_LAYERS) {
        direction = along_normal(i, other);
    } else {
        direction = along_shape(i, other);
    }
    let along = direction.xyz;
    let all_missing = 1.0 - dot(now[other].xyz - now[i].xyz, along) / GAP;
    if (!(direction.w > 0.0 && dot(between, along) < KEPT && all_missing > 0.0)) {
        return vec4<f32>();
    }
    let missing = min(all_missing, MOST_MISSING);
    let weight = (1.0 - near) * direction.w * min(2.0 * missing, 1.0);
    return vec4<f32>(along * (-weight * missing), weight);
}

// Sum of the pushes of a vertex.
fn pushes(i: u32) -> vec4<f32> {
    let cell = found[i].cell.xyz;
    var steps = 0u;
    var sum = vec4<i32>();
    for (var around = 0; around < 27; around++) {
        let next = cell + vec3<i32>(around % 3, around / 3 % 3, around / 9) - 1;
        var other = filled[bucket(next, arrayLength(&filled))];
        while (other != NONE && steps < MOST_STEPS) {
            steps++;
            // Cells may share a bucket.
            if (other != i && all(found[other].cell.xyz == next)) {
                sum += vec4<i32>(round(push_by(i, other) * FINE));
            }
            other = before[other];
        }
    }
    return vec4<f32>(sum) / FINE;
}

// Moves each vertex by the mean of its pushes.
@compute @workgroup_size(64)
fn push(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= arrayLength(&places)) {
        return;
    }
    var position = now[i].xyz;
    if (places[i].position.w != 0.0) {
        let sum = pushes(i);
        let left = select(0.0, vectors[SHARE], FADES);
        let half = 0.5 * (1.0 - left * left) * GAP;
        position += sum.xyz * (half * places[i].compared.w / max(sum.w, 1.0));
    }
    after[i] = vec4<f32>(position, 0.0);
}
