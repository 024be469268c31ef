// Contract: garments out of sight cost nothing, and come back. Whether a renderer is visible is the
// engine's own decision, so that the stubs say it here.

using NUnit.Framework;
using Unic;
using UnityEngine;

public sealed class SightTests
{
    private TestRig rig;

    [TearDown]
    public void End()
    {
        rig.Dispose();
    }

    [Test]
    public void AGarmentOutOfSightSleepsAndItsBoundsMove()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.outOfSight = OutOfSight.Sleep;
        rig.Walk(20, 0f, Vector3.zero);
        rig.shower.isVisible = false;
        rig.Walk(20, 20f / 60f, Vector3.zero);
        Assert.AreEqual(GarmentActivity.Asleep, rig.garment.Activity);
        int ticks = rig.garment.Ticks, uploads = rig.garment.Mesh.mesh.Uploads;
        Vector3 step = new Vector3(40f, 0f, 0f);
        rig.Walk(10, 40f / 60f, step);
        Assert.AreEqual(ticks, rig.garment.Ticks, "ticks");
        Assert.AreEqual(uploads, rig.garment.Mesh.mesh.Uploads, "uploads");
        Bounds bounds = rig.garment.Mesh.mesh.bounds;
        Vector3 hips = rig.bones[0].position - rig.garment.Anchor;
        Assert.IsTrue(hips.x > bounds.min.x && hips.x < bounds.max.x, "bounds around the moved body");
        rig.shower.isVisible = true;
        rig.Walk(4, 50f / 60f, step);
        Assert.AreEqual(2, rig.garment.Restarts, "restarts");
        Assert.AreEqual(GarmentActivity.Moving, rig.garment.Activity);
    }

    [Test]
    public void AShortLookAwayChangesNothing()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.outOfSight = OutOfSight.Sleep;
        rig.Walk(20, 0f, Vector3.zero);
        rig.shower.isVisible = false;
        rig.Walk(10, 20f / 60f, Vector3.zero);
        rig.shower.isVisible = true;
        rig.Walk(10, 30f / 60f, Vector3.zero);
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        Assert.AreEqual(19, rig.garment.Ticks, "ticks");
    }

    [Test]
    public void AnAwakeningInPlaceGoesOn()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.outOfSight = OutOfSight.Sleep;
        rig.Walk(20, 0f, Vector3.zero);
        rig.shower.isVisible = false;
        for (int frame = 0; frame < 100; frame++) rig.Frame(1f / 60f);
        Assert.AreEqual(GarmentActivity.Asleep, rig.garment.Activity);
        rig.shower.isVisible = true;
        rig.Frame(1f / 60f);
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
    }

    [Test]
    public void CollidersAreDrawn()
    {
        rig = new TestRig(TestModel.Asset());
        GameObject prop = new GameObject("prop");
        rig.garment.colliders.spheres = new[] { prop.AddComponent<SphereCollider>() };
        rig.garment.colliders.capsules = new[] { prop.AddComponent<CapsuleCollider>() };
        rig.garment.colliders.ground = GroundCollision.Collide;
        Gizmos.Drawn.Clear();
        Scene.Message(rig.garment, "OnDrawGizmosSelected");
        Assert.AreEqual(1 + 1 + 2 + 4, Gizmos.Drawn.Count, "gizmos");
        UnityEngine.Object.DestroyImmediate(prop);
    }
}
