// Contract: a garment in Unity is the garment of the C interface. The same numbers in give the same
// bits out, mirrored; a rig of Transforms at 60 Hz gives the same vertices up to the rounding of its
// rotations, whatever the axes of the bones and the space of the mesh. A model answers to rounding:
// the C interface itself gives differences of this size when the last digits of the poses change.

using System;
using System.Diagnostics;
using System.IO;
using NUnit.Framework;
using Unic;
using UnityEngine;

public sealed unsafe class ReferenceTests
{
    private const int Frames = 100;

    private static readonly string Folder = Environment.GetEnvironmentVariable("UNIC_TEST_FOLDER");

    // Root positions and rotations from rest in Unity's axes.
    private readonly Vector3[] roots = new Vector3[Frames];
    private readonly Quaternion[][] rotations = new Quaternion[Frames][];

    [Test]
    public void TheSameNumbersGiveTheSameBits()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        MakeMotion(model);
        float[] expected = Reference(UnicIntersection.Model, 0.0);
        using (UnicInstance instance = new UnicInstance(model, InstanceSettings.Default))
        {
            GarmentVertex[] vertices = new GarmentVertex[instance.VertexCount];
            RigPose pose = new RigPose(model.JointCount);
            long differing = 0, count = 0;
            fixed (GarmentVertex* to = vertices)
            {
                for (int frame = 0; frame < Frames; frame++)
                {
                    pose.root = roots[frame];
                    rotations[frame].CopyTo(pose.rotations, 0);
                    if (frame == 0) instance.Reset(pose, new Surroundings(), null);
                    else if (frame % 2 == 0) instance.Step(pose, new Surroundings(), null);
                    instance.Display(pose, frame % 2 == 0 ? 0f : 0.5f, to);
                    float* found = (float*)to;
                    for (int i = 0; i < 6 * vertices.Length; i++, count++)
                        if (Bits(i % 3 == 0 ? -found[i] : found[i]) != Bits(expected[count])) differing++;
                }
            }
            Assert.AreEqual((long)expected.Length, count, "numbers");
            Assert.AreEqual(0L, differing, "differing numbers");
            Console.WriteLine("         " + count + " floats of " + Frames + " frames, all bit-equal");
        }
        asset.Release();
    }

    [Test]
    public void ARigWithTheModelsAxesGivesTheSameVertices()
    {
        Compare("model's axes", 0, 1f, 1f, UnicIntersection.Off);
    }

    [Test]
    public void ARigWithOtherAxesInAnotherSpaceGivesTheSameVertices()
    {
        Compare("other axes, mesh turned by 90 degrees and in centimetres", 7, 100f, 1f, UnicIntersection.Off);
    }

    [Test]
    public void ACharacterOfAnotherSizeGivesScaledVertices()
    {
        Compare("character of 1.25 times the size", 3, 1f, 1.25f, UnicIntersection.Off);
    }

    [Test]
    public void TheModelItselfAnswersToTheLastDigits()
    {
        UnicModel asset = TestModel.Asset();
        MakeMotion(asset.Acquire());
        foreach (UnicIntersection rule in new[] { UnicIntersection.Off, UnicIntersection.Model })
        {
            float[] plain = Reference(rule, 0.0), noisy = Reference(rule, 1e-7);
            float largest = 0f;
            int far = 0;
            for (int i = 0; i < plain.Length; i += 6)
            {
                float distance = Vector3.Distance(At(plain, i), At(noisy, i));
                largest = Mathf.Max(largest, distance);
                if (distance > 1e-4f) far++;
            }
            Report("C interface with itself, poses off by 1e-7, rule " + rule, largest, far, plain.Length / 6);
        }
        asset.Release();
    }

    // Robust handling decides between two ways out of the body by the last digit of a pose.
    [Test]
    public void WithIntersectionsMostVerticesAreTheSame()
    {
        Compare("intersections handled", 7, 100f, 1f, UnicIntersection.Model);
    }

    private void Compare(string what, int seed, float meshScale, float scale, UnicIntersection intersection)
    {
        UnicModel asset = TestModel.Asset();
        MakeMotion(asset.Acquire());
        float[] expected = Reference(intersection, 0.0);
        int far = 0, count = 0;
        float largest = 0f, largestNormal = 0f;
        using (TestRig rig = new TestRig(asset, seed, meshScale, scale))
        {
            rig.garment.settings.intersection = intersection;
            for (int frame = 0; frame < Frames; frame++)
            {
                rig.Pose(roots[frame] * scale, rotations[frame]);
                Scene.Frame(1f / 60f);
                Assert.IsNull(rig.garment.Problem);
                Assert.AreEqual(scale, rig.garment.CharacterScale, 1e-4f, "scale");
                float[] found = rig.garment.Mesh.mesh.Floats(0);
                for (int i = 0; i < found.Length; i += 6, count++)
                {
                    int at = frame * found.Length + i;
                    float distance = Distance(found, i, expected, at, scale);
                    largest = Mathf.Max(largest, distance);
                    largestNormal = Mathf.Max(largestNormal, Distance(found, i + 3, expected, at + 3, 1f));
                    if (distance > 1e-4f) far++;
                }
            }
            Assert.AreEqual(Frames / 2 - 1, rig.garment.Ticks, "ticks");
            Assert.AreEqual(1, rig.garment.Restarts, "restarts");
            Assert.AreEqual(Frames + 1, rig.garment.Mesh.mesh.Uploads - 1, "uploads, with the first one");
        }
        Report(what, largest, far, count);
        Assert.Less(largestNormal, 0.1f, "difference of normals");
        Assert.Less(largest, intersection == UnicIntersection.Off ? 2e-3f : 2e-2f, "metres");
        Assert.Less(far, 0.01f * count, "vertices by over 0.1 mm");
        asset.Release();
    }

    // Walks in a circle, turns, and moves every joint. In f64, so that both programs get one motion.
    private void MakeMotion(LoadedModel model)
    {
        Vector3 rest = model.RestJoints[model.RootJoint];
        for (int frame = 0; frame < Frames; frame++)
        {
            float t = frame / 60f;
            roots[frame] = rest + new Vector3(0.5f * (1f - Mathf.Cos(t)), 0.02f * Mathf.Sin(9f * t), 0.5f * Mathf.Sin(t));
            rotations[frame] = new Quaternion[model.JointCount];
            for (int joint = 0; joint < model.JointCount; joint++) SetRotation(model, frame, joint, t);
        }
    }

    private void SetRotation(LoadedModel model, int frame, int joint, float t)
    {
        int parent = model.jointParents[joint];
        Quaternion own = parent < 0
            ? Quaternion.AngleAxis(t * Mathf.Rad2Deg, Vector3.up)
            : Quaternion.AngleAxis(12f * Mathf.Sin(4f * t + joint), new Vector3(1f, 0.3f * (joint % 3), 0.2f));
        Quaternion before = parent < 0 ? Quaternion.identity : rotations[frame][parent];
        rotations[frame][joint] = RigPose.Normalized(before * own);
    }

    // With noise, the numbers of the poses are off by up to as much.
    private float[] Reference(UnicIntersection intersection, double noise)
    {
        string motion = Path.Combine(Folder, "motion.bin"), result = Path.Combine(Folder, "reference.bin");
        using (BinaryWriter file = new BinaryWriter(File.Create(motion)))
        {
            System.Random random = new System.Random(1);
            file.Write((uint)Frames);
            file.Write((uint)rotations[0].Length);
            for (int frame = 0; frame < Frames; frame++)
            {
                file.Write(-roots[frame].x);
                file.Write(roots[frame].y);
                file.Write(roots[frame].z);
                foreach (Quaternion q in rotations[frame])
                    foreach (float number in new[] { q.x, -q.y, -q.z, q.w })
                        file.Write((float)(number + noise * (2.0 * random.NextDouble() - 1.0)));
            }
        }
        string model = Environment.GetEnvironmentVariable("UNIC_TEST_MODEL");
        ProcessStartInfo start = new ProcessStartInfo(Path.Combine(Folder, "reference"),
            "\"" + model + "\" \"" + motion + "\" \"" + result + "\" " + (uint)intersection) { UseShellExecute = false };
        using (Process process = Process.Start(start))
        {
            process.WaitForExit();
            Assert.AreEqual(0, process.ExitCode, "exit code of the reference");
        }
        byte[] bytes = File.ReadAllBytes(result);
        float[] floats = new float[bytes.Length / 4];
        Buffer.BlockCopy(bytes, 0, floats, 0, bytes.Length);
        return floats;
    }

    private static void Report(string what, float largest, int far, int count)
    {
        Console.WriteLine("         " + what + ": largest difference " + (1e3f * largest).ToString("0.0000") + " mm, "
                          + far + " of " + count + " vertices by over 0.1 mm");
    }

    private static Vector3 At(float[] floats, int i)
    {
        return new Vector3(floats[i], floats[i + 1], floats[i + 2]);
    }

    // Distance of a vector in Unity's axes from one in the model's.
    private static float Distance(float[] found, int i, float[] expected, int at, float scale)
    {
        Vector3 mirrored = new Vector3(-expected[at], expected[at + 1], expected[at + 2]) * scale;
        return Vector3.Distance(At(found, i), mirrored);
    }

    private static uint Bits(float value)
    {
        return *(uint*)&value;
    }
}
