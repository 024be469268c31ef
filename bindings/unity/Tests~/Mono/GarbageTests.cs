// Contract: after its first frames, a garment makes no garbage, whether it moves, stands still,
// sleeps, collides or is one of a crowd.

using System;
using NUnit.Framework;
using Unic;
using UnityEngine;

public sealed class GarbageTests
{
    private const int Frames = 120;

    private TestRig rig;
    private UnicCrowd crowd;
    private GameObject prop;

    [TearDown]
    public void End()
    {
        if (rig != null) rig.Dispose();
        if (crowd != null) UnityEngine.Object.DestroyImmediate(crowd.gameObject);
        if (prop != null) UnityEngine.Object.DestroyImmediate(prop);
    }

    [Test]
    public void TheMeasureSeesAnObject()
    {
        long before = GC.GetAllocatedBytesForCurrentThread();
        object made = new byte[100];
        Assert.Greater(GC.GetAllocatedBytesForCurrentThread() - before, 99f, "bytes");
        GC.KeepAlive(made);
    }

    [Test]
    public void AMovingGarmentMakesNone()
    {
        rig = new TestRig(TestModel.Asset(), 5);
        prop = new GameObject("prop");
        rig.garment.colliders.spheres = new[] { prop.AddComponent<SphereCollider>() };
        rig.garment.colliders.ground = GroundCollision.Collide;
        rig.garment.viewer = prop.transform;
        rig.garment.details = new[] { new DetailLevel(0f, 1f), new DetailLevel(500f, 0.5f) };
        rig.garment.farDistance = 1000f;
        Assert.AreEqual(0L, Bytes(() => rig.Frame(1f / 60f)), "bytes");
        Assert.Greater(rig.garment.Ticks, 60f, "ticks");
    }

    [Test]
    public void APausedAndASleepingGarmentMakeNone()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.Pause();
        Assert.AreEqual(0L, Bytes(() => rig.Frame(1f / 60f)), "bytes of a pause");
        rig.garment.Resume();
        rig.garment.outOfSight = OutOfSight.Sleep;
        rig.shower.isVisible = false;
        Assert.AreEqual(0L, Bytes(() => rig.Frame(1f / 60f)), "bytes of sleep");
    }

    [Test]
    public void ACrowdMakesNone()
    {
        rig = new TestRig(TestModel.Asset());
        crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        rig.garment.Crowd = crowd;
        Assert.AreEqual(0L, Bytes(() => crowd.RunFrame(1f / 60f)), "bytes");
        Assert.Greater(rig.garment.Ticks, 60f, "ticks");
    }

    // Bytes that the frames allocate; poses are set outside of the measured part.
    private long Bytes(Action frame)
    {
        long bytes = 0;
        for (int i = 0; i < 20 + Frames; i++)
        {
            rig.Walk(i / 60f, Vector3.zero);
            if (prop != null) prop.transform.position = new Vector3(0f, 1f, 0.01f * i);
            long before = GC.GetAllocatedBytesForCurrentThread();
            frame();
            if (i >= 20) bytes += GC.GetAllocatedBytesForCurrentThread() - before;
        }
        return bytes;
    }
}
