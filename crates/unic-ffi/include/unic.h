/* unic: neural garments, the C interface. Made by cbindgen; do not edit.
 *
 * Functions return a UnicStatus; unic_last_error() has the sentence for the last error of the
 * calling thread. A call that fails changes nothing; unic_instance_save alone writes the size that a
 * buffer must have. Models may be used by all threads, an instance by one thread at a time. Positions
 * are in the axes and the unit of the instance's options.
 *
 * The library checks what it can see: null, alignment, counts, strides, numbers. The caller promises
 * that memory is as large as stated and that nobody else changes it during a call.
 */

#ifndef UNIC_H
#define UNIC_H

#include <stddef.h>
#include <stdint.h>

/**
 * Version of this interface. It grows by one when a function or a struct changes so that programs
 * must be compiled again; additions leave it.
 */
#define UNIC_ABI_VERSION 1

/**
 * Result of a call. Codes other than `UNIC_STATUS_OK` come with a text: `unic_last_error`.
 *
 * A call that fails changes nothing, except for `UNIC_STATUS_PANIC`.
 */
enum UnicStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Success.
   */
  UNIC_STATUS_OK = 0,
  /**
   * A pointer that must not be null is null.
   */
  UNIC_STATUS_NULL_POINTER = 1,
  /**
   * A pointer to a struct is not aligned as its type asks.
   */
  UNIC_STATUS_MISALIGNED = 2,
  /**
   * A handle that was never made, or that is released.
   */
  UNIC_STATUS_INVALID_HANDLE = 3,
  /**
   * The instance is in use by another thread, or by a callback of the same call.
   */
  UNIC_STATUS_IN_USE = 4,
  /**
   * A count, a stride or the size of a struct is not the expected one.
   */
  UNIC_STATUS_WRONG_SIZE = 5,
  /**
   * A number that is not accepted: NaN, out of range, a rotation that is not a unit quaternion.
   */
  UNIC_STATUS_INVALID_VALUE = 6,
  /**
   * Bytes that are not a model which this version reads.
   */
  UNIC_STATUS_BAD_MODEL = 7,
  /**
   * A file that cannot be read.
   */
  UNIC_STATUS_CANNOT_READ = 8,
  /**
   * Bytes that are not a saved state of this model.
   */
  UNIC_STATUS_BAD_STATE = 9,
  /**
   * A buffer that is too small for what is written to it.
   */
  UNIC_STATUS_BUFFER_TOO_SMALL = 10,
  /**
   * Threads that the system does not start.
   */
  UNIC_STATUS_OUT_OF_THREADS = 11,
  /**
   * A fault of the library. The instance of the call can only be released.
   */
  UNIC_STATUS_PANIC = 12,
  /**
   * An instance in which an earlier call ended with `UNIC_STATUS_PANIC`.
   */
  UNIC_STATUS_BROKEN = 13,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicStatus UnicStatus;
#else
typedef uint32_t UnicStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Features of a library on a machine. Each is a bit of unic_features.
 */
enum UnicFeature
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint64_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Models are read from paths.
   */
  UNIC_FEATURE_PATHS = 1,
  /**
   * UNIC_THREADS_POOL.
   */
  UNIC_FEATURE_POOL = 2,
  /**
   * This processor has instructions for UNIC_PRECISION_BF16.
   */
  UNIC_FEATURE_BF16_INSTRUCTIONS = 4,
  /**
   * This processor has instructions for UNIC_PRECISION_INT8.
   */
  UNIC_FEATURE_INT8_INSTRUCTIONS = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicFeature UnicFeature;
#else
typedef uint64_t UnicFeature;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Number format of the networks.
 */
enum UnicPrecision
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The fastest one of this processor whose error, as the model's training has measured it, is
   * not above that of single precision by more than precision_error. By the features of the
   * processor and never by timing: a machine gives the same bits on every run.
   */
  UNIC_PRECISION_AUTO = 0,
  /**
   * Single precision.
   */
  UNIC_PRECISION_F32 = 1,
  /**
   * bfloat16.
   */
  UNIC_PRECISION_BF16 = 2,
  /**
   * 16-bit integers.
   */
  UNIC_PRECISION_INT16 = 3,
  /**
   * 8-bit integers.
   */
  UNIC_PRECISION_INT8 = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicPrecision UnicPrecision;
