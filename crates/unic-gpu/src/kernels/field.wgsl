//{constants}

// Evaluates the deformation field: a workgroup takes a tile of vertices through all layers.
//
// Hidden activations stay in workgroup memory, and weights pass through it in chunks of a few
// inputs. Each invocation keeps 8 outputs of 8 vertices in registers: two vectors of four outputs
// (columns n and n + COLUMNS of the weights) by two vectors of four vertices (m and m + LINES of
// the tile). The products with the latent vector are in the biases of the layers that read it.
//
// `field::blocks` generates this kernel. It unrolls all accesses to the sums: an array with a
// computed index would not stay in registers. `Real` is the type of weights and hidden activations.

struct VertexState {
    // State at t; w is the garment's mask.
    value: vec4<f32>,
    // State at t - 1.
    previous: vec4<f32>,
}

// Weights of hidden inputs, layer after layer, input by input.
@group(0) @binding(0) var<storage, read> hidden_weights: array<vec4<Real>>;
// Weights of point inputs, input by input, of the first and the skip layer; then the rows of the
// head.
@group(0) @binding(1) var<storage, read> edge_weights: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> vectors: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> inputs: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> states: array<VertexState>;

// Vertices 4 q to 4 q + 3 of the tile at input k are at k TILE4 + q.
var<workgroup> hidden: array<vec4<Real>, HIDDEN4>;
// Outputs 4 q to 4 q + 3 of a layer at input k are at k WIDTH4 + q.
var<workgroup> chunk: array<vec4<Real>, CHUNK4>;

@compute @workgroup_size(THREADS)
fn field(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) t: u32) {
    let tile = group.x * TILE4;
    //{mapping}
    for (var layer = 0u; layer < LAYERS; layer++) {
        let bias0 = vectors[BIASES4 + layer * WIDTH4 + n];
        let bias1 = vectors[BIASES4 + layer * WIDTH4 + n + COLUMNS];
        //{biases}
        if (layer == 0u || layer == SKIP) {
            let rows = select(INPUTS * WIDTH4, 0u, layer == 0u);
            for (var k = 0u; k < INPUTS; k++) {
                let w0 = edge_weights[rows + k * WIDTH4 + n];
                let w1 = edge_weights[rows + k * WIDTH4 + n + COLUMNS];
                let x0 = inputs[k * STRIDE4 + tile + m];
                let x1 = inputs[k * STRIDE4 + tile + m + LINES];
                //{edge products}
            }
        }
        if (layer > 0u) {
            var next = (layer - 1u) * WIDTH * WIDTH4 + t;
            //{fetch}
            for (var first = 0u; first < WIDTH; first += CHUNK) {
                workgroupBarrier();
                //{store}
                workgroupBarrier();
                // Loads the next chunk while this one is in use, to hide the latency; after the
                // last chunk it loads any address that exists.
                next = select(t, next + CHUNK4, first + CHUNK < WIDTH);
                //{fetch}
                //{zeros}
                for (var k = 0u; k < CHUNK; k++) {
                    let w0 = chunk[k * WIDTH4 + n];
                    let w1 = chunk[k * WIDTH4 + n + COLUMNS];
                    let x0 = hidden[(first + k) * TILE4 + m];
                    let x1 = hidden[(first + k) * TILE4 + m + LINES];
                    //{products}
                }
                //{totals}
            }
        }
        // Until here invocations read the previous layer's activations.
        workgroupBarrier();
        //{activations}
    }
    workgroupBarrier();
    for (var lane = t; lane < 4u * TILE4; lane += THREADS) {
        let i = 4u * tile + lane;
        if (i < VERTICES) {
            let state = states[i].value;
            states[i] = VertexState(vec4<f32>(updated(state, head(lane)), state.w), state);
        }
    }
}

// Linear head at one vertex of the tile.
fn head(lane: u32) -> vec3<f32> {
    var sum = vectors[BIASES4 + LAYERS * WIDTH4].xyz;
    for (var q = 0u; q < WIDTH4; q++) {
        let row = 4u * q * TILE4 + lane / 4u;
        let x = vec4<f32>(
            f32(hidden[row][lane % 4u]),
            f32(hidden[row + TILE4][lane % 4u]),
            f32(hidden[row + 2u * TILE4][lane % 4u]),
            f32(hidden[row + 3u * TILE4][lane % 4u]),
        );
        sum.x += dot(edge_weights[HEAD4 + q], x);
        sum.y += dot(edge_weights[HEAD4 + WIDTH4 + q], x);
        sum.z += dot(edge_weights[HEAD4 + 2u * WIDTH4 + q], x);
    }
    return sum;
}

//{update}
