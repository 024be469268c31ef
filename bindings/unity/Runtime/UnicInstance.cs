using System;
using Unic.Native;
using UnityEngine;

namespace Unic
{
    /// <summary>
    /// One garment in motion in the native library, in Unity's axes. One thread at a time.
    /// </summary>
    public sealed unsafe class UnicInstance : IDisposable
    {
        private readonly InstanceHandle handle;
        private readonly int jointCount;
        private readonly UnicMeshInfo garment;
        private readonly UnicMeshInfo body;

        /// <summary>Makes a garment at rest in the model's rest pose.</summary>
        /// <exception cref="UnicException">The settings are not accepted.</exception>
        public UnicInstance(LoadedModel model, InstanceSettings settings)
        {
            jointCount = model.JointCount;
            UnicOptions options;
            NativeText.Check(NativeMethods.unic_options_init(&options, (uint)sizeof(UnicOptions)));
            options.precision = settings.precision;
            options.precisionError = settings.precisionError;
            options.sampling = settings.sampling;
            options.intersection = settings.intersection;
            options.threads = settings.threads;
            options.threadCount = (uint)settings.threadCount;
            options.axes = UnicAxes.Unity;
            options.vertexLayout = UnicVertexLayout.Split;
            // A character of twice the size has units of half a metre of the model's.
            if (settings.characterScale > 0f) options.metresPerUnit = 1f / settings.characterScale;
            IntPtr instance = IntPtr.Zero;
            NativeText.Check(NativeMethods.unic_instance_create(model.handle, &options, &instance));
            handle = new InstanceHandle(instance);
            try
            {
                garment = MeshInfo(UnicMesh.Garment);
                body = MeshInfo(UnicMesh.Body);
            }
            catch
            {
                handle.Dispose();
                throw;
            }
        }

        /// <summary>Number of vertices of the garment, with copies at texture seams.</summary>
        public int VertexCount => (int)garment.vertexCount;

        /// <summary>Number of vertices of the body, with copies at texture seams.</summary>
        public int BodyVertexCount => (int)body.vertexCount;

        /// <summary>Whether a mesh has texture coordinates.</summary>
        public bool HasUvs(UnicMesh mesh)
        {
            return Info(mesh).hasUvs != 0;
        }

        /// <summary>Number format that the networks calculate in.</summary>
        public UnicPrecision Precision
        {
            get
            {
                uint precision;
                NativeText.Check(NativeMethods.unic_instance_precision(handle, &precision, null));
                return (UnicPrecision)precision;
            }
        }

        /// <summary>Whether F32, which is exact, is faster than the number format on this processor.</summary>
        public bool IsSlowerThanF32
        {
            get
            {
                uint isSlower;
                NativeText.Check(NativeMethods.unic_instance_precision(handle, null, &isSlower));
                return isSlower != 0;
            }
        }

        /// <summary>Begins a sequence at rest: at the first frame, and after a teleport.</summary>
        /// <param name="pose">Pose of the first frame.</param>
        /// <param name="around">Ground and air.</param>
        /// <param name="vertices">VertexCount vertices that get the garment, or null.</param>
        public void Reset(RigPose pose, Surroundings around, GarmentVertex* vertices)
        {
            fixed (Quaternion* rotations = pose.rotations)
            {
                UnicPose native = Pose(pose, rotations);
                UnicStepInput input = Input(&native, around);
                UnicVertices to = Vertices(vertices, VertexCount);
                NativeText.Check(NativeMethods.unic_instance_reset(handle, &input, OrNull(&to)));
            }
        }

        /// <summary>Begins a sequence at rest, and shows nothing yet.</summary>
        public void Reset(RigPose pose, Surroundings around)
        {
            Reset(pose, around, null);
        }

        /// <summary>Advances by one tick, and shows nothing yet.</summary>
        public void Step(RigPose pose, Surroundings around)
        {
            Step(pose, around, null);
        }

        /// <summary>Writes the garment between the last two ticks to an array.</summary>
        /// <exception cref="UnicException">The array has not VertexCount items.</exception>
        public void Display(RigPose pose, float share, GarmentVertex[] vertices)
        {
            if (vertices.Length != VertexCount)
                throw new UnicException("expected " + VertexCount + " vertices, found " + vertices.Length);
            fixed (GarmentVertex* to = vertices) Display(pose, share, to);
        }

        /// <summary>Advances by one tick to a new pose. Allocates nothing.</summary>
        /// <param name="pose">Pose of this tick.</param>
        /// <param name="around">Ground and air.</param>
        /// <param name="vertices">VertexCount vertices that get the garment, or null.</param>
        public void Step(RigPose pose, Surroundings around, GarmentVertex* vertices)
        {
            fixed (Quaternion* rotations = pose.rotations)
            {
                UnicPose native = Pose(pose, rotations);
                UnicStepInput input = Input(&native, around);
                UnicVertices to = Vertices(vertices, VertexCount);
                NativeText.Check(NativeMethods.unic_instance_step(handle, &input, OrNull(&to)));
            }
        }

