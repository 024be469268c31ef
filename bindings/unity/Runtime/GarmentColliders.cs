using System;
using Unic.Native;
using UnityEngine;

namespace Unic
{
    /// <summary>Ground, balls and capsules of the scene as the native library has them.</summary>
    internal sealed unsafe class GarmentColliders
    {
        private UnicCollider[] sent = new UnicCollider[0];
        private UnicCollider[] now = new UnicCollider[0];
        private int sentCount = -1;
        private int count;

        /// <summary>Forgets what was sent: the instance is a new one.</summary>
        internal void Restart()
        {
            sentCount = -1;
        }

        /// <summary>Reads the colliders and sends them if one has changed. Allocates when they grow.</summary>
        internal void Send(UnicInstance instance, ColliderSet set, Vector3 anchor)
        {
            Read(set, anchor);
            if (!HasChanged()) return;
            instance.SetColliders(now, count);
            if (sent.Length < now.Length) sent = new UnicCollider[now.Length];
            Array.Copy(now, sent, count);
            sentCount = count;
        }

        private void Read(ColliderSet set, Vector3 anchor)
        {
            int most = 1 + Length(set.spheres) + Length(set.capsules);
            if (now.Length < most) now = new UnicCollider[most];
            count = 0;
            if (set.ground == GroundCollision.Collide) AddGround(set.groundHeight, anchor);
            for (int i = 0; i < Length(set.spheres); i++)
                if (Counts(set.spheres[i])) AddCapsule(ColliderShape.Of(set.spheres[i]), anchor);
            for (int i = 0; i < Length(set.capsules); i++)
                if (Counts(set.capsules[i])) AddCapsule(ColliderShape.Of(set.capsules[i]), anchor);
        }

        private static bool Counts(Collider collider)
        {
            return collider != null && collider.enabled && collider.gameObject.activeInHierarchy;
        }

        private static int Length(Array array)
        {
            return array == null ? 0 : array.Length;
        }

        private void AddGround(float height, Vector3 anchor)
        {
            UnicCollider ground = new UnicCollider { shape = UnicShape.HalfSpace };
            ground.a[1] = height - anchor.y;
            ground.b[1] = ground.a[1] + 1f;
            now[count++] = ground;
        }

        private void AddCapsule(ColliderShape shape, Vector3 anchor)
        {
            // A collider that is scaled to nothing has no surface.
            if (!(shape.radius > 0f)) return;
            Vector3 a = shape.a - anchor, b = shape.b - anchor;
            UnicCollider capsule = new UnicCollider
            {
                shape = shape.IsSphere ? UnicShape.Sphere : UnicShape.Capsule,
                radius = shape.radius,
            };
            capsule.a[0] = a.x;
            capsule.a[1] = a.y;
            capsule.a[2] = a.z;
            capsule.b[0] = b.x;
            capsule.b[1] = b.y;
            capsule.b[2] = b.z;
            now[count++] = capsule;
        }

        private bool HasChanged()
        {
            if (count != sentCount) return true;
            int floats = count * sizeof(UnicCollider) / 4;
            fixed (UnicCollider* first = now, before = sent)
                for (int i = 0; i < floats; i++)
                    if (((uint*)first)[i] != ((uint*)before)[i]) return true;
            return false;
        }
    }
}
