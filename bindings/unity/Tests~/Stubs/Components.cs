// Renderers, colliders, animators and cameras that tests fill in.

using System.Collections.Generic;

namespace UnityEngine
{
    public class Material : Object { }

    public class Renderer : Component
    {
        public bool enabled { get; set; } = true;
        public bool isVisible { get; set; } = true;
        public Material sharedMaterial { get; set; }
    }

    public class MeshRenderer : Renderer { }

    public class MeshFilter : Component { public Mesh sharedMesh { get; set; } }

    public class SkinnedMeshRenderer : Renderer
    {
        public Mesh sharedMesh { get; set; }
        public Transform[] bones { get; set; } = new Transform[0];
        public Transform rootBone { get; set; }
        public bool updateWhenOffscreen { get; set; }
    }

    public class Collider : Component { public bool enabled { get; set; } = true; }

    public class SphereCollider : Collider
    {
        public Vector3 center { get; set; }
        public float radius { get; set; } = 0.5f;
    }

    public class CapsuleCollider : Collider
    {
        public Vector3 center { get; set; }
        public float radius { get; set; } = 0.5f;
        public float height { get; set; } = 2f;
        public int direction { get; set; } = 1;
    }

    public class Camera : Behaviour { public static Camera main { get; set; } }

    public enum HumanBodyBones
    {
        Hips, LeftUpperLeg, RightUpperLeg, LeftLowerLeg, RightLowerLeg, LeftFoot, RightFoot, Spine, Chest, Neck, Head,
        LeftShoulder, RightShoulder, LeftUpperArm, RightUpperArm, LeftLowerArm, RightLowerArm, LeftHand, RightHand,
        LeftToes, RightToes, UpperChest = 54, LastBone = 55,
    }

    public class Animator : Behaviour
    {
        public readonly Dictionary<HumanBodyBones, Transform> Avatar = new Dictionary<HumanBodyBones, Transform>();
        public bool isHuman => Avatar.Count > 0;
        public Transform GetBoneTransform(HumanBodyBones bone)
        {
            Transform found;
            return Avatar.TryGetValue(bone, out found) ? found : null;
        }
    }
}
