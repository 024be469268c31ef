using UnityEngine;

namespace Unic
{
    /// <summary>Bones that move a garment, whatever their own axes are.</summary>
    public sealed class UnicRig
    {
        private readonly Transform[] bones;
        private readonly Quaternion[] boneFromRest;
        // Joint whose bone moves each joint: itself, or the nearest parent with a bone.
        private readonly int[] sources;
        private readonly int root;

        /// <summary>Size of the character relative to the model's.</summary>
        public readonly float scale;

        /// <summary>Fit of the rig's rest pose to the model's.</summary>
        public readonly RestFit fit;

        /// <summary>Prepares matched bones.</summary>
        /// <param name="model">The model.</param>
        /// <param name="match">Bones of its joints.</param>
        /// <param name="rule">Rule for joints without a bone.</param>
        /// <param name="mostError">Largest distance of a joint at rest from the model's, metres.</param>
        /// <exception cref="UnicException">Joints are missing, or their rest pose is another one.</exception>
        public UnicRig(LoadedModel model, RigMatch match, MissingJoints rule, float mostError)
        {
            match.Require(rule);
            string worst;
            fit = match.Fit(out worst);
            if (fit.error > mostError)
                throw new UnicException("expected the rest pose of " + model.name + " to within " + Metres(mostError)
                                        + " m, found joint " + worst + " " + Metres(fit.error) + " m away");
            bones = match.bones;
            root = model.RootJoint;
            sources = Sources(bones, model.jointParents);
            boneFromRest = new Quaternion[bones.Length];
            Quaternion meshFromModel = Quaternion.Inverse(fit.modelFromMesh);
            for (int joint = 0; joint < bones.Length; joint++)
                boneFromRest[joint] = RigPose.Normalized(Rotation(match.bindposes[sources[joint]]) * meshFromModel);
            scale = WorldScale(bones[root], match.bindposes[root]) / fit.scale;
            // Joints that other programs have rounded do not change the size.
            if (Mathf.Abs(scale - 1f) < 0.01f) scale = 1f;
        }

        /// <summary>World position of the root joint.</summary>
        public Vector3 RootPosition => bones[root].position;

        /// <summary>Bone of the root joint.</summary>
        public Transform RootBone => bones[root];

        /// <summary>Whether no bone has been destroyed.</summary>
        public bool IsAlive
        {
            get
            {
                foreach (int source in sources)
                    if (bones[source] == null) return false;
                return true;
            }
        }

        /// <summary>Reads the pose of the moment, relative to the anchor. Allocates nothing.</summary>
        public void Read(RigPose pose, Vector3 anchor)
        {
            pose.root = bones[root].position - anchor;
            for (int joint = 0; joint < sources.Length; joint++)
                if (sources[joint] == joint)
                    pose.rotations[joint] = RigPose.Normalized(bones[joint].rotation * boneFromRest[joint]);
            // Sources may come after the joints that follow them.
            for (int joint = 0; joint < sources.Length; joint++)
                pose.rotations[joint] = pose.rotations[sources[joint]];
        }

        private static int[] Sources(Transform[] bones, int[] parents)
        {
            int[] sources = new int[bones.Length];
            for (int joint = 0; joint < bones.Length; joint++)
            {
                int source = joint;
                while (bones[source] == null) source = parents[source];
                sources[joint] = source;
            }
            return sources;
        }

        private static Quaternion Rotation(Matrix4x4 matrix)
        {
            // Columns carry the scale of the mesh; a rotation follows from their directions.
            return Quaternion.LookRotation(matrix.GetColumn(2), matrix.GetColumn(1));
        }

        private static float WorldScale(Transform bone, Matrix4x4 bindpose)
        {
            Matrix4x4 worldFromMesh = bone.localToWorldMatrix * bindpose;
            Vector3 x = worldFromMesh.GetColumn(0), y = worldFromMesh.GetColumn(1), z = worldFromMesh.GetColumn(2);
            float least = Mathf.Min(x.magnitude, Mathf.Min(y.magnitude, z.magnitude));
            float most = Mathf.Max(x.magnitude, Mathf.Max(y.magnitude, z.magnitude));
            if (!(most <= 1.02f * least))
                throw new UnicException(bone.name + ": expected one scale along all axes, found "
                                        + Metres(x.magnitude) + ", " + Metres(y.magnitude) + ", " + Metres(z.magnitude));
            return (x.magnitude + y.magnitude + z.magnitude) / 3f;
        }

        private static string Metres(float value)
        {
            return value.ToString("0.000", System.Globalization.CultureInfo.InvariantCulture);
        }
    }
}