#else
typedef uint32_t UnicPrecision;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Handling of garment vertices inside the body.
 */
enum UnicIntersection
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The rule that the model was made with.
   */
  UNIC_INTERSECTION_MODEL = 0,
  /**
   * Vertices inside the body stay there.
   */
  UNIC_INTERSECTION_OFF = 1,
  /**
   * Rule of the paper: to a distance over the nearest body vertex, in the state.
   */
  UNIC_INTERSECTION_PAPER = 2,
  /**
   * Shown vertices leave the body and the colliders the shortest way. The state stays.
   */
  UNIC_INTERSECTION_ROBUST = 3,
  /**
   * The same, and the state is corrected too. For models that are trained with it.
   */
  UNIC_INTERSECTION_ROBUST_STATE = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicIntersection UnicIntersection;
#else
typedef uint32_t UnicIntersection;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Axes and unit of everything that an instance takes and gives.
 */
enum UnicAxes
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Right-handed, +Y up, the character faces +Z, metres. glTF and Godot have the same.
   */
  UNIC_AXES_MODEL = 0,
  /**
   * Left-handed, +Y up, the character faces +Z, metres.
   */
  UNIC_AXES_UNITY = 1,
  /**
   * Left-handed, +Z up, the character faces +X, centimetres.
   */
  UNIC_AXES_UNREAL = 2,
  /**
   * Right-handed, +Z up, the character faces -Y, metres.
   */
  UNIC_AXES_BLENDER = 3,
  /**
   * Those of custom_axes and metres_per_unit.
   */
  UNIC_AXES_CUSTOM = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicAxes UnicAxes;
#else
typedef uint32_t UnicAxes;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Vertices that are written.
 */
enum UnicVertexLayout
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Those of the model, in its order.
   */
  UNIC_VERTEX_LAYOUT_MODEL = 0,
  /**
   * Those of the model, followed by copies of vertices at texture seams, so that each vertex has
   * one texture coordinate.
   */
  UNIC_VERTEX_LAYOUT_SPLIT = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicVertexLayout UnicVertexLayout;
#else
typedef uint32_t UnicVertexLayout;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Threads that a call works on.
 */
enum UnicThreads
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The calling thread alone.
   */
  UNIC_THREADS_NONE = 0,
  /**
   * The calling thread and workers of the library. Instances with the same thread_count share
   * the workers; a call that finds them at work for another instance runs on its own thread.
   */
  UNIC_THREADS_POOL = 1,
  /**
   * Those of the caller, by parallel_for.
   */
  UNIC_THREADS_CALLER = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicThreads UnicThreads;
#else
typedef uint32_t UnicThreads;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Mesh of an instance.
 */
enum UnicMesh
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * The garment.
   */
  UNIC_MESH_GARMENT = 0,
  /**
   * The character's body.
   */
  UNIC_MESH_BODY = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicMesh UnicMesh;
#else
typedef uint32_t UnicMesh;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Meaning of the root's position in a pose.
 */
enum UnicRoot
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * World position of the root joint.
   */
  UNIC_ROOT_POSITION = 0,
  /**
   * World position of the root joint minus its rest position, as motion files of SMPL have it.
   */
  UNIC_ROOT_TRANSLATION = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicRoot UnicRoot;
#else
typedef uint32_t UnicRoot;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Meaning of the rotations in a pose.
 */
enum UnicRotations
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Relative to the parent joint; that of the root relative to the world. Of joints whose own
   * axes are those of the model, mirrored as the world is.
   */
  UNIC_ROTATIONS_LOCAL = 0,
  /**
   * In the world, of the same joints.
   */
  UNIC_ROTATIONS_WORLD = 1,
  /**
   * In the world, from the rest pose: those of skinning matrices, such as bone-to-world times
   * bind pose. They do not depend on the axes of the joints, so that this is the one for rigs
   * which a tool has exported.
   */
  UNIC_ROTATIONS_FROM_REST = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicRotations UnicRotations;
