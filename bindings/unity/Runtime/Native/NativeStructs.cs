using System;
using System.Runtime.InteropServices;

namespace Unic.Native
{
    // The structs of unic.h, field by field. Tests~/Layout compares sizes and offsets with the
    // header. All of them are blittable, so that a call copies nothing.

    /// <summary>Sizes and constants of a model.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal struct UnicModelInfo
    {
        public uint size;
        public uint jointCount;
        public uint rootJoint;
        public uint vertexCount;
        public uint faceCount;
        public uint bodyVertexCount;
        public uint bodyFaceCount;
        public float fps;
    }

    /// <summary>Options of an instance. unic_options_init sets the defaults.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct UnicOptions
    {
        public uint size;
        public UnicPrecision precision;
        public float sampling;
        public UnicIntersection intersection;
        public float intersectionDistanceM;
        public UnicAxes axes;
        public fixed int customAxes[3];
        public float metresPerUnit;
        public UnicVertexLayout vertexLayout;
        public UnicThreads threads;
        public uint threadCount;
        public float precisionError;
        public IntPtr parallelFor;
        public IntPtr parallelContext;
    }

    /// <summary>Ground or prop, in the instance's axes and unit.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct UnicCollider
    {
        public UnicShape shape;
        public float radius;
        public fixed float a[3];
        public fixed float b[3];
    }

    /// <summary>Pose of the character. Joints are in the model's order.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct UnicPose
    {
        public fixed float root[3];
        public UnicRoot rootKind;
        public UnicRotations rotationKind;
        public uint jointCount;
        public float* rotations;
        public UIntPtr rotationStride;
    }

    /// <summary>Input of a step. Fields that are zero are off.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct UnicStepInput
    {
        public uint size;
        public float groundHeight;
        public fixed float wind[3];
        public uint reserved;
        public UnicPose* pose;
        public UnicPose* nextPose;
    }

    /// <summary>Buffers that vertices are written to. Strides are in bytes.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct UnicVertices
    {
        public float* positions;
        public UIntPtr positionStride;
        public float* normals;
        public UIntPtr normalStride;
        public UIntPtr count;
    }

    /// <summary>Sizes of a mesh in the layout of an instance.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal struct UnicMeshInfo
    {
        public uint size;
        public uint vertexCount;
        public uint faceCount;
        public uint hasUvs;
    }
}
