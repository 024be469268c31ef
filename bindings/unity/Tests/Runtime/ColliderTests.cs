using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: balls, capsules and the ground push the garment where Unity shows them.</summary>
/// <remarks>The body goes first: between it and a prop the cloth stays on the body.</remarks>
public sealed class ColliderTests
{
    private const float Radius = 0.04f;
    private const float Reach = 0.02f;

    private TestRig rig;
    private GameObject prop;

    [TearDown]
    public void End()
    {
        if (rig != null) rig.Dispose();
        if (prop != null) UnityEngine.Object.DestroyImmediate(prop);
    }

    [Test]
    public void ABallPushesAndADisabledOneDoesNot()
    {
        Vector3 place;
        SphereCollider ball = Prop<SphereCollider>(out place);
        ball.radius = 0.5f * Radius;
        ball.transform.localScale = Vector3.one * 2f;
        rig.garment.colliders.spheres = new[] { ball, null };
        float pushed = Deepest(place);
        ball.enabled = false;
        float free = Deepest(place);
        Assert.Greater(free, Reach - 5e-3f, "depth without the ball");
        Assert.Less(pushed, 0.6f * free, "depth with the ball");
    }

    [Test]
    public void ABallOnTheOtherSideDoesNotPush()
    {
        Vector3 place;
        SphereCollider ball = Prop<SphereCollider>(out place);
        ball.radius = Radius;
        ball.transform.position = new Vector3(-place.x, place.y, place.z);
        rig.garment.colliders.spheres = new[] { ball };
        Assert.Greater(Deepest(place), Reach - 5e-3f, "depth in a ball that is not there");
    }

    [Test]
    public void ACapsulePushes()
    {
        Vector3 place;
        CapsuleCollider capsule = Prop<CapsuleCollider>(out place);
        capsule.radius = Radius;
        capsule.height = 0.4f;
        capsule.direction = 2;
        rig.garment.colliders.capsules = new[] { capsule };
        Assert.Less(Deepest(place), 0.6f * Reach, "depth in the capsule");
    }

    [Test]
    public void CapsulesScaleAsUnityScalesThem()
    {
        prop = new GameObject("prop");
        CapsuleCollider capsule = prop.AddComponent<CapsuleCollider>();
        capsule.radius = 0.5f;
        capsule.height = 3f;
        capsule.direction = 1;
        prop.transform.localScale = new Vector3(1f, 2f, 3f);
        prop.transform.SetPositionAndRotation(new Vector3(1f, 0f, 0f), Quaternion.AngleAxis(90f, Vector3.forward));
        ColliderShape shape = ColliderShape.Of(capsule);
        Assert.AreEqual(1.5f, shape.radius, 1e-5f);
        Assert.Less(Vector3.Distance(shape.b - shape.a, new Vector3(-3f, 0f, 0f)), 1e-4f, "axis");
        capsule.height = 0.1f;
        Assert.IsTrue(ColliderShape.Of(capsule).IsSphere, "a ball where there is no room for an axis");
    }

    [Test]
    public void TheGroundLiftsTheHem()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(3, 0f, Vector3.zero);
        float lowest = Lowest(), ground = lowest + 0.03f;
        rig.garment.colliders.groundHeight = ground;
        rig.Walk(6, 0f, Vector3.zero);
        Assert.Less(Lowest(), ground - 0.02f, "height of the hem where the ground is ignored");
        rig.garment.colliders.ground = GroundCollision.Collide;
        rig.Walk(6, 0f, Vector3.zero);
        Assert.Greater(Lowest(), ground - 8e-3f, "height of the hem");
    }

    // A prop that reaches into the sleeve on the side of +x.
    private T Prop<T>(out Vector3 place) where T : Collider, new()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.settings.intersection = UnicIntersection.Robust;
        rig.Walk(3, 0f, Vector3.zero);
        place = Vector3.zero;
        foreach (Vector3 vertex in rig.Vertices())
            if (vertex.x > place.x) place = vertex;
        place.x += Radius - Reach;
        prop = new GameObject("prop");
        prop.transform.position = place;
        return prop.AddComponent<T>();
    }

    // Depth of the deepest vertex under the surface of the prop, after some ticks.
    private float Deepest(Vector3 place)
    {
        for (int tick = 0; tick < 4; tick++) rig.Frame(1f / 30f);
        float nearest = float.PositiveInfinity;
        foreach (Vector3 vertex in rig.Vertices()) nearest = Mathf.Min(nearest, Vector3.Distance(vertex, place));
        return Radius - nearest;
    }

    private float Lowest()
    {
        float lowest = float.PositiveInfinity;
        foreach (Vector3 vertex in rig.Vertices()) lowest = Mathf.Min(lowest, vertex.y);
        return lowest;
    }
}