#else
typedef uint32_t UnicRotations;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Shape of a collider.
 */
enum UnicShape
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  /**
   * Everything behind the plane through `a` that faces `b`. For the ground, `b` is above `a`.
   */
  UNIC_SHAPE_HALF_SPACE = 0,
  /**
   * Ball around `a`.
   */
  UNIC_SHAPE_SPHERE = 1,
  /**
   * Capsule with an axis from `a` to `b`.
   */
  UNIC_SHAPE_CAPSULE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum UnicShape UnicShape;
#else
typedef uint32_t UnicShape;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * One garment in motion. One thread at a time may use it; another one gets UNIC_STATUS_IN_USE.
 *
 * A handle, not a pointer: it is never dereferenced.
 */
typedef struct UnicInstance UnicInstance;

/**
 * A trained garment of a character. It does not change, and all threads may use it.
 *
 * A handle, not a pointer: it is never dereferenced.
 */
typedef struct UnicModel UnicModel;

/**
 * Sizes and constants of a model.
 */
typedef struct UnicModelInfo {
  /**
   * Size of the struct in bytes, set by the caller.
   */
  uint32_t size;
  /**
   * Number of joints of the character.
   */
  uint32_t joint_count;
  /**
   * Index of the root joint.
   */
  uint32_t root_joint;
  /**
   * Number of vertices of the garment, without the copies of UNIC_VERTEX_LAYOUT_SPLIT.
   */
  uint32_t vertex_count;
  /**
   * Number of triangles of the garment.
   */
  uint32_t face_count;
  /**
   * Number of vertices of the body, without copies.
   */
  uint32_t body_vertex_count;
  /**
   * Number of triangles of the body.
   */
  uint32_t body_face_count;
  /**
   * Steps a second.
   */
  float fps;
} UnicModelInfo;

/**
 * Work that parallel_for is given; called with its data.
 */
typedef void (*UnicJob)(void *data);

/**
 * Callback that runs a job on the caller's threads: calls `job(data)` up to `jobs` times, in
 * parallel where it can.
 *
 * It may call the job less often or more often, and return early: the calling thread does what is
 * left. A job that is called after parallel_for has returned takes part in the work of the moment; if
 * there is none, or the instance is released, it does nothing. `data` is a number, not memory. The
 * callback must not throw. It is called on the thread that steps the instance. A second
 * callback, to wait for the jobs, is not needed: the library itself waits for those that have begun.
 * Jobs wait for each other without sleeping, so the threads must have the same priority.
 */
typedef void (*UnicParallelFor)(void *context, uint32_t jobs, UnicJob job, void *data);

/**
 * Options of an instance. unic_options_init sets the defaults. Zero is the default of every option.
 */
typedef struct UnicOptions {
  /**
   * Size of the struct in bytes. unic_options_init sets it.
   */
  uint32_t size;
  /**
   * A UnicPrecision.
   */
  uint32_t precision;
  /**
   * Share of the vertices at which the networks are evaluated, above 0 to 1; the others are
   * interpolated. For fine meshes and distant characters. 0, the default: that of the model's
   * file, which is 1 unless it was made for a time budget.
   */
  float sampling;
  /**
   * A UnicIntersection.
   */
  uint32_t intersection;
  /**
   * Distance that intersection handling keeps, in metres whatever the unit. 0, the default: the
   * usual one, 0.003 for the robust rules and 0.005 for the paper's. Where a strain projection
   * sweeps the garment after the handling, vertices keep at least half of it.
   */
  float intersection_distance_m;
  /**
   * A UnicAxes.
   */
  uint32_t axes;
  /**
   * For UNIC_AXES_CUSTOM: the number, from 1, of the caller's axis that points to the character's
   * left, up and ahead, in this order; negative if it points the other way. Unity: -1, 2, 3.
   * Zeros, the default: 1, 2, 3.
   */
  int32_t custom_axes[3];
  /**
   * Metres of a unit of the caller, 1e-6 to 1e6; 0, the default: that of the axes.
   */
  float metres_per_unit;
  /**
   * A UnicVertexLayout.
   */
  uint32_t vertex_layout;
  /**
   * A UnicThreads.
   */
  uint32_t threads;
  /**
   * Number of threads that work at the same time, the calling one included, at most 256. 0: as
   * many as the machine has processors, at most 256.
   */
  uint32_t thread_count;
  /**
   * Share, 0 to 1, by which the error that UNIC_PRECISION_AUTO chooses by may exceed that of
   * single precision. 0, the default: 0.01.
   */
  float precision_error;
  /**
   * For UNIC_THREADS_CALLER.
   */
  UnicParallelFor parallel_for;
  /**
   * First argument of parallel_for.
   */
  void *parallel_context;
} UnicOptions;

