using UnityEngine;

namespace Unic
{
    public sealed partial class UnicGarment
    {
        private const float GroundGizmo = 2f;

        private void OnDrawGizmosSelected()
        {
            Gizmos.color = new Color(0.3f, 0.8f, 1f, 0.8f);
            Vector3 centre = rig != null && rig.IsAlive ? rig.RootPosition : transform.position;
            if (colliders.ground == GroundCollision.Collide)
            {
                centre.y = colliders.groundHeight;
                Gizmos.DrawWireCube(centre, new Vector3(GroundGizmo, 0f, GroundGizmo));
            }
            for (int i = 0; colliders.spheres != null && i < colliders.spheres.Length; i++)
                if (colliders.spheres[i] != null) Draw(ColliderShape.Of(colliders.spheres[i]));
            for (int i = 0; colliders.capsules != null && i < colliders.capsules.Length; i++)
                if (colliders.capsules[i] != null) Draw(ColliderShape.Of(colliders.capsules[i]));
        }

        private static void Draw(ColliderShape shape)
        {
            Gizmos.DrawWireSphere(shape.a, shape.radius);
            if (shape.IsSphere) return;
            Gizmos.DrawWireSphere(shape.b, shape.radius);
            Quaternion turn = Quaternion.FromToRotation(Vector3.up, shape.b - shape.a);
            for (int side = 0; side < 4; side++)
            {
                Vector3 aside = turn * Quaternion.AngleAxis(90f * side, Vector3.up) * Vector3.forward * shape.radius;
                Gizmos.DrawLine(shape.a + aside, shape.b + aside);
            }
        }
    }
}
