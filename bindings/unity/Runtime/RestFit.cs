using UnityEngine;

namespace Unic
{
    /// <summary>
    /// Turn and scale from a rig's rest pose to the model's, found by the joints' positions.
    /// </summary>
    /// <remarks>
    /// Importers turn meshes by quarter turns and scale them by 0.01 or 100. The joints tell: of the
    /// 24 rotations that map axes to axes, the best one is the right one.
    /// </remarks>
    public struct RestFit
    {
        /// <summary>Rotation from the mesh's space to the model's rest space.</summary>
        public Quaternion modelFromMesh;

        /// <summary>Metres of the model in a unit of the mesh.</summary>
        public float scale;

        /// <summary>Largest distance of a joint from the model's, in metres.</summary>
        public float error;

        /// <summary>Index of the joint that is the farthest from the model's, in the given arrays.</summary>
        public int worst;

        /// <summary>Fits joints of a rig to those of a model. Arrays have one length.</summary>
        /// <param name="rig">Rest positions in the mesh's space.</param>
        /// <param name="model">Rest positions of the model, in Unity's axes.</param>
        public static RestFit Of(Vector3[] rig, Vector3[] model)
        {
            Vector3 rigCentre = Mean(rig), modelCentre = Mean(model);
            float spread = 0f;
            for (int i = 0; i < rig.Length; i++) spread += (rig[i] - rigCentre).sqrMagnitude;
            RestFit best = new RestFit { modelFromMesh = Quaternion.identity, scale = 1f };
            if (spread <= 0f) return best.WithErrors(rig, rigCentre, model, modelCentre);
            float largest = float.NegativeInfinity;
            for (int facing = 0; facing < 6; facing++)
            {
                for (int turn = 0; turn < 4; turn++)
                {
                    Quaternion rotation = QuarterTurns(facing, turn);
                    float overlap = 0f;
                    for (int i = 0; i < rig.Length; i++)
                        overlap += Vector3.Dot(rotation * (rig[i] - rigCentre), model[i] - modelCentre);
                    // Above the rounding of a rotation, so that equal ones keep the first.
                    if (overlap <= largest * 1.0001f && overlap <= largest + 1e-6f * spread) continue;
                    largest = overlap;
                    best.modelFromMesh = rotation;
                }
            }
            // Rigs of a single joint, and those that fit nowhere, keep their size.
            best.scale = largest > 0f ? largest / spread : 1f;
            return best.WithErrors(rig, rigCentre, model, modelCentre);
        }

        private RestFit WithErrors(Vector3[] rig, Vector3 rigCentre, Vector3[] model, Vector3 modelCentre)
        {
            RestFit fit = this;
            for (int i = 0; i < rig.Length; i++)
            {
                Vector3 placed = modelFromMesh * (rig[i] - rigCentre) * scale + modelCentre;
                float distance = (placed - model[i]).magnitude;
                if (distance <= fit.error) continue;
                fit.error = distance;
                fit.worst = i;
            }
            return fit;
        }

        // The identity comes first. Components are exact or the root of a half.
        private static Quaternion QuarterTurns(int facing, int turn)
        {
            Quaternion about = Quaternion.AngleAxis(90f * turn, Vector3.up);
            switch (facing)
            {
                case 0: return about;
                case 1: return about * Quaternion.AngleAxis(90f, Vector3.right);
                case 2: return about * Quaternion.AngleAxis(-90f, Vector3.right);
                case 3: return about * Quaternion.AngleAxis(180f, Vector3.right);
                case 4: return about * Quaternion.AngleAxis(90f, Vector3.forward);
                default: return about * Quaternion.AngleAxis(-90f, Vector3.forward);
            }
        }

        private static Vector3 Mean(Vector3[] points)
        {
            Vector3 sum = Vector3.zero;
            foreach (Vector3 point in points) sum += point;
            return sum * (1f / points.Length);
        }
    }
}
