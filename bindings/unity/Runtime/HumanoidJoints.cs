using System;
using System.Collections.Generic;
using UnityEngine;

namespace Unic
{
    /// <summary>Bones of Unity's humanoid avatar for joint names of SMPL, Mixamo and Unity.</summary>
    public static class HumanoidJoints
    {
        private static readonly Dictionary<string, HumanBodyBones> Smpl = Table(
            "pelvis", HumanBodyBones.Hips, "spine1", HumanBodyBones.Spine, "spine2", HumanBodyBones.Chest,
            "spine3", HumanBodyBones.UpperChest, "neck", HumanBodyBones.Neck, "head", HumanBodyBones.Head,
            "lhip", HumanBodyBones.LeftUpperLeg, "rhip", HumanBodyBones.RightUpperLeg,
            "lknee", HumanBodyBones.LeftLowerLeg, "rknee", HumanBodyBones.RightLowerLeg,
            "lankle", HumanBodyBones.LeftFoot, "rankle", HumanBodyBones.RightFoot,
            "lfoot", HumanBodyBones.LeftToes, "rfoot", HumanBodyBones.RightToes,
            "lcollar", HumanBodyBones.LeftShoulder, "rcollar", HumanBodyBones.RightShoulder,
            "lshoulder", HumanBodyBones.LeftUpperArm, "rshoulder", HumanBodyBones.RightUpperArm,
            "lelbow", HumanBodyBones.LeftLowerArm, "relbow", HumanBodyBones.RightLowerArm,
            "lwrist", HumanBodyBones.LeftHand, "rwrist", HumanBodyBones.RightHand);

        private static readonly Dictionary<string, HumanBodyBones> Mixamo = Table(
            "hips", HumanBodyBones.Hips, "spine", HumanBodyBones.Spine, "spine1", HumanBodyBones.Chest,
            "chest", HumanBodyBones.Chest, "spine2", HumanBodyBones.UpperChest,
            "upperchest", HumanBodyBones.UpperChest, "neck", HumanBodyBones.Neck, "head", HumanBodyBones.Head,
            "lupleg", HumanBodyBones.LeftUpperLeg, "rupleg", HumanBodyBones.RightUpperLeg,
            "lupperleg", HumanBodyBones.LeftUpperLeg, "rupperleg", HumanBodyBones.RightUpperLeg,
            "lleg", HumanBodyBones.LeftLowerLeg, "rleg", HumanBodyBones.RightLowerLeg,
            "llowerleg", HumanBodyBones.LeftLowerLeg, "rlowerleg", HumanBodyBones.RightLowerLeg,
            "lfoot", HumanBodyBones.LeftFoot, "rfoot", HumanBodyBones.RightFoot,
            "ltoebase", HumanBodyBones.LeftToes, "rtoebase", HumanBodyBones.RightToes,
            "ltoes", HumanBodyBones.LeftToes, "rtoes", HumanBodyBones.RightToes,
            "lshoulder", HumanBodyBones.LeftShoulder, "rshoulder", HumanBodyBones.RightShoulder,
            "larm", HumanBodyBones.LeftUpperArm, "rarm", HumanBodyBones.RightUpperArm,
            "lupperarm", HumanBodyBones.LeftUpperArm, "rupperarm", HumanBodyBones.RightUpperArm,
            "lforearm", HumanBodyBones.LeftLowerArm, "rforearm", HumanBodyBones.RightLowerArm,
            "llowerarm", HumanBodyBones.LeftLowerArm, "rlowerarm", HumanBodyBones.RightLowerArm,
            "lhand", HumanBodyBones.LeftHand, "rhand", HumanBodyBones.RightHand);

        /// <summary>Bone for each joint of a model; LastBone where there is none.</summary>
        /// <remarks>
        /// A left shoulder is the upper arm in SMPL and the collar bone in Mixamo, so the names
        /// decide together: models with a pelvis are SMPL's.
        /// </remarks>
        public static HumanBodyBones[] Of(string[] jointNames)
        {
            bool isSmpl = Array.Exists(jointNames, name => Plain(name) == "pelvis");
            Dictionary<string, HumanBodyBones> table = isSmpl ? Smpl : Mixamo;
            HumanBodyBones[] bones = new HumanBodyBones[jointNames.Length];
            for (int joint = 0; joint < bones.Length; joint++)
                if (!table.TryGetValue(WithShortSide(Plain(jointNames[joint])), out bones[joint]))
                    bones[joint] = HumanBodyBones.LastBone;
            return bones;
        }

        /// <summary>Name without namespace, case and separators.</summary>
        public static string Plain(string name)
        {
            int start = Math.Max(name.LastIndexOf(':'), name.LastIndexOf('|')) + 1;
            char[] kept = new char[name.Length - start];
            int count = 0;
            for (int i = start; i < name.Length; i++)
                if (char.IsLetterOrDigit(name[i])) kept[count++] = char.ToLowerInvariant(name[i]);
            return new string(kept, 0, count);
        }

        private static string WithShortSide(string plain)
        {
            if (plain.StartsWith("left", StringComparison.Ordinal)) return "l" + plain.Substring(4);
            if (plain.StartsWith("right", StringComparison.Ordinal)) return "r" + plain.Substring(5);
            return plain;
        }

        private static Dictionary<string, HumanBodyBones> Table(params object[] pairs)
        {
            Dictionary<string, HumanBodyBones> table = new Dictionary<string, HumanBodyBones>();
            for (int i = 0; i < pairs.Length; i += 2) table.Add((string)pairs[i], (HumanBodyBones)pairs[i + 1]);
            return table;
        }
    }
}
