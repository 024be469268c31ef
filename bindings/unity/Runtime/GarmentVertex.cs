using System.Runtime.InteropServices;
using UnityEngine;

namespace Unic
{
    /// <summary>One vertex of the mesh's stream 0, as the native library writes it.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct GarmentVertex
    {
        /// <summary>Position in metres, in the space of the garment's object.</summary>
        public Vector3 position;
        /// <summary>Unit normal.</summary>
        public Vector3 normal;

        /// <summary>Size of a vertex in bytes.</summary>
        public const int Stride = 24;
    }
}
