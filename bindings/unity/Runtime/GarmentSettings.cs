using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Way in which bones are found for the model's joints.</summary>
    public enum RigSource
    {
        /// <summary>Bones of the skinned mesh with the names of the joints.</summary>
        Names,
        /// <summary>Bones of the humanoid avatar of the animator.</summary>
        Humanoid,
    }

    /// <summary>Moments at which a new shape is shown.</summary>
    public enum DisplayRate
    {
        /// <summary>Every frame: the garment follows the body between two ticks.</summary>
        EveryFrame,
        /// <summary>Every tick: cheaper, for distant characters.</summary>
        EveryTick,
    }

    /// <summary>Rule for garments that no camera sees.</summary>
    public enum OutOfSight
    {
        /// <summary>They stop after a quarter of a second, and go on when they are seen.</summary>
        Sleep,
        /// <summary>They go on.</summary>
        Continue,
    }

    /// <summary>Activity of a garment in a frame.</summary>
    public enum GarmentActivity
    {
        /// <summary>Nothing: it has not begun, or has a problem.</summary>
        None,
        /// <summary>It moves.</summary>
        Moving,
        /// <summary>Ticks stand still, and the last shape follows the body.</summary>
        Still,
        /// <summary>It is out of sight, and costs nothing.</summary>
        Asleep,
    }

    /// <summary>Level of detail from a distance on.</summary>
    [Serializable]
    public struct DetailLevel
    {
        /// <summary>Distance to the viewer from which the level is used, metres.</summary>
        [Tooltip("Distance to the viewer from which this level is used, metres.")]
        public float distance;

        /// <summary>Share of the vertices at which the networks are evaluated, above 0 to 1.</summary>
        [Tooltip("Share of the vertices at which the networks are evaluated.")]
        [Range(0.02f, 1f)] public float sampling;

        /// <summary>Handling of vertices inside the body; Model for that of the settings.</summary>
        [Tooltip("Handling of vertices inside the body at this level. Model: that of the settings.")]
        public UnicIntersection intersection;

        /// <summary>Makes a level.</summary>
        public DetailLevel(float distance, float sampling, UnicIntersection intersection = UnicIntersection.Model)
        {
            this.distance = distance;
            this.sampling = sampling;
            this.intersection = intersection;
        }

        /// <summary>Index of the level at a distance. Levels are sorted by distance.</summary>
        /// <param name="levels">Levels, of which the first begins at 0. Null for none.</param>
        /// <param name="distance">Distance to the viewer, metres.</param>
        /// <param name="current">Level until now, which is kept within 5 % of a border.</param>
        public static int At(DetailLevel[] levels, float distance, int current)
        {
            int level = Plain(levels, distance);
            if (level > current) return Mathf.Max(Plain(levels, distance * 0.95f), current);
            if (level < current) return Mathf.Min(Plain(levels, distance * 1.05f), current);
            return level;
        }

        private static int Plain(DetailLevel[] levels, float distance)
        {
            int level = 0;
            for (int i = 1; levels != null && i < levels.Length; i++)
                if (distance >= levels[i].distance) level = i;
            return level;
        }
    }
}
