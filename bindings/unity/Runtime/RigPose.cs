using UnityEngine;

namespace Unic
{
    /// <summary>Pose of a character: root position, and the rotation of each joint from rest.</summary>
    public sealed class RigPose
    {
        /// <summary>Position of the root joint, relative to the garment's anchor.</summary>
        public Vector3 root;

        /// <summary>World rotations from the rest pose, in the model's order of joints.</summary>
        public readonly Quaternion[] rotations;

        /// <summary>Makes a pose of a number of joints, at rest.</summary>
        public RigPose(int jointCount)
        {
            rotations = new Quaternion[jointCount];
            for (int joint = 0; joint < jointCount; joint++) rotations[joint] = Quaternion.identity;
        }

        /// <summary>Copies another pose of as many joints.</summary>
        public void Set(RigPose other)
        {
            root = other.root;
            for (int joint = 0; joint < rotations.Length; joint++) rotations[joint] = other.rotations[joint];
        }

        /// <summary>Sets this pose between two others: share 0 is the first one, 1 the second.</summary>
        public void SetBetween(RigPose first, RigPose second, float share)
        {
            if (share >= 1f)
            {
                Set(second);
                return;
            }
            root = first.root + (second.root - first.root) * share;
            for (int joint = 0; joint < rotations.Length; joint++)
                rotations[joint] = Mix(first.rotations[joint], second.rotations[joint], share);
        }

        /// <summary>Whether another pose is so close that a garment can go on from one to the other.</summary>
        /// <param name="other">Pose of as many joints.</param>
        /// <param name="metres">Largest distance of the roots.</param>
        /// <param name="halfCosine">Least cosine of half the angle between rotations.</param>
        public bool IsNear(RigPose other, float metres, float halfCosine)
        {
            if ((root - other.root).sqrMagnitude > metres * metres) return false;
            for (int joint = 0; joint < rotations.Length; joint++)
                if (Mathf.Abs(Dot(rotations[joint], other.rotations[joint])) < halfCosine) return false;
            return true;
        }

        // Two poses of neighbouring frames are close, where the normalised mix is as good as an arc.
        private static Quaternion Mix(Quaternion a, Quaternion b, float share)
        {
            float sign = Dot(a, b) < 0f ? -1f : 1f;
            float p = 1f - share, q = share * sign;
            return Normalized(new Quaternion(p * a.x + q * b.x, p * a.y + q * b.y, p * a.z + q * b.z, p * a.w + q * b.w));
        }

        private static float Dot(Quaternion a, Quaternion b)
        {
            return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
        }

        internal static Quaternion Normalized(Quaternion q)
        {
            float length = Mathf.Sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
            float inverse = 1f / length;
            return new Quaternion(q.x * inverse, q.y * inverse, q.z * inverse, q.w * inverse);
        }
    }
}
