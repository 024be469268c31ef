using UnityEngine;

namespace Unic
{
    /// <summary>Ground and air of one tick.</summary>
    public struct Surroundings
    {
        /// <summary>Height of the ground under the character, relative to the garment's anchor.</summary>
        public float groundHeight;

        /// <summary>Velocity of the air, m/s.</summary>
        public Vector3 wind;
    }
}
