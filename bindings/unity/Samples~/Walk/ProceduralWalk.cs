using System;
using UnityEngine;

namespace Unic.Samples
{
    /// <summary>Walks a character of SMPL's joints along a circle, without any animation file.</summary>
    public sealed class ProceduralWalk : MonoBehaviour
    {
        private const float StepsPerSecond = 1.8f;
        private const float Metres = 0.6f;
        private static readonly string[] Names =
        {
            "L_hip", "R_hip", "L_knee", "R_knee", "L_shoulder", "R_shoulder", "L_elbow", "R_elbow", "spine2",
        };

        private readonly Transform[] moved = new Transform[Names.Length];
        private Transform root;
        private Vector3 rest;
        private Vector3 centre;
        private float radius;
        private float seconds;

        /// <summary>Sets the bones, in the model's order, and the circle.</summary>
        public void Begin(LoadedModel model, Transform[] bones, Vector3 centre, float radius, float phase)
        {
            for (int i = 0; i < Names.Length; i++)
            {
                int joint = Array.IndexOf(model.jointNames, Names[i]);
                moved[i] = joint < 0 ? null : bones[joint];
            }
            root = bones[model.RootJoint];
            rest = model.RestJoints[model.RootJoint];
            this.centre = centre;
            this.radius = radius;
            seconds = phase;
            Move();
        }

        private void Update()
        {
            seconds += Time.deltaTime;
            Move();
        }

        private void Move()
        {
            if (root == null) return;
            float step = Mathf.PI * StepsPerSecond * seconds;
            float swing = Mathf.Sin(step), angle = Metres * StepsPerSecond * seconds / radius;
            Quaternion heading = Quaternion.AngleAxis(angle * Mathf.Rad2Deg, Vector3.up);
            root.position = centre + heading * new Vector3(-radius, 0f, 0f) + rest
                + new Vector3(0f, 0.02f * Mathf.Cos(2f * step), 0f);
            root.rotation = heading;
            // About +x: legs swing ahead with a negative angle. Arms hang from the T-pose first.
            Turn(0, Quaternion.AngleAxis(-25f * swing, Vector3.right));
            Turn(1, Quaternion.AngleAxis(25f * swing, Vector3.right));
            Turn(2, Quaternion.AngleAxis(20f + 20f * Mathf.Cos(step), Vector3.right));
            Turn(3, Quaternion.AngleAxis(20f - 20f * Mathf.Cos(step), Vector3.right));
            Turn(4, Quaternion.AngleAxis(20f * swing, Vector3.right) * Quaternion.AngleAxis(60f, Vector3.forward));
            Turn(5, Quaternion.AngleAxis(-20f * swing, Vector3.right) * Quaternion.AngleAxis(-60f, Vector3.forward));
            Turn(6, Quaternion.AngleAxis(15f, Vector3.up));
            Turn(7, Quaternion.AngleAxis(-15f, Vector3.up));
            Turn(8, Quaternion.AngleAxis(6f * swing, Vector3.up));
        }

        private void Turn(int bone, Quaternion rotation)
        {
            if (moved[bone] != null) moved[bone].localRotation = rotation;
        }
    }
}
