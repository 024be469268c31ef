#include "unic.h"
#include <stdio.h>
#include <stdlib.h>

static void must(UnicStatus status) {
    if (status == UNIC_STATUS_OK) return;
    fprintf(stderr, "%s: %s\n", unic_status_name(status), unic_last_error());
    exit(1);
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    UnicModel *model;                                    /* one for all characters and threads */
    must(unic_model_from_path(arguments[1], &model));
    UnicModelInfo info = {.size = sizeof info};
    must(unic_model_info(model, &info));

    UnicOptions options;
    must(unic_options_init(&options, sizeof options));
    options.axes = UNIC_AXES_UNITY;                      /* of everything that goes in and out */
    UnicInstance *shirt;                                 /* one for each character */
    must(unic_instance_create(model, &options, &shirt));

    /* Rotations of the joints from the rest pose, in the model's order: x, y, z, w. */
    float (*rotations)[4] = calloc(info.joint_count, sizeof *rotations);
    float (*vertices)[6] = malloc(info.vertex_count * sizeof *vertices);
    if (!rotations || !vertices) return 1;
    for (uint32_t joint = 0; joint < info.joint_count; joint++) rotations[joint][3] = 1.0f;
    UnicPose pose = {.root = {0.0f, 0.9f, 0.0f}, .rotation_kind = UNIC_ROTATIONS_FROM_REST,
                     .joint_count = info.joint_count, .rotations = *rotations};
    UnicStepInput input = {.size = sizeof input, .pose = &pose};
    UnicVertices to = {.positions = vertices[0], .position_stride = sizeof *vertices,
                       .normals = vertices[0] + 3, .normal_stride = sizeof *vertices,
                       .count = info.vertex_count};
    must(unic_instance_reset(shirt, &input, &to));       /* first frame, cuts, teleports */
    for (int tick = 0; tick < (int)info.fps; tick++)     /* info.fps times a second */
        must(unic_instance_step(shirt, &input, &to));
    printf("%u vertices, the first at height %.3f m\n", (unsigned)info.vertex_count, vertices[0][1]);
    must(unic_instance_release(shirt));
    must(unic_model_release(model));
    free(rotations);
    free(vertices);
    return 0;
}
