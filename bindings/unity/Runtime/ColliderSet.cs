using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Whether the garment is kept over the ground.</summary>
    public enum GroundCollision
    {
        /// <summary>The garment may pass through the ground.</summary>
        Ignore,
        /// <summary>The garment stays over the plane at groundHeight.</summary>
        Collide,
    }

    /// <summary>Ground and props that a garment is kept out of.</summary>
    [Serializable]
    public struct ColliderSet
    {
        /// <summary>World height of the ground under the character.</summary>
        [Tooltip("World height of the ground under the character.")]
        public float groundHeight;

        /// <summary>Whether the garment is kept over the ground.</summary>
        [Tooltip("Whether the garment is kept over the ground.")]
        public GroundCollision ground;

        /// <summary>Balls. Those of the character itself do not belong here.</summary>
        [Tooltip("Balls that push the garment. The character's body pushes it without colliders.")]
        public SphereCollider[] spheres;

        /// <summary>Capsules. Those of the character itself do not belong here.</summary>
        [Tooltip("Capsules that push the garment. The character's body pushes it without colliders.")]
        public CapsuleCollider[] capsules;
    }
}