        /// <summary>Writes the garment between the last two ticks, on the displayed pose.</summary>
        /// <param name="pose">Pose of the displayed frame.</param>
        /// <param name="share">Way from the tick before the last one, 0, to the last one, 1.</param>
        /// <param name="vertices">VertexCount vertices that get the garment.</param>
        public void Display(RigPose pose, float share, GarmentVertex* vertices)
        {
            fixed (Quaternion* rotations = pose.rotations)
            {
                UnicPose native = Pose(pose, rotations);
                UnicVertices to = Vertices(vertices, VertexCount);
                NativeText.Check(NativeMethods.unic_instance_display(handle, &native, share, &to));
            }
        }

        /// <summary>Writes the body in the pose of the last tick.</summary>
        /// <param name="vertices">BodyVertexCount vertices that get the body.</param>
        public void Body(GarmentVertex* vertices)
        {
            UnicVertices to = Vertices(vertices, BodyVertexCount);
            NativeText.Check(NativeMethods.unic_instance_body(handle, &to));
        }

        internal void SetColliders(UnicCollider[] colliders, int count)
        {
            fixed (UnicCollider* first = colliders)
                NativeText.Check(NativeMethods.unic_instance_set_colliders(handle, first, (UIntPtr)count));
        }

        /// <summary>Three vertex indices a triangle, clockwise from outside as Unity wants them.</summary>
        public int[] Faces(UnicMesh mesh)
        {
            int[] faces = new int[3 * Info(mesh).faceCount];
            fixed (int* first = faces)
                NativeText.Check(NativeMethods.unic_instance_mesh_faces(handle, mesh, (uint*)first,
                    (UIntPtr)Info(mesh).faceCount));
            return faces;
        }

        /// <summary>Texture coordinates of the vertices, v upwards.</summary>
        public Vector2[] Uvs(UnicMesh mesh)
        {
            Vector2[] uvs = new Vector2[Info(mesh).vertexCount];
            fixed (Vector2* first = uvs)
                NativeText.Check(NativeMethods.unic_instance_mesh_uvs(handle, mesh, (float*)first, UIntPtr.Zero,
                    (UIntPtr)uvs.Length));
            return uvs;
        }

        /// <summary>Vertex of the model for each vertex: the first ones are its own, copies follow.</summary>
        public int[] Sources(UnicMesh mesh)
        {
            int[] sources = new int[Info(mesh).vertexCount];
            fixed (int* first = sources)
                NativeText.Check(NativeMethods.unic_instance_mesh_sources(handle, mesh, (uint*)first,
                    (UIntPtr)sources.Length));
            return sources;
        }

        /// <summary>Positions of the joints in the rest pose.</summary>
        public Vector3[] RestJoints()
        {
            Vector3[] positions = new Vector3[jointCount];
            fixed (Vector3* first = positions)
                NativeText.Check(NativeMethods.unic_instance_rest_joints(handle, (float*)first, null,
                    (UIntPtr)jointCount));
            return positions;
        }

        /// <summary>Everything that the next step depends on, but for colliders and settings.</summary>
        public byte[] Save()
        {
            UIntPtr size;
            NativeText.Check(NativeMethods.unic_instance_save(handle, null, UIntPtr.Zero, &size));
            byte[] state = new byte[(int)size];
            fixed (byte* first = state)
                NativeText.Check(NativeMethods.unic_instance_save(handle, first, size, &size));
            return state;
        }

        /// <summary>Continues a saved state of the same model, whose settings may have been others.</summary>
        public void Restore(byte[] state)
        {
            fixed (byte* first = state)
                NativeText.Check(NativeMethods.unic_instance_restore(handle, first, (UIntPtr)state.Length, null));
        }

        /// <summary>Ends the garment.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        private UnicMeshInfo Info(UnicMesh mesh)
        {
            return mesh == UnicMesh.Garment ? garment : body;
        }

        private UnicMeshInfo MeshInfo(UnicMesh mesh)
        {
            UnicMeshInfo info = new UnicMeshInfo { size = (uint)sizeof(UnicMeshInfo) };
            NativeText.Check(NativeMethods.unic_instance_mesh_info(handle, mesh, &info));
            return info;
        }

        private static UnicPose Pose(RigPose pose, Quaternion* rotations)
        {
            UnicPose native = new UnicPose
            {
                rootKind = UnicRoot.Position,
                rotationKind = UnicRotations.FromRest,
                jointCount = (uint)pose.rotations.Length,
                rotations = (float*)rotations,
            };
            native.root[0] = pose.root.x;
            native.root[1] = pose.root.y;
            native.root[2] = pose.root.z;
            return native;
        }

        private static UnicStepInput Input(UnicPose* pose, Surroundings around)
        {
            UnicStepInput input = new UnicStepInput
            {
                size = (uint)sizeof(UnicStepInput),
                groundHeight = around.groundHeight,
                pose = pose,
            };
            input.wind[0] = around.wind.x;
            input.wind[1] = around.wind.y;
            input.wind[2] = around.wind.z;
            return input;
        }

        private static UnicVertices Vertices(GarmentVertex* vertices, int count)
        {
            float* first = (float*)vertices;
            return new UnicVertices
            {
                positions = first,
                positionStride = (UIntPtr)GarmentVertex.Stride,
                normals = first == null ? null : first + 3,
                normalStride = (UIntPtr)GarmentVertex.Stride,
                count = (UIntPtr)count,
            };
        }

        private static UnicVertices* OrNull(UnicVertices* to)
        {
            return to->positions == null ? null : to;
        }
    }
}
