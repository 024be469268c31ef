/* Plays a motion by the C interface alone, in the model's own axes, as the reference of the tests.
 *
 *     reference MODEL MOTION OUT INTERSECTION
 *
 * MOTION holds the number of frames and of joints (uint32_t), then for each frame of 60 Hz the
 * position of the root and the rotations from rest (float). The model has 30 ticks a second: every
 * second frame is a tick. OUT gets positions and normals of each displayed frame. */

#include "unic.h"

#include <stdio.h>
#include <stdlib.h>

static void must(UnicStatus status, const char *what) {
    if (status == UNIC_STATUS_OK) return;
    fprintf(stderr, "%s: %s: %s\n", what, unic_status_name(status), unic_last_error());
    exit(1);
}

static void expect(int holds, const char *what) {
    if (holds) return;
    fprintf(stderr, "expected %s\n", what);
    exit(1);
}

int main(int count, char **arguments) {
    expect(count == 5, "four arguments");
    UnicModel *model;
    must(unic_model_from_path(arguments[1], &model), "model");
    UnicModelInfo info = {.size = sizeof info};
    must(unic_model_info(model, &info), "info");
    expect(info.fps == 30.0f, "a model of 30 ticks a second");

    FILE *motion = fopen(arguments[2], "rb");
    FILE *out = fopen(arguments[3], "wb");
    expect(motion && out, "files");
    uint32_t sizes[2];
    expect(fread(sizes, sizeof sizes, 1, motion) == 1 && sizes[1] == info.joint_count, "poses of the model");
    size_t frame_floats = 3 + 4 * (size_t)sizes[1];
    float *frame = malloc(frame_floats * sizeof *frame);

    UnicOptions options;
    must(unic_options_init(&options, sizeof options), "options");
    options.intersection = (uint32_t)atoi(arguments[4]);
    options.vertex_layout = UNIC_VERTEX_LAYOUT_SPLIT;
    UnicInstance *instance;
    must(unic_instance_create(model, &options, &instance), "instance");
    UnicMeshInfo mesh = {.size = sizeof mesh};
    must(unic_instance_mesh_info(instance, UNIC_MESH_GARMENT, &mesh), "mesh");
    float *vertices = malloc(6 * sizeof *vertices * mesh.vertex_count);
    expect(frame && vertices, "memory");
    UnicVertices to = {.positions = vertices, .position_stride = 24, .normals = vertices + 3,
                       .normal_stride = 24, .count = mesh.vertex_count};

    for (uint32_t i = 0; i < sizes[0]; i++) {
        expect(fread(frame, sizeof *frame, frame_floats, motion) == frame_floats, "a whole motion");
        UnicPose pose = {.root = {frame[0], frame[1], frame[2]}, .rotation_kind = UNIC_ROTATIONS_FROM_REST,
                         .joint_count = sizes[1], .rotations = frame + 3};
        UnicStepInput input = {.size = sizeof input, .pose = &pose};
        if (i == 0)
            must(unic_instance_reset(instance, &input, NULL), "reset");
        else if (i % 2 == 0)
            must(unic_instance_step(instance, &input, NULL), "step");
        must(unic_instance_display(instance, &pose, i % 2 == 0 ? 0.0f : 0.5f, &to), "display");
        expect(fwrite(vertices, 24, mesh.vertex_count, out) == mesh.vertex_count, "room on the disk");
    }
    expect(fclose(out) == 0, "a written file");
    fclose(motion);
    must(unic_instance_release(instance), "release");
    must(unic_model_release(model), "release");
    free(frame);
    free(vertices);
    return 0;
}