/**
 * Ground or prop that the robust intersection rules keep the garment out of, in the instance's
 * axes and unit.
 */
typedef struct UnicCollider {
  /**
   * A UnicShape.
   */
  uint32_t shape;
  /**
   * Radius of a ball or a capsule.
   */
  float radius;
  /**
   * First point.
   */
  float a[3];
  /**
   * Second point.
   */
  float b[3];
} UnicCollider;

/**
 * Pose of the character. Joints are in the model's order, without scale.
 */
typedef struct UnicPose {
  /**
   * Position of the root, in the instance's axes and unit.
   */
  float root[3];
  /**
   * A UnicRoot.
   */
  uint32_t root_kind;
  /**
   * A UnicRotations.
   */
  uint32_t rotation_kind;
  /**
   * Number of rotations, which is the number of joints.
   */
  uint32_t joint_count;
  /**
   * First of the unit quaternions x, y, z, w.
   */
  const float *rotations;
  /**
   * Bytes from the start of a quaternion to the next; 0 for 16.
   */
  size_t rotation_stride;
} UnicPose;

/**
 * Input of a step. Fields that are zero are off.
 */
typedef struct UnicStepInput {
  /**
   * Size of the struct in bytes, set by the caller.
   */
  uint32_t size;
  /**
   * Height of the ground under the character, upwards, in the instance's unit.
   */
  float ground_height;
  /**
   * Velocity of the air, in the instance's axes, units a second.
   */
  float wind[3];
  /**
   * Zero.
   */
  uint32_t reserved;
  /**
   * Pose of this step.
   */
  const struct UnicPose *pose;
  /**
   * Pose of the next step where it is known, or null. Only models of preset `paper` read it.
   */
  const struct UnicPose *next_pose;
} UnicStepInput;

/**
 * Buffers that vertices are written to, in the caller's memory.
 */
typedef struct UnicVertices {
  /**
   * First position: three floats, in the instance's axes and unit. Null if not wanted.
   */
  float *positions;
  /**
   * Bytes from the start of a position to the next; 0 for 12.
   */
  size_t position_stride;
  /**
   * First unit normal: three floats. Null if not wanted.
   */
  float *normals;
  /**
   * Bytes from the start of a normal to the next; 0 for 12.
   */
  size_t normal_stride;
  /**
   * Number of vertices, which must be that of the mesh in the instance's layout.
   */
  size_t count;
} UnicVertices;

/**
 * Sizes of a mesh in the layout of an instance.
 */
typedef struct UnicMeshInfo {
  /**
   * Size of the struct in bytes, set by the caller.
   */
  uint32_t size;
  /**
   * Number of vertices.
   */
  uint32_t vertex_count;
  /**
   * Number of triangles.
   */
  uint32_t face_count;
  /**
   * 1 if the mesh has texture coordinates, otherwise 0.
   */
  uint32_t has_uvs;
} UnicMeshInfo;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Version of the interface that the library has. Compare it with UNIC_ABI_VERSION of the header.
 */
uint32_t unic_abi_version(void);

/**
 * Version of the library, such as `0.1.0`. Never null.
 */
