using System;
using Unic.Native;
using UnityEngine;

namespace Unic
{
    /// <summary>A model in the native library, with its constants. All threads may use it.</summary>
    public sealed unsafe class LoadedModel : IDisposable
    {
        internal readonly ModelHandle handle;
        private readonly UnicModelInfo info;
        private Vector3[] restJoints;

        /// <summary>Name for messages.</summary>
        public readonly string name;

        /// <summary>Names of the joints, in the model's order.</summary>
        public readonly string[] jointNames;

        /// <summary>Index of each joint's parent, -1 for the root.</summary>
        public readonly int[] jointParents;

        /// <summary>Reads a model from the bytes of a .unic file.</summary>
        /// <exception cref="UnicException">The bytes are not a model, or the library is missing.</exception>
        public LoadedModel(string name, byte[] bytes)
        {
            UnicLibrary.Require();
            this.name = name;
            IntPtr model = IntPtr.Zero;
            fixed (byte* first = bytes)
                NativeText.Check(NativeMethods.unic_model_from_bytes(first, (UIntPtr)bytes.Length, &model));
            handle = new ModelHandle(model);
            try
            {
                UnicModelInfo read = new UnicModelInfo { size = (uint)sizeof(UnicModelInfo) };
                NativeText.Check(NativeMethods.unic_model_info(handle, &read));
                info = read;
                jointNames = ReadJointNames();
                jointParents = new int[JointCount];
                fixed (int* parents = jointParents)
                    NativeText.Check(NativeMethods.unic_model_joint_parents(handle, parents, (UIntPtr)JointCount));
            }
            catch
            {
                handle.Dispose();
                throw;
            }
        }

        /// <summary>Number of joints.</summary>
        public int JointCount => (int)info.jointCount;

        /// <summary>Index of the root joint.</summary>
        public int RootJoint => (int)info.rootJoint;

        /// <summary>Number of vertices of the garment, without copies at texture seams.</summary>
        public int VertexCount => (int)info.vertexCount;

        /// <summary>Number of triangles of the garment.</summary>
        public int FaceCount => (int)info.faceCount;

        /// <summary>Number of vertices of the body, without copies.</summary>
        public int BodyVertexCount => (int)info.bodyVertexCount;

        /// <summary>Ticks a second.</summary>
        public float Fps => info.fps;

        /// <summary>Positions of the joints in the rest pose, metres, in Unity's axes.</summary>
        public Vector3[] RestJoints
        {
            get
            {
                if (restJoints != null) return restJoints;
                using (UnicInstance instance = new UnicInstance(this, InstanceSettings.Default))
                    restJoints = instance.RestJoints();
                return restJoints;
            }
        }

        /// <summary>Ends the use of the model. Its instances live on.</summary>
        public void Dispose()
        {
            handle.Dispose();
        }

        private string[] ReadJointNames()
        {
            string[] names = new string[JointCount];
            for (uint joint = 0; joint < names.Length; joint++)
            {
                byte* text = null;
                NativeText.Check(NativeMethods.unic_model_joint_name(handle, joint, &text));
                names[joint] = NativeText.Read(text);
            }
            return names;
        }
    }
}
