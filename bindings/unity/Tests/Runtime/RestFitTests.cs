using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: the turn and the scale of an importer are found by the joints.</summary>
public sealed class RestFitTests
{
    private static readonly Vector3[] Joints =
    {
        new Vector3(0f, 0.9f, 0f), new Vector3(-0.1f, 0.8f, 0.02f), new Vector3(0.1f, 0.8f, 0.02f),
        new Vector3(-0.1f, 0.1f, -0.05f), new Vector3(0.1f, 0.1f, -0.05f), new Vector3(0f, 1.6f, 0.03f),
    };

    [Test]
    public void EveryQuarterTurnAndScaleIsFound()
    {
        Vector3[] axes = { Vector3.up, Vector3.right, Vector3.forward };
        foreach (float scale in new[] { 1f, 0.01f, 100f })
            foreach (Vector3 first in axes)
                foreach (Vector3 second in axes)
                    for (int turns = 0; turns < 16; turns++)
                    {
                        Quaternion meshFromModel = Quaternion.AngleAxis(90f * (turns % 4), first)
                            * Quaternion.AngleAxis(90f * (turns / 4), second);
                        Check(meshFromModel, scale);
                    }
    }

    [Test]
    public void AnotherRestPoseIsAnErrorInMetres()
    {
        Vector3[] rig = (Vector3[])Joints.Clone();
        rig[5] += new Vector3(0.3f, 0f, 0f);
        RestFit fit = RestFit.Of(rig, Joints);
        Assert.AreEqual(5, fit.worst, "joint");
        Assert.Greater(fit.error, 0.15f, "metres");
    }

    private static void Check(Quaternion meshFromModel, float scale)
    {
        Vector3[] rig = new Vector3[Joints.Length];
        for (int i = 0; i < rig.Length; i++) rig[i] = meshFromModel * Joints[i] * scale + Vector3.one * scale;
        RestFit fit = RestFit.Of(rig, Joints);
        Assert.Less(fit.error, 1e-5f, "metres");
        Assert.AreEqual(1f / scale, fit.scale, 1e-4f / scale, "scale");
        Vector3 there = fit.modelFromMesh * (meshFromModel * new Vector3(1f, 2f, 3f));
        Assert.Less(Vector3.Distance(there, new Vector3(1f, 2f, 3f)), 1e-5f, "a turned vector");
    }
}
