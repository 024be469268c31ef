// A mesh that keeps what is written to its vertex streams, and refuses what Unity refuses.

using System;
using System.Runtime.InteropServices;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine.Rendering;

namespace UnityEngine.Rendering
{
    [Flags]
    public enum MeshUpdateFlags
    {
        Default = 0, DontValidateIndices = 1, DontResetBoneBounds = 2, DontNotifyMeshUsers = 4, DontRecalculateBounds = 8,
    }

    public enum VertexAttribute { Position, Normal, Tangent, Color, TexCoord0 }
    public enum VertexAttributeFormat { Float32 }
    public enum IndexFormat { UInt16, UInt32 }

    public struct VertexAttributeDescriptor
    {
        public VertexAttribute attribute;
        public int dimension, stream;
        public VertexAttributeDescriptor(VertexAttribute attribute, VertexAttributeFormat format, int dimension, int stream)
        {
            this.attribute = attribute;
            this.dimension = dimension;
            this.stream = stream;
        }
    }
}

namespace UnityEngine
{
    public struct BoneWeight
    {
        public float weight0 { get; set; }
        public float weight1 { get; set; }
        public float weight2 { get; set; }
        public float weight3 { get; set; }
        public int boneIndex0 { get; set; }
        public int boneIndex1 { get; set; }
        public int boneIndex2 { get; set; }
        public int boneIndex3 { get; set; }
    }

    public unsafe class Mesh : Object
    {
        private readonly int[] strides = new int[4];
        private readonly byte[][] streams = new byte[4][];
        private Vector3[] plain = new Vector3[0];
        private int count;

        public int Uploads;
        public bool IsDynamic;
        public int[] Triangles = new int[0];
        public Bounds bounds { get; set; }
        public IndexFormat indexFormat { get; set; }
        public Matrix4x4[] bindposes { get; set; } = new Matrix4x4[0];
        public BoneWeight[] boneWeights { get; set; } = new BoneWeight[0];
        public int vertexCount => count;
        public int[] triangles { get { return Triangles; } set { SetTriangles(value, 0, true); } }
        public Vector3[] vertices { get { return plain; } set { plain = value; count = value.Length; } }
        public void MarkDynamic() { IsDynamic = true; }
        public void RecalculateNormals() { }
        public void RecalculateBounds() { }

        public void SetVertexBufferParams(int vertexCount, params VertexAttributeDescriptor[] attributes)
        {
            count = vertexCount;
            Array.Clear(strides, 0, 4);
            foreach (VertexAttributeDescriptor a in attributes) strides[a.stream] += 4 * a.dimension;
            for (int i = 0; i < 4; i++) streams[i] = new byte[count * strides[i]];
        }

        public void SetVertexBufferData<T>(NativeArray<T> data, int dataStart, int meshBufferStart, int count, int stream,
            MeshUpdateFlags flags) where T : struct
        {
            if (dataStart < 0 || dataStart + count > data.Length) throw new ArgumentOutOfRangeException("dataStart");
            int size = Marshal.SizeOf(typeof(T));
            Write(new IntPtr((byte*)NativeArrayUnsafeUtility.GetUnsafePtr(data) + dataStart * size), size, meshBufferStart, count, stream);
        }

        public void SetVertexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, int stream,
            MeshUpdateFlags flags) where T : struct
        {
            GCHandle pin = GCHandle.Alloc(data, GCHandleType.Pinned);
            try { Write(Marshal.UnsafeAddrOfPinnedArrayElement(data, dataStart), Marshal.SizeOf(typeof(T)), meshBufferStart, count, stream); }
            finally { pin.Free(); }
        }

        private void Write(IntPtr from, int size, int start, int number, int stream)
        {
            if (size != strides[stream])
                throw new ArgumentException("vertices of " + size + " bytes in a stream of " + strides[stream]);
            if (start < 0 || start + number > count) throw new ArgumentOutOfRangeException("meshBufferStart");
            Marshal.Copy(from, streams[stream], start * size, number * size);
            if (stream == 0) Uploads++;
        }

        public void SetTriangles(int[] triangles, int submesh, bool calculateBounds)
        {
            foreach (int vertex in triangles)
                if (vertex < 0 || vertex >= count) throw new ArgumentException("triangle of vertex " + vertex);
            Triangles = triangles;
        }

        /// <summary>Floats of a stream, for tests.</summary>
        public float[] Floats(int stream)
        {
            float[] floats = new float[streams[stream].Length / 4];
            Buffer.BlockCopy(streams[stream], 0, floats, 0, streams[stream].Length);
            return floats;
        }
    }
}

namespace Unity.Collections
{
    public enum Allocator { Persistent = 4 }
    public enum NativeArrayOptions { UninitializedMemory, ClearMemory }

    public unsafe struct NativeArray<T> : IDisposable where T : struct
    {
        internal IntPtr memory;
        private readonly int length;
        // Memory that nobody has disposed.
        public static int Alive;

        public NativeArray(int length, Allocator allocator, NativeArrayOptions options = NativeArrayOptions.ClearMemory)
        {
            this.length = length;
            int size = length * Marshal.SizeOf(typeof(T));
            memory = Marshal.AllocHGlobal(Math.Max(size, 1));
            for (int i = 0; i < size; i++) ((byte*)memory)[i] = 0;
            Alive++;
        }

        public int Length => length;
        public bool IsCreated => memory != IntPtr.Zero;

        public T this[int i]
        {
            get
            {
                if (i < 0 || i >= length) throw new IndexOutOfRangeException();
                return (T)Marshal.PtrToStructure(new IntPtr((byte*)memory + i * Marshal.SizeOf(typeof(T))), typeof(T));
            }
        }

        public void Dispose()
        {
            if (memory == IntPtr.Zero) throw new ObjectDisposedException("NativeArray");
            Marshal.FreeHGlobal(memory);
            memory = IntPtr.Zero;
            Alive--;
        }
    }
}

namespace Unity.Collections.LowLevel.Unsafe
{
    public static unsafe class NativeArrayUnsafeUtility
    {
        public static void* GetUnsafePtr<T>(NativeArray<T> array) where T : struct
        {
            if (!array.IsCreated) throw new ObjectDisposedException("NativeArray");
            return (void*)array.memory;
        }
    }
}
