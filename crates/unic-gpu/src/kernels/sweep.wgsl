// Stages of a sweep of the strain projection: a workgroup solves them for its patch of vertices, in
// its own memory. CAPACITY, LANES and STAGE_ENDS are declared in front.

// Work of one workgroup.
struct Group {
    // Place of its first vertex in `vertices`, and their number. It writes the first ones.
    vertices: u32,
    count: u32,
    owned: u32,
    // Number of times that the stages are solved. More than once only where it owns all vertices.
    repeats: u32,
    // Place in `ends` where the first stage of edges starts; each following number is the end of a
    // stage. The same for stencils, which come after the edges.
    edge_ends: u32,
    edge_stages: u32,
    stencil_ends: u32,
    stencil_stages: u32,
}

// Constraints are vectors of four numbers.
//
// Edge: places of both ends in the vertices of the workgroup, 16 bits each; shortest and longest
// length, metres; the first end's share of a correction, the second one takes the rest.
//
// Bending stencil: places of the four vertices, 16 bits each; three coefficients of its sum, all four
// have the sum 0; factor of the sum in the moves; freedom of the four vertices, of which
// 65,535 is 1. The vertices are distinct.
struct Stencil {
    a: vec4<u32>,
    b: vec4<u32>,
}

// Length below which an edge has no direction, metres.
override LEAST_LENGTH: f32;

// Positions before the pass: in `measure_bends` the reference positions, from which stencils smooth.
// They are the predicted ones, the shown ones before intersection handling, or those of the samples
// at the start of a level.
@group(0) @binding(0) var<storage, read> before: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> after: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> groups: array<Group>;
@group(0) @binding(3) var<storage, read> vertices: array<u32>;
@group(0) @binding(4) var<storage, read> ends: array<u32>;
@group(0) @binding(5) var<storage, read> edges: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> stencils: array<Stencil>;
// Sum of each stencil at the reference positions.
@group(0) @binding(7) var<storage, read_write> bends: array<vec4<f32>>;

// Positions of the workgroup's vertices. One array for each coordinate: a vec3 would take 16 bytes.
var<workgroup> xs: array<f32, CAPACITY>;
var<workgroup> ys: array<f32, CAPACITY>;
var<workgroup> zs: array<f32, CAPACITY>;

// Ends of the stages of edges and of stencils, as in `ends`.
var<workgroup> edge_ends: array<u32, STAGE_ENDS>;
var<workgroup> stencil_ends: array<u32, STAGE_ENDS>;

fn position(i: u32) -> vec3<f32> {
    return vec3<f32>(xs[i], ys[i], zs[i]);
}

fn place(i: u32, p: vec3<f32>) {
    xs[i] = p.x;
    ys[i] = p.y;
    zs[i] = p.z;
}

fn low(pair: u32) -> u32 {
    return pair & 0xffffu;
}

fn high(pair: u32) -> u32 {
    return pair >> 16u;
}

fn load(group: Group, lane: u32) {
    for (var i = lane; i < group.count; i += LANES) {
        place(i, before[vertices[group.vertices + i]].xyz);
    }
    for (var i = lane; i <= group.edge_stages; i += LANES) {
        edge_ends[i] = ends[group.edge_ends + i];
    }
    for (var i = lane; i <= group.stencil_stages; i += LANES) {
        stencil_ends[i] = ends[group.stencil_ends + i];
    }
}

// Brings an edge into its limits.
fn project(edge: vec4<u32>) {
    let a = low(edge.x);
    let b = high(edge.x);
    let p = position(a);
    let q = position(b);
    let along = q - p;
    let size = length(along);
    if (size > LEAST_LENGTH) {
        let limits = bitcast<vec2<f32>>(edge.yz);
        let wanted = min(max(size, limits.x), limits.y);
        let correction = along * ((size - wanted) / size);
        let share = bitcast<f32>(edge.w);
        place(a, p + correction * share);
        place(b, q + correction * (share - 1.0));
    }
}

fn places(stencil: Stencil) -> vec4<u32> {
    let pairs = stencil.a.xy;
    return vec4<u32>(low(pairs.x), high(pairs.x), low(pairs.y), high(pairs.y));
}

fn coefficients(stencil: Stencil) -> vec4<f32> {
    let first = bitcast<vec3<f32>>(vec3<u32>(stencil.a.zw, stencil.b.x));
    return vec4<f32>(first, -(first.x + first.y + first.z));
}

// Positions of the vertices of a stencil.
fn corners(v: vec4<u32>) -> mat4x3<f32> {
    return mat4x3<f32>(position(v.x), position(v.y), position(v.z), position(v.w));
}

// Reduces the bending of the moves at a stencil, given its sum at the reference positions.
fn smooth_moves(stencil: Stencil, bend: vec3<f32>) {
    let v = places(stencil);
    let k = coefficients(stencil);
    let p = corners(v);
    let pull = (p * k - bend) * -bitcast<f32>(stencil.b.y);
    let freedom = vec4<f32>(unpack2x16unorm(stencil.b.z), unpack2x16unorm(stencil.b.w));
    let moves = k * freedom;
    place(v.x, p[0] + pull * moves.x);
    place(v.y, p[1] + pull * moves.y);
    place(v.z, p[2] + pull * moves.z);
    place(v.w, p[3] + pull * moves.w);
}

@compute @workgroup_size(LANES)
fn sweep(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let group = groups[id.x];
    load(group, lane);
    workgroupBarrier();
    for (var repeat = 0u; repeat < group.repeats; repeat++) {
        for (var stage = 0u; stage < group.edge_stages; stage++) {
            let end = edge_ends[stage + 1u];
            for (var i = edge_ends[stage] + lane; i < end; i += LANES) {
                project(edges[i]);
            }
            workgroupBarrier();
        }
        for (var stage = 0u; stage < group.stencil_stages; stage++) {
            let end = stencil_ends[stage + 1u];
            for (var i = stencil_ends[stage] + lane; i < end; i += LANES) {
                smooth_moves(stencils[i], bends[i].xyz);
            }
            workgroupBarrier();
        }
    }
    for (var i = lane; i < group.owned; i += LANES) {
        after[vertices[group.vertices + i]] = vec4<f32>(position(i), 0.0);
    }
}

// Computes the sums of the stencils of a pass at the reference positions.
@compute @workgroup_size(LANES)
fn measure_bends(@builtin(workgroup_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let group = groups[id.x];
    load(group, lane);
    workgroupBarrier();
    let end = stencil_ends[group.stencil_stages];
    for (var i = stencil_ends[0] + lane; i < end; i += LANES) {
        let stencil = stencils[i];
        bends[i] = vec4<f32>(corners(places(stencil)) * coefficients(stencil), 0.0);
    }
}