const char *unic_version(void);

/**
 * Features of the library on this machine: a sum of values of UnicFeature. Unknown ones are of
 * later versions.
 */
uint64_t unic_features(void);

/**
 * Name of the instruction set that a UnicPrecision runs on here, such as `avx512`. Null for
 * UNIC_PRECISION_AUTO and for an unknown precision.
 */
const char *unic_instructions(uint32_t precision);

/**
 * Name of a status in words, such as `wrong size`. Never null; lives as long as the library.
 */
const char *unic_status_name(uint32_t status);

/**
 * Text of the last error on the calling thread: one sentence in English, in UTF-8.
 *
 * Empty before the first error, never null. Calls that succeed leave it. The pointer is valid
 * until the next error on the same thread.
 */
const char *unic_last_error(void);

/**
 * Reads a model from the bytes of its file, which may be freed afterwards.
 *
 * `model` gets the handle, which unic_model_release ends.
 */
UnicStatus unic_model_from_bytes(const void *bytes, size_t length, struct UnicModel **model);

/**
 * Reads a model from a file. `path` is in UTF-8.
 */
UnicStatus unic_model_from_path(const char *path, struct UnicModel **model);

/**
 * Adds an owner to a model, who calls unic_model_release too.
 */
UnicStatus unic_model_retain(const struct UnicModel *model);

/**
 * Ends the use of a model by one owner. Its instances live on.
 */
UnicStatus unic_model_release(const struct UnicModel *model);

/**
 * Writes the sizes of a model. The caller sets `info->size` first.
 */
UnicStatus unic_model_info(const struct UnicModel *model, struct UnicModelInfo *info);

/**
 * Writes the name of a joint. The text lives as long as the model's handle.
 */
UnicStatus unic_model_joint_name(const struct UnicModel *model, uint32_t joint, const char **name);

/**
 * Writes the parent of each joint, -1 for the root. `count` is the number of joints.
 */
UnicStatus unic_model_joint_parents(const struct UnicModel *model, int32_t *parents, size_t count);

/**
 * Sets the defaults. `size` is `sizeof(UnicOptions)` of the caller.
 */
UnicStatus unic_options_init(struct UnicOptions *options, uint32_t size);

/**
 * Makes an instance of a model, at rest in the rest pose. Null options are the defaults.
 *
 * `instance` gets the handle, which unic_instance_release ends. The first instance with a precision
 * or a sampling packs the model for it, which takes longer.
 */
UnicStatus unic_instance_create(const struct UnicModel *model,
                                const struct UnicOptions *options,
                                struct UnicInstance **instance);

/**
 * Ends an instance, and returns at once. A call on another thread that is at work with it goes on:
 * its buffers, and the context of parallel_for, must stay until it has returned.
 */
UnicStatus unic_instance_release(const struct UnicInstance *instance);

/**
 * Writes the precision of an instance, which UNIC_PRECISION_AUTO has chosen or the caller, and
 * whether single precision, which is exact, is faster here: 1, else 0. Either place may be null.
 */
UnicStatus unic_instance_precision(const struct UnicInstance *instance,
                                   uint32_t *precision,
                                   uint32_t *is_slower_than_f32);

/**
 * Sets ground and props, from the next step on; resets keep them. At most 1024.
 *
 * UNIC_INTERSECTION_ROBUST moves shown vertices out of them. Other rules ignore them.
 */
UnicStatus unic_instance_set_colliders(const struct UnicInstance *instance,
                                       const struct UnicCollider *colliders,
                                       size_t count);

/**
 * Begins a sequence: at its first frame, or at the frame after a cut or a teleport.
 *
 * The garment starts at rest in the mean shape of training. `vertices` gets it; null if not wanted.
 */
UnicStatus unic_instance_reset(const struct UnicInstance *instance,
                               const struct UnicStepInput *input,
                               const struct UnicVertices *vertices);

/**
 * Begins a sequence with given positions, of a simulation or a cache.
 *
 * `positions` are three floats for each of `count` vertices of the model, without the copies of
 * UNIC_VERTEX_LAYOUT_SPLIT, `stride` bytes apart (0 for 12).
 */
