using System;
using System.Runtime.InteropServices;

namespace Unic.Native
{
    /// <summary>Functions of unic.h. The header describes them.</summary>
    internal static unsafe class NativeMethods
    {
        /// <summary>Version of the interface that this package is written for.</summary>
        internal const uint UNIC_ABI_VERSION = 1;

#if UNITY_IOS && !UNITY_EDITOR
        // iOS has no shared libraries of an app: libunic.a is linked into the player.
        private const string Library = "__Internal";
#else
        private const string Library = "unic";
#endif
        private const CallingConvention C = CallingConvention.Cdecl;

        [DllImport(Library, CallingConvention = C)]
        internal static extern uint unic_abi_version();

        [DllImport(Library, CallingConvention = C)]
        internal static extern byte* unic_version();

        [DllImport(Library, CallingConvention = C)]
        internal static extern ulong unic_features();

        [DllImport(Library, CallingConvention = C)]
        internal static extern byte* unic_instructions(uint precision);

        [DllImport(Library, CallingConvention = C)]
        internal static extern byte* unic_status_name(UnicStatus status);

        [DllImport(Library, CallingConvention = C)]
        internal static extern byte* unic_last_error();

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_from_bytes(void* bytes, UIntPtr length, IntPtr* model);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_from_path(byte* path, IntPtr* model);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_retain(ModelHandle model);

        // Releases take plain numbers: SafeHandle calls them when no reference is left.
        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_release(IntPtr model);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_info(ModelHandle model, UnicModelInfo* info);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_joint_name(ModelHandle model, uint joint, byte** name);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_model_joint_parents(ModelHandle model, int* parents, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_options_init(UnicOptions* options, uint size);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_create(ModelHandle model, UnicOptions* options, IntPtr* instance);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_release(IntPtr instance);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_precision(InstanceHandle instance, uint* precision,
            uint* isSlowerThanF32);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_set_colliders(InstanceHandle instance,
            UnicCollider* colliders, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_reset(InstanceHandle instance, UnicStepInput* input,
            UnicVertices* vertices);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_reset_to(InstanceHandle instance, UnicStepInput* input,
            float* positions, UIntPtr stride, UIntPtr count, UnicVertices* vertices);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_step(InstanceHandle instance, UnicStepInput* input,
            UnicVertices* vertices);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_display(InstanceHandle instance, UnicPose* pose, float share,
            UnicVertices* vertices);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_body(InstanceHandle instance, UnicVertices* vertices);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_mesh_info(InstanceHandle instance, UnicMesh mesh,
            UnicMeshInfo* info);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_mesh_faces(InstanceHandle instance, UnicMesh mesh,
            uint* faces, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_mesh_uvs(InstanceHandle instance, UnicMesh mesh, float* uvs,
            UIntPtr stride, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_mesh_sources(InstanceHandle instance, UnicMesh mesh,
            uint* sources, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_rest_joints(InstanceHandle instance, float* positions,
            float* rotations, UIntPtr count);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_save(InstanceHandle instance, void* bytes, UIntPtr capacity,
            UIntPtr* size);

        [DllImport(Library, CallingConvention = C)]
        internal static extern UnicStatus unic_instance_restore(InstanceHandle instance, void* state, UIntPtr size,
            UnicVertices* vertices);
    }
}
