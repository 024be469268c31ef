using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Settings of a garment in motion. They stay as long as the native instance.</summary>
    [Serializable]
    public struct InstanceSettings
    {
        /// <summary>Number format of the networks.</summary>
        [Tooltip("Number format of the networks. Auto takes the fastest one that is about as exact as F32.")]
        public UnicPrecision precision;

        /// <summary>Share, 0 to 1, by which the error of Auto's choice may exceed that of F32, 0 for 0.01.</summary>
        [Tooltip("Share by which the error of Auto's choice may exceed that of F32. 0: 0.01.")]
        [Range(0f, 1f)] public float precisionError;

        /// <summary>Share of the vertices at which the networks are evaluated, 0 for the model's own.</summary>
        [NonSerialized] public float sampling;

        /// <summary>Handling of vertices inside the body and the colliders.</summary>
        [Tooltip("Handling of vertices inside the body. Colliders need Robust, or a model made with it.")]
        public UnicIntersection intersection;

        /// <summary>Threads that one step works on: None or Pool.</summary>
        [Tooltip("Threads that one step works on.")]
        public UnicThreads threads;

        /// <summary>Number of threads of the pool, 0 for the number of processors.</summary>
        [Tooltip("Number of threads of the pool. 0: as many as processors.")]
        [Range(0, 64)] public int threadCount;

        /// <summary>Size of the character relative to the model's, 0 for 1.</summary>
        [NonSerialized] public float characterScale;

        /// <summary>Settings of the native library, one thread.</summary>
        public static InstanceSettings Default => new InstanceSettings();
    }
}