UnicStatus unic_instance_reset_to(const struct UnicInstance *instance,
                                  const struct UnicStepInput *input,
                                  const float *positions,
                                  size_t stride,
                                  size_t count,
                                  const struct UnicVertices *vertices);

/**
 * Advances the garment by one tick, 1 / fps seconds of the model, to a new pose.
 *
 * `vertices` gets the garment; null if not wanted. After the first few steps, a step allocates
 * nothing. It gives the same bytes on any threads.
 */
UnicStatus unic_instance_step(const struct UnicInstance *instance,
                              const struct UnicStepInput *input,
                              const struct UnicVertices *vertices);

/**
 * Writes the garment between the last two ticks, on the displayed pose, for displays of any rate.
 *
 * `share` is the way from the tick before the last one (0) to the last one (1); numbers outside
 * that range are clamped. Changes nothing.
 */
UnicStatus unic_instance_display(const struct UnicInstance *instance,
                                 const struct UnicPose *pose,
                                 float share,
                                 const struct UnicVertices *vertices);

/**
 * Writes the body in the pose of the last step.
 */
UnicStatus unic_instance_body(const struct UnicInstance *instance,
                              const struct UnicVertices *vertices);

/**
 * Writes the sizes of a UnicMesh. The caller sets `info->size` first.
 */
UnicStatus unic_instance_mesh_info(const struct UnicInstance *instance,
                                   uint32_t mesh,
                                   struct UnicMeshInfo *info);

/**
 * Writes three vertex indices for each of `count` triangles.
 *
 * They go counter-clockwise seen from outside in right-handed axes, and clockwise in left-handed
 * ones, as Unity and Unreal want them.
 */
UnicStatus unic_instance_mesh_faces(const struct UnicInstance *instance,
                                    uint32_t mesh,
                                    uint32_t *faces,
                                    size_t count);

/**
 * Writes a texture coordinate, u and v (upwards), for each of `count` vertices, `stride` bytes
 * apart (0 for 8).
 *
 * With UNIC_VERTEX_LAYOUT_MODEL a vertex at a texture seam has several, and the first one is
 * written.
 */
UnicStatus unic_instance_mesh_uvs(const struct UnicInstance *instance,
                                  uint32_t mesh,
                                  float *uvs,
                                  size_t stride,
                                  size_t count);

/**
 * Writes the vertex of the model for each of `count` vertices. The first ones are the model's own;
 * after them come the copies of UNIC_VERTEX_LAYOUT_SPLIT.
 */
UnicStatus unic_instance_mesh_sources(const struct UnicInstance *instance,
                                      uint32_t mesh,
                                      uint32_t *sources,
                                      size_t count);

/**
 * Writes the world positions and rotations of the joints in the rest pose.
 *
 * `positions` are three floats and `rotations` quaternions x, y, z, w, for each of `count` joints,
 * without gaps. Either may be null.
 */
UnicStatus unic_instance_rest_joints(const struct UnicInstance *instance,
                                     float *positions,
                                     float *rotations,
                                     size_t count);

/**
 * Saves everything that the next step depends on. Colliders and options are not part of it.
 *
 * `size` gets the number of bytes, also with UNIC_STATUS_BUFFER_TOO_SMALL: the only value that a
 * call writes when it fails. With null `bytes` nothing else is written; otherwise `capacity` must be
 * as large. The size may grow by some bytes over many steps.
 */
UnicStatus unic_instance_save(const struct UnicInstance *instance,
                              void *bytes,
                              size_t capacity,
                              size_t *size);

/**
 * Restores a saved state of the same model, whose instance may have had other options.
 *
 * Later steps give the same bytes as they gave after it. `vertices` gets the garment; null if not
 * wanted. unic_instance_display shows the restored tick until the next step.
 */
UnicStatus unic_instance_restore(const struct UnicInstance *instance,
                                 const void *state,
                                 size_t size,
                                 const struct UnicVertices *vertices);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* UNIC_H */
