using UnityEngine;

namespace Unic
{
    /// <summary>Ball or capsule in the world, as Unity scales its colliders.</summary>
    public struct ColliderShape
    {
        /// <summary>First end of the axis.</summary>
        public Vector3 a;

        /// <summary>Second end of the axis: the first one for a ball.</summary>
        public Vector3 b;

        /// <summary>Radius in metres.</summary>
        public float radius;

        /// <summary>Whether the shape is a ball.</summary>
        public bool IsSphere => a == b;

        /// <summary>Shape of a SphereCollider: its radius follows the largest scale.</summary>
        public static ColliderShape Of(SphereCollider sphere)
        {
            Vector3 scale = Absolute(sphere.transform.lossyScale);
            Vector3 centre = sphere.transform.TransformPoint(sphere.center);
            float largest = Mathf.Max(scale.x, Mathf.Max(scale.y, scale.z));
            return new ColliderShape { a = centre, b = centre, radius = sphere.radius * largest };
        }

        /// <summary>
        /// Shape of a CapsuleCollider: its radius follows the larger scale across the axis.
        /// </summary>
        public static ColliderShape Of(CapsuleCollider capsule)
        {
            Transform place = capsule.transform;
            Vector3 scale = Absolute(place.lossyScale);
            int along = capsule.direction;
            float across = Mathf.Max(scale[(along + 1) % 3], scale[(along + 2) % 3]);
            float radius = capsule.radius * across;
            float half = Mathf.Max(0.5f * capsule.height * scale[along] - radius, 0f);
            Vector3 direction = Vector3.zero;
            direction[along] = 1f;
            Vector3 centre = place.TransformPoint(capsule.center), reach = place.rotation * direction * half;
            return new ColliderShape { a = centre - reach, b = centre + reach, radius = radius };
        }

        private static Vector3 Absolute(Vector3 v)
        {
            return new Vector3(Mathf.Abs(v.x), Mathf.Abs(v.y), Mathf.Abs(v.z));
        }
    }
}
