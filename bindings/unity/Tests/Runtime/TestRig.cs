using System;
using Unic;
using UnityEngine;
using UnityEngine.TestTools;

/// <summary>A character of the model's joints, without a skin that is drawn, and its garment.</summary>
/// <remarks>
/// Bones have axes of their own, and the mesh's space is turned and scaled, as importers leave it.
/// </remarks>
internal sealed class TestRig : IDisposable
{
    internal readonly UnicModel model;
    internal readonly GameObject character = new GameObject("character");
    internal readonly SkinnedMeshRenderer skin;
    internal readonly Transform[] bones;
    internal readonly UnicGarment garment;
    internal readonly MeshRenderer shower;

    private readonly Quaternion[] atRest;
    private readonly Vector3[] rest;
    private readonly int[] parents;
    private readonly int root;

    /// <summary>Makes a rig. The seed chooses the axes of the bones; 0 for those of the world.</summary>
    internal TestRig(UnicModel model, int seed = 0, float meshScale = 1f, float scale = 1f)
    {
        this.model = model;
        // Problems are logged as errors, which Unity's test framework takes as failures.
        LogAssert.ignoreFailingMessages = true;
        LoadedModel loaded = model.Acquire();
        rest = loaded.RestJoints;
        parents = loaded.jointParents;
        root = loaded.RootJoint;
        bones = new Transform[loaded.JointCount];
        atRest = new Quaternion[bones.Length];
        System.Random random = new System.Random(seed);
        for (int joint = 0; joint < bones.Length; joint++)
        {
            bones[joint] = new GameObject("rig:" + loaded.jointNames[joint]).transform;
            atRest[joint] = seed == 0 ? Quaternion.identity : Any(random);
            // Placed before its children are: parents need not come first.
            bones[joint].SetPositionAndRotation(rest[joint], atRest[joint]);
        }
        for (int joint = 0; joint < bones.Length; joint++)
            bones[joint].SetParent(parents[joint] < 0 ? character.transform : bones[parents[joint]], true);
        model.Release();
        skin = character.AddComponent<SkinnedMeshRenderer>();
        Bind(seed == 0 ? Quaternion.identity : Quaternion.AngleAxis(-90f, Vector3.right), meshScale);
        character.transform.localScale = Vector3.one * scale;
        GameObject cloth = new GameObject("garment");
        cloth.transform.SetParent(character.transform, false);
        garment = cloth.AddComponent<UnicGarment>();
        shower = cloth.GetComponent<MeshRenderer>();
        garment.model = model;
        garment.skin = skin;
        garment.outOfSight = OutOfSight.Continue;
    }

    /// <summary>Sets the pose: root position and rotations from rest, in the world's axes.</summary>
    internal void Pose(Vector3 rootPosition, Quaternion[] fromRest)
    {
        character.transform.SetPositionAndRotation(Vector3.zero, Quaternion.identity);
        for (int joint = 0; joint < bones.Length; joint++)
        {
            Quaternion world = fromRest[joint] * atRest[joint];
            int parent = parents[joint];
            bones[joint].localRotation = parent < 0
                ? world
                : Quaternion.Inverse(fromRest[parent] * atRest[parent]) * world;
        }
        bones[root].position = rootPosition;
    }

    /// <summary>Sets a pose with swinging legs and arms that walks ahead, some seconds after its start.</summary>
    internal void Walk(float seconds, Vector3 from)
    {
        Quaternion[] fromRest = new Quaternion[bones.Length];
        for (int joint = 0; joint < bones.Length; joint++)
        {
            float swing = 10f * Mathf.Sin(5f * seconds + joint);
            fromRest[joint] = Quaternion.AngleAxis(joint == root ? 0f : swing, Vector3.right);
        }
        Pose(from + rest[root] + new Vector3(0f, 0f, seconds), fromRest);
    }

    /// <summary>Runs the garment for a frame, as LateUpdate does.</summary>
    internal void Frame(float seconds)
    {
        garment.BeginFrame(seconds);
        while (garment.IsTickDue) garment.TickOnce();
        garment.EndFrame();
    }

    /// <summary>Walks for a number of frames of 60 Hz.</summary>
    internal void Walk(int frames, float start, Vector3 from)
    {
        for (int frame = 0; frame < frames; frame++)
        {
            Walk(start + frame / 60f, from);
            Frame(1f / 60f);
        }
    }

    /// <summary>Copy of the vertices in the world.</summary>
    internal Vector3[] Vertices()
    {
        Vector3[] vertices = new Vector3[garment.Mesh.Count];
        for (int i = 0; i < vertices.Length; i++) vertices[i] = garment.Anchor + garment.Mesh[i].position;
        return vertices;
    }

    /// <summary>Largest distance between two arrays of vertices.</summary>
    internal static float Largest(Vector3[] a, Vector3[] b)
    {
        float largest = 0f;
        for (int i = 0; i < a.Length; i++) largest = Mathf.Max(largest, Vector3.Distance(a[i], b[i]));
        return largest;
    }

    public void Dispose()
    {
        UnityEngine.Object.DestroyImmediate(character);
    }

    private void Bind(Quaternion modelFromMesh, float meshScale)
    {
        Matrix4x4 worldFromMesh = Matrix4x4.TRS(Vector3.zero, modelFromMesh, Vector3.one * (1f / meshScale));
        Matrix4x4[] bindposes = new Matrix4x4[bones.Length];
        for (int joint = 0; joint < bones.Length; joint++)
            bindposes[joint] = bones[joint].worldToLocalMatrix * worldFromMesh;
        skin.sharedMesh = new Mesh { bindposes = bindposes };
        skin.bones = bones;
    }

    private static Quaternion Any(System.Random random)
    {
        Vector3 axis = new Vector3(1f + (float)random.NextDouble(), (float)random.NextDouble(), (float)random.NextDouble());
        return Quaternion.AngleAxis(360f * (float)random.NextDouble(), axis);
    }
}
