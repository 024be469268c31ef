//{constants}

// Evaluates the deformation field with matrix units: a workgroup takes a tile of vertices through
// all layers.
//
// Hidden activations stay in workgroup memory in f16. A job is SIDE × ROWS outputs at all vertices
// of the tile. A subgroup holds the sums of a job, in f32, as cooperative matrices; weights are
// loaded from their buffer. The elements of cooperative matrices cannot be accessed, so each matrix
// is stored in `staged`, where biases, point inputs and the ReLU are applied. The products with the
// latent vector are in the biases of the layers that read it.
//
// `field::tiles` generates this kernel. It unrolls all accesses to the matrices, which cannot be
// indexed.

struct VertexState {
    // State at t; w is the garment's mask.
    value: vec4<f32>,
    // State at t - 1.
    previous: vec4<f32>,
}

// Weights of hidden inputs, layer after layer, input by input: columns of W.
@group(0) @binding(0) var<storage, read> hidden_weights: array<f16>;
// Weights of point inputs, input by input, of the first and the skip layer; then the rows of the
// head.
@group(0) @binding(1) var<storage, read> edge_weights: array<f32>;
@group(0) @binding(2) var<storage, read> vectors: array<f32>;
@group(0) @binding(3) var<storage, read> inputs: array<f32>;
@group(0) @binding(4) var<storage, read_write> states: array<VertexState>;

// Output n at vertex v of the tile is at n PITCH + v.
var<workgroup> hidden: array<f16, HIDDEN>;
// One matrix of each job, row by row, and one of subgroups without a job.
var<workgroup> staged: array<f32, STAGED>;

@compute @workgroup_size(THREADS)
fn field(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) t: u32,
    @builtin(subgroup_id) subgroup: u32,
) {
    let tile = group.x * LANES;
    // If subgroups are smaller than the device's largest, there are more of them than jobs. The
    // others repeat a job, because matrix operations need uniform control flow, and stage into
    // memory that is not read.
    let row = subgroup % JOBS * ROWS * SIDE;
    let stage = min(subgroup, JOBS) * SIDE * SIDE;
    for (var e = t; e < WIDTH * LANES; e += THREADS) {
        activate(0u, e / LANES, tile, e % LANES, 0.0);
    }
    workgroupBarrier();
    for (var layer = 1u; layer < LAYERS; layer++) {
        let weights = (layer - 1u) * WIDTH * WIDTH + row;
        //{zeros}
        for (var k = 0u; k < WIDTH; k += SIDE) {
            //{products}
        }
        //{outputs}
    }
    for (var lane = t; lane < LANES; lane += THREADS) {
        let i = tile + lane;
        if (i < VERTICES) {
            let state = states[i].value;
            states[i] = VertexState(vec4<f32>(updated(state, head(lane)), state.w), state);
        }
    }
}

// Turns the staged matrices into activations. `first_output` and `first_lane` are the first output
// and vertex of each matrix in its job.
fn activate_staged(layer: u32, tile: u32, first_output: u32, first_lane: u32, t: u32) {
    for (var e = t; e < JOBS * SIDE * SIDE; e += THREADS) {
        let n = e / (SIDE * SIDE) * ROWS * SIDE + first_output + e / SIDE % SIDE;
        activate(layer, n, tile, first_lane + e % SIDE, staged[e]);
    }
}

// Output n of a layer at a vertex of the tile, from the sum of its products with hidden inputs.
fn activate(layer: u32, n: u32, tile: u32, lane: u32, products: f32) {
    var sum = products + vectors[BIASES + layer * WIDTH + n];
    if (layer == 0u || layer == SKIP) {
        let rows = select(INPUTS * WIDTH, 0u, layer == 0u);
        for (var k = 0u; k < INPUTS; k++) {
            sum += edge_weights[rows + k * WIDTH + n] * inputs[k * STRIDE + tile + lane];
        }
    }
    // A number beyond the largest f16 would become infinite.
    hidden[n * PITCH + lane] = f16(clamp(sum, 0.0, LARGEST));
}

// Linear head at one vertex of the tile.
fn head(lane: u32) -> vec3<f32> {
    let biases = BIASES + LAYERS * WIDTH;
    var sum = vec3<f32>(vectors[biases], vectors[biases + 1u], vectors[biases + 2u]);
    for (var n = 0u; n < WIDTH; n++) {
        let x = f32(hidden[n * PITCH + lane]);
        sum.x += edge_weights[HEAD + n] * x;
        sum.y += edge_weights[HEAD + WIDTH + n] * x;
        sum.z += edge_weights[HEAD + 2u * WIDTH + n] * x;
    }
    return sum;
}

//{update}
