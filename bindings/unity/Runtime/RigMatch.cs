using System.Collections.Generic;
using UnityEngine;

namespace Unic
{
    /// <summary>Bones of a rig for the joints of a model.</summary>
    public sealed class RigMatch
    {
        /// <summary>Bone of each joint, in the model's order; null where there is none.</summary>
        public readonly Transform[] bones;

        /// <summary>Bind pose of each bone: from the mesh's space to the bone's.</summary>
        public readonly Matrix4x4[] bindposes;

        private readonly string rig;
        private readonly LoadedModel model;

        private RigMatch(string rig, LoadedModel model)
        {
            this.rig = rig;
            this.model = model;
            bones = new Transform[model.JointCount];
            bindposes = new Matrix4x4[model.JointCount];
        }

        /// <summary>Matches the bones of a skinned mesh by name, without case and namespace.</summary>
        /// <exception cref="UnicException">The renderer has no bones.</exception>
        public static RigMatch ByName(LoadedModel model, SkinnedMeshRenderer skin)
        {
            Transform[] found = Bones(skin);
            Dictionary<string, int> exact = new Dictionary<string, int>();
            Dictionary<string, int> plain = new Dictionary<string, int>();
            for (int i = 0; i < found.Length; i++)
            {
                if (found[i] == null) continue;
                if (!exact.ContainsKey(found[i].name)) exact.Add(found[i].name, i);
                string name = HumanoidJoints.Plain(found[i].name);
                if (!plain.ContainsKey(name)) plain.Add(name, i);
            }
            RigMatch match = new RigMatch(skin.name, model);
            Matrix4x4[] poses = skin.sharedMesh.bindposes;
            for (int joint = 0; joint < match.bones.Length; joint++)
            {
                int bone;
                string name = model.jointNames[joint];
                if (exact.TryGetValue(name, out bone) || plain.TryGetValue(HumanoidJoints.Plain(name), out bone))
                    match.Set(joint, found[bone], poses[bone]);
            }
            return match;
        }

        /// <summary>Matches the bones of a humanoid avatar that move the skinned mesh.</summary>
        /// <exception cref="UnicException">The animator is not humanoid, or the renderer has no bones.</exception>
        public static RigMatch ByAvatar(LoadedModel model, Animator animator, SkinnedMeshRenderer skin)
        {
            if (animator == null || !animator.isHuman)
                throw new UnicException(skin.name + ": expected an Animator with a humanoid avatar, found "
                                        + (animator == null ? "none" : "another one"));
            Transform[] found = Bones(skin);
            Matrix4x4[] poses = skin.sharedMesh.bindposes;
            RigMatch match = new RigMatch(skin.name, model);
            HumanBodyBones[] human = HumanoidJoints.Of(model.jointNames);
            for (int joint = 0; joint < human.Length; joint++)
            {
                if (human[joint] == HumanBodyBones.LastBone) continue;
                Transform bone = animator.GetBoneTransform(human[joint]);
                int index = bone == null ? -1 : System.Array.IndexOf(found, bone);
                if (index >= 0) match.Set(joint, bone, poses[index]);
            }
            return match;
        }

        /// <summary>Takes bones in the model's order; null where there is none.</summary>
        /// <exception cref="UnicException">The arrays have not one item a joint.</exception>
        public static RigMatch Given(LoadedModel model, Transform[] bones, Matrix4x4[] bindposes)
        {
            if (bones.Length != model.JointCount || bindposes.Length != model.JointCount)
                throw new UnicException("expected " + model.JointCount + " bones and bind poses, found "
                                        + bones.Length + " and " + bindposes.Length);
            RigMatch match = new RigMatch("rig", model);
            for (int joint = 0; joint < bones.Length; joint++)
                if (bones[joint] != null) match.Set(joint, bones[joint], bindposes[joint]);
            return match;
        }

        /// <summary>Number of joints that have a bone.</summary>
        public int Found
        {
            get
            {
                int count = 0;
                foreach (Transform bone in bones) if (bone != null) count++;
                return count;
            }
        }

        /// <summary>Names of the joints without a bone.</summary>
        public List<string> Missing()
        {
            List<string> missing = new List<string>();
            for (int joint = 0; joint < bones.Length; joint++)
                if (bones[joint] == null) missing.Add(model.jointNames[joint]);
            return missing;
        }

        /// <summary>Fit of the rig's rest pose to the model's, over the joints that have a bone.</summary>
        public RestFit Fit(out string worstJoint)
        {
            int found = Found;
            Vector3[] rig = new Vector3[found], rest = new Vector3[found];
            string[] names = new string[found];
            for (int joint = 0, i = 0; joint < bones.Length; joint++)
            {
                if (bones[joint] == null) continue;
                Matrix4x4 meshFromBone = bindposes[joint].inverse;
                rig[i] = new Vector3(meshFromBone.m03, meshFromBone.m13, meshFromBone.m23);
                rest[i] = model.RestJoints[joint];
                names[i++] = model.jointNames[joint];
            }
            RestFit fit = RestFit.Of(rig, rest);
            worstJoint = names[fit.worst];
            return fit;
        }

        /// <summary>Throws one sentence if a joint without a bone cannot be accepted.</summary>
        /// <exception cref="UnicException">Joints are missing.</exception>
        public void Require(MissingJoints rule)
        {
            List<string> missing = Missing();
            bool hasRoot = bones[model.RootJoint] != null;
            if (missing.Count == 0 || rule == MissingJoints.FollowParent && hasRoot) return;
            int shown = Mathf.Min(missing.Count, 5);
            string list = string.Join(", ", missing.GetRange(0, shown).ToArray());
            string more = missing.Count > shown ? " and " + (missing.Count - shown) + " more" : "";
            throw new UnicException(rig + ": expected bones for the " + model.JointCount + " joints of " + model.name
                                    + ", missing: " + list + more);
        }

        private void Set(int joint, Transform bone, Matrix4x4 bindpose)
        {
            bones[joint] = bone;
            bindposes[joint] = bindpose;
        }

        private static Transform[] Bones(SkinnedMeshRenderer skin)
        {
            if (skin.sharedMesh == null) throw new UnicException(skin.name + ": expected a mesh, found none");
            Transform[] bones = skin.bones;
            // Both are empty or full of nulls if the importer has merged the bones away.
            if (!System.Array.Exists(bones, bone => bone != null))
                throw new UnicException(skin.name + ": expected bones, found none; switch off Optimize Game Objects "
                                        + "in the model's import settings");
            return bones;
        }
    }
}
