using UnityEngine;

namespace Unic.Samples
{
    /// <summary>Bones and skin of a model's own character, from nothing but its file.</summary>
    public static class WalkBody
    {
        private const int MostWeights = 4;

        /// <summary>Makes the bones of a model in the rest pose, under an object.</summary>
        public static Transform[] Bones(LoadedModel model, Transform parent)
        {
            Transform[] bones = new Transform[model.JointCount];
            for (int joint = 0; joint < bones.Length; joint++)
            {
                bones[joint] = new GameObject(model.jointNames[joint]).transform;
                bones[joint].position = model.RestJoints[joint];
            }
            for (int joint = 0; joint < bones.Length; joint++)
            {
                int above = model.jointParents[joint];
                bones[joint].SetParent(above < 0 ? parent : bones[above], true);
            }
            return bones;
        }

        /// <summary>Makes the skinned body, with the bones in the rest pose.</summary>
        public static Mesh Skin(UnicModelFile file, Transform[] bones)
        {
            Mesh mesh = new Mesh { name = "body" };
            mesh.vertices = Mirrored(file.Floats("character.vertices"));
            mesh.triangles = Reversed(file.UInts("character.faces"));
            mesh.boneWeights = Weights(file);
            Matrix4x4[] bindposes = new Matrix4x4[bones.Length];
            for (int joint = 0; joint < bones.Length; joint++) bindposes[joint] = bones[joint].worldToLocalMatrix;
            mesh.bindposes = bindposes;
            mesh.RecalculateNormals();
            mesh.RecalculateBounds();
            return mesh;
        }

        // Files are right-handed: x points the other way, and faces wind the other way.
        private static Vector3[] Mirrored(float[] numbers)
        {
            Vector3[] points = new Vector3[numbers.Length / 3];
            for (int i = 0; i < points.Length; i++)
                points[i] = new Vector3(-numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
            return points;
        }

        private static int[] Reversed(uint[] faces)
        {
            int[] reversed = new int[faces.Length];
            for (int i = 0; i < faces.Length; i += 3)
            {
                reversed[i] = (int)faces[i];
                reversed[i + 1] = (int)faces[i + 2];
                reversed[i + 2] = (int)faces[i + 1];
            }
            return reversed;
        }

        private static BoneWeight[] Weights(UnicModelFile file)
        {
            uint[] counts = file.UInts("character.skinning.counts");
            ushort[] joints = file.UShorts("character.skinning.joints");
            float[] weights = file.Floats("character.skinning.weights");
            BoneWeight[] bones = new BoneWeight[counts.Length];
            for (int vertex = 0, first = 0; vertex < bones.Length; first += (int)counts[vertex++])
                bones[vertex] = Largest(joints, weights, first, (int)counts[vertex]);
            return bones;
        }

        // The largest weights of a vertex, largest first, which sum to 1.
        private static BoneWeight Largest(ushort[] joints, float[] weights, int first, int count)
        {
            int[] kept = new int[MostWeights];
            float[] share = new float[MostWeights];
            for (int i = first; i < first + count; i++)
            {
                int joint = joints[i];
                float weight = weights[i];
                for (int slot = 0; slot < MostWeights; slot++)
                {
                    if (weight <= share[slot]) continue;
                    float lighter = share[slot];
                    int other = kept[slot];
                    share[slot] = weight;
                    kept[slot] = joint;
                    weight = lighter;
                    joint = other;
                }
            }
            float sum = share[0] + share[1] + share[2] + share[3];
            return new BoneWeight
            {
                boneIndex0 = kept[0], boneIndex1 = kept[1], boneIndex2 = kept[2], boneIndex3 = kept[3],
                weight0 = share[0] / sum, weight1 = share[1] / sum, weight2 = share[2] / sum, weight3 = share[3] / sum,
            };
        }
    }
}
