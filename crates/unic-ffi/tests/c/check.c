/* Contract: the header is C11, and a C program gets the bits that the Rust test expects.
 *
 *     check MODEL POSES OUT
 *
 * POSES holds the number of frames and of joints (uint32_t), then for each frame a translation and
 * the quaternions (float). OUT gets positions and normals of each frame, in a vertex buffer with a
 * stride, and then those of a state that was restored half-way. */

#include "unic.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void must(UnicStatus status, const char *what) {
    if (status != UNIC_STATUS_OK) {
        fprintf(stderr, "%s: %s: %s\n", what, unic_status_name(status), unic_last_error());
        exit(1);
    }
}

static void expect(int holds, const char *what) {
    if (!holds) {
        fprintf(stderr, "expected %s; last error: %s\n", what, unic_last_error());
        exit(1);
    }
}

static void *room(size_t size) {
    void *memory = malloc(size);
    expect(memory != NULL, "memory");
    return memory;
}

/* As an engine has its files: bytes in memory. */
static void *read_file(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    expect(file != NULL, path);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    void *bytes = room(*size);
    expect(fread(bytes, 1, *size, file) == *size, "a file that can be read");
    fclose(file);
    return bytes;
}

/* A vertex buffer as an engine lays it out. */
typedef struct Vertex {
    float position[3];
    float uv[2];
    float normal[3];
} Vertex;

typedef struct Motion {
    uint32_t frames;
    uint32_t joints;
    const float *numbers;
} Motion;

static UnicPose pose_of(const Motion *motion, uint32_t frame) {
    const float *numbers = motion->numbers + (size_t)frame * (3 + 4 * motion->joints);
    UnicPose pose = {
        .root = {numbers[0], numbers[1], numbers[2]},
        .root_kind = UNIC_ROOT_TRANSLATION,
        .rotation_kind = UNIC_ROTATIONS_LOCAL,
        .joint_count = motion->joints,
        .rotations = numbers + 3,
    };
    return pose;
}

static void play(UnicInstance *instance, const Motion *motion, uint32_t frame, const UnicVertices *to) {
    const UnicPose pose = pose_of(motion, frame);
    const UnicStepInput input = {.size = sizeof input, .pose = &pose};
    if (frame == 0)
        must(unic_instance_reset(instance, &input, to), "reset");
    else
        must(unic_instance_step(instance, &input, to), "step");
}

static void write_vertices(FILE *out, const Vertex *vertices, size_t count) {
    for (size_t i = 0; i < count; i++) {
        expect(vertices[i].uv[0] == 0.25f && vertices[i].uv[1] == 0.75f, "untouched bytes in the gaps");
        fwrite(vertices[i].position, sizeof(float), 3, out);
        fwrite(vertices[i].normal, sizeof(float), 3, out);
    }
}

static void check_misuse(UnicModel *model, UnicInstance *instance) {
    UnicModel *none = NULL;
    expect(unic_model_from_bytes("no model", 8, &none) == UNIC_STATUS_BAD_MODEL, "bad model");
    expect(none == NULL, "no handle");
    expect(unic_instance_step(instance, NULL, NULL) == UNIC_STATUS_NULL_POINTER, "null pointer");
    expect(strstr(unic_last_error(), "input") != NULL, "a text that names the input");
    expect(unic_instance_body((UnicInstance *)(void *)model, NULL) == UNIC_STATUS_INVALID_HANDLE, "invalid handle");
    expect(strcmp(unic_status_name(77), "unknown status") == 0, "a name for every number");
    expect(unic_instructions(UNIC_PRECISION_INT8) != NULL && unic_instructions(9) == NULL, "instructions");
    expect((unic_features() & UNIC_FEATURE_POOL) != 0, "a pool");
}

int main(int count, char **arguments) {
    expect(count == 4, "three arguments");
    expect(unic_abi_version() == UNIC_ABI_VERSION, "a library of the header's version");
    expect(strlen(unic_version()) >= 5, "a version");

    size_t size;
    void *bytes = read_file(arguments[1], &size);
    UnicModel *model;
    must(unic_model_from_bytes(bytes, size, &model), "model");
    free(bytes);
    UnicModelInfo info = {.size = sizeof info};
    must(unic_model_info(model, &info), "info");

    size_t motion_size;
    uint32_t *poses = read_file(arguments[2], &motion_size);
    const Motion motion = {poses[0], poses[1], (const float *)(poses + 2)};
    expect(motion.joints == info.joint_count, "poses of the model");

    UnicOptions options;
    must(unic_options_init(&options, sizeof options), "options");
    options.threads = UNIC_THREADS_POOL;
    options.thread_count = 2;
    UnicInstance *instance;
    must(unic_instance_create(model, &options, &instance), "instance");
    UnicMeshInfo mesh = {.size = sizeof mesh};
    must(unic_instance_mesh_info(instance, UNIC_MESH_GARMENT, &mesh), "mesh");
    expect(mesh.vertex_count == info.vertex_count && mesh.face_count == info.face_count, "sizes");
    uint32_t *faces = room(3 * sizeof *faces * mesh.face_count);
    must(unic_instance_mesh_faces(instance, UNIC_MESH_GARMENT, faces, mesh.face_count), "faces");
    free(faces);

    Vertex *vertices = room(sizeof *vertices * mesh.vertex_count);
    for (uint32_t i = 0; i < mesh.vertex_count; i++) {
        vertices[i].uv[0] = 0.25f;
        vertices[i].uv[1] = 0.75f;
    }
    const UnicVertices to = {
        .positions = vertices->position,
        .position_stride = sizeof *vertices,
        .normals = vertices->normal,
        .normal_stride = sizeof *vertices,
        .count = mesh.vertex_count,
    };
    FILE *out = fopen(arguments[3], "wb");
    expect(out != NULL, arguments[3]);
    void *state = NULL;
    size_t state_size = 0;
    for (uint32_t frame = 0; frame < motion.frames; frame++) {
        play(instance, &motion, frame, &to);
        write_vertices(out, vertices, mesh.vertex_count);
        if (frame == motion.frames / 2) {
            must(unic_instance_save(instance, NULL, 0, &state_size), "size of the state");
            state = room(state_size);
            must(unic_instance_save(instance, state, state_size, &state_size), "save");
        }
    }
    must(unic_instance_restore(instance, state, state_size, NULL), "restore");
    for (uint32_t frame = motion.frames / 2 + 1; frame < motion.frames; frame++) {
        play(instance, &motion, frame, &to);
        write_vertices(out, vertices, mesh.vertex_count);
    }
    expect(fclose(out) == 0, "a written file");

    check_misuse(model, instance);
    must(unic_instance_release(instance), "release");
    must(unic_model_release(model), "release");
    expect(unic_model_release(model) == UNIC_STATUS_INVALID_HANDLE, "a released model");
    free(state);
    free(vertices);
    free(poses);
    return 0;
}
