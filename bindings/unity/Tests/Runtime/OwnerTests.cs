using System;
using NUnit.Framework;
using Unic;

/// <summary>Contract: native models and instances are released once, by the last owner.</summary>
public sealed unsafe class OwnerTests
{
    [Test]
    public void TheLastGarmentReleasesTheModel()
    {
        UnicModel model = TestModel.Asset();
        TestRig first = new TestRig(model), second = new TestRig(model);
        first.Walk(1, 0f, UnityEngine.Vector3.zero);
        second.Walk(1, 0f, UnityEngine.Vector3.zero);
        Assert.AreEqual(2, model.Owners, "owners");
        first.garment.enabled = false;
        Assert.AreEqual(1, model.Owners, "owners");
        first.garment.enabled = true;
        first.Walk(1, 0f, UnityEngine.Vector3.zero);
        Assert.AreEqual(2, model.Owners, "owners");
        first.Dispose();
        second.Dispose();
        Assert.AreEqual(0, model.Owners, "owners");
        Assert.Throws<InvalidOperationException>(() => model.Release());
    }

    [Test]
    public void InstancesOutliveTheModel()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        RigPose pose = new RigPose(model.JointCount);
        UnicInstance instance = new UnicInstance(model, InstanceSettings.Default);
        asset.Release();
        Assert.Throws<ObjectDisposedException>(() => new UnicInstance(model, InstanceSettings.Default));
        instance.Reset(pose, new Surroundings());
        instance.Step(pose, new Surroundings());
        GarmentVertex[] vertices = new GarmentVertex[instance.VertexCount];
        instance.Display(pose, 0.5f, vertices);
        Assert.AreEqual(1f, vertices[vertices.Length - 1].normal.magnitude, 1e-3f, "length of a normal");
        Assert.Throws<UnicException>(() => instance.Display(pose, 0.5f, new GarmentVertex[3]));
        instance.Dispose();
        instance.Dispose();
        Assert.Throws<ObjectDisposedException>(() => instance.Step(pose, new Surroundings(), null));
    }

    [Test]
    public void TheLibraryTellsItsVersion()
    {
        Assert.IsTrue(UnicLibrary.Version.Length >= 5, "a version such as 0.1.0");
        Assert.IsTrue(UnicLibrary.HasPool, "threads of the library");
    }

    [Test]
    public void NativeErrorsAreSentencesWithACode()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        using (UnicInstance instance = new UnicInstance(model, InstanceSettings.Default))
        {
            UnicException error = Assert.Throws<UnicException>(
                () => instance.Step(new RigPose(model.JointCount - 1), new Surroundings(), null));
            Assert.AreEqual(Unic.Native.UnicStatus.WrongSize, error.Status);
            StringAssert.Contains("number of joints of the pose: expected 24, found 23", error.Message);
            RigPose pose = new RigPose(model.JointCount);
            pose.root.x = float.NaN;
            Assert.AreEqual(Unic.Native.UnicStatus.InvalidValue,
                Assert.Throws<UnicException>(() => instance.Step(pose, new Surroundings(), null)).Status);
        }
        asset.Release();
    }
}
