using System;
using Unic.Native;
using Unity.Collections;
using Unity.Collections.LowLevel.Unsafe;
using UnityEngine;
using UnityEngine.Rendering;

namespace Unic
{
    /// <summary>
    /// Mesh that the native library fills: positions and normals in stream 0, texture coordinates in
    /// stream 1.
    /// </summary>
    public sealed unsafe class GarmentMesh : IDisposable
    {
        private const MeshUpdateFlags Unchecked = MeshUpdateFlags.DontRecalculateBounds
            | MeshUpdateFlags.DontValidateIndices;

        private NativeArray<GarmentVertex> vertices;
        private Bounds bounds;

        /// <summary>The mesh, for a MeshFilter.</summary>
        public readonly Mesh mesh;

        /// <summary>Makes the mesh of a garment or a body, with every vertex at the origin.</summary>
        public GarmentMesh(string name, UnicInstance instance, UnicMesh which)
        {
            int count = which == UnicMesh.Garment ? instance.VertexCount : instance.BodyVertexCount;
            vertices = new NativeArray<GarmentVertex>(count, Allocator.Persistent, NativeArrayOptions.ClearMemory);
            mesh = new Mesh { name = name, hideFlags = HideFlags.DontSave };
            mesh.MarkDynamic();
            mesh.SetVertexBufferParams(count,
                new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
                new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 0),
                new VertexAttributeDescriptor(VertexAttribute.TexCoord0, VertexAttributeFormat.Float32, 2, 1));
            mesh.SetVertexBufferData(vertices, 0, 0, count, 0, Unchecked);
            try
            {
                Vector2[] uvs = instance.HasUvs(which) ? instance.Uvs(which) : new Vector2[count];
                mesh.SetVertexBufferData(uvs, 0, 0, count, 1, Unchecked);
                SetFaces(instance.Faces(which), count);
            }
            catch
            {
                // Neither is collected.
                Dispose();
                throw;
            }
        }

        /// <summary>Number of vertices.</summary>
        public int Count => vertices.Length;

        /// <summary>The vertices, for the native library to write.</summary>
        public GarmentVertex* Pointer => (GarmentVertex*)NativeArrayUnsafeUtility.GetUnsafePtr(vertices);

        /// <summary>A vertex as it was written last.</summary>
        public GarmentVertex this[int vertex] => vertices[vertex];

        /// <summary>Bounds of the written vertices.</summary>
        public Bounds Bounds => bounds;

        /// <summary>Passes the written vertices and their bounds to the mesh. Allocates nothing.</summary>
        public void Upload()
        {
            mesh.SetVertexBufferData(vertices, 0, 0, vertices.Length, 0, Unchecked);
            SetBounds(BoundsOf(Pointer, vertices.Length));
        }

        /// <summary>Sets the bounds without new vertices, so that a mesh out of sight comes back.</summary>
        public void SetBounds(Bounds to)
        {
            bounds = to;
            mesh.bounds = to;
        }

        /// <summary>Ends the mesh and its memory.</summary>
        public void Dispose()
        {
            if (vertices.IsCreated) vertices.Dispose();
            if (mesh == null) return;
            if (Application.isPlaying) UnityEngine.Object.Destroy(mesh);
            else UnityEngine.Object.DestroyImmediate(mesh);
        }

        private void SetFaces(int[] faces, int count)
        {
            mesh.indexFormat = count > ushort.MaxValue ? IndexFormat.UInt32 : IndexFormat.UInt16;
            mesh.SetTriangles(faces, 0, false);
        }

        private static Bounds BoundsOf(GarmentVertex* vertices, int count)
        {
            Vector3 low = vertices[0].position, high = low;
            for (GarmentVertex* v = vertices + 1, end = vertices + count; v < end; v++)
            {
                if (v->position.x < low.x) low.x = v->position.x;
                else if (v->position.x > high.x) high.x = v->position.x;
                if (v->position.y < low.y) low.y = v->position.y;
                else if (v->position.y > high.y) high.y = v->position.y;
                if (v->position.z < low.z) low.z = v->position.z;
                else if (v->position.z > high.z) high.z = v->position.z;
            }
            Bounds bounds = new Bounds();
            bounds.SetMinMax(low, high);
            return bounds;
        }
    }
}
