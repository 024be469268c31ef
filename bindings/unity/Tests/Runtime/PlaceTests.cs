using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: bounds hold all vertices, and parents do not move the mesh.</summary>
public sealed class PlaceTests
{
    private TestRig rig;

    [TearDown]
    public void End()
    {
        if (rig != null) rig.Dispose();
    }

    [Test]
    public void BoundsAreThoseOfTheVertices()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, new Vector3(5f, 0f, 0f));
        Bounds bounds = rig.garment.Mesh.mesh.bounds;
        Vector3 low = bounds.max, high = bounds.min;
        foreach (Vector3 vertex in rig.Vertices())
        {
            Vector3 own = vertex - rig.garment.Anchor;
            for (int axis = 0; axis < 3; axis++)
            {
                low[axis] = Mathf.Min(low[axis], own[axis]);
                high[axis] = Mathf.Max(high[axis], own[axis]);
            }
        }
        Assert.Less(Vector3.Distance(low, bounds.min), 1e-5f, "metres");
        Assert.Less(Vector3.Distance(high, bounds.max), 1e-5f, "metres");
    }

    [Test]
    public void ParentsDoNotMoveTheMesh()
    {
        rig = new TestRig(TestModel.Asset(), 5, 1f, 1.25f);
        rig.Walk(3, 0f, Vector3.zero);
        rig.character.transform.SetPositionAndRotation(new Vector3(1f, 0f, 2f), Quaternion.AngleAxis(40f, Vector3.up));
        rig.Frame(1f / 60f);
        Transform place = rig.garment.transform;
        Assert.Less(Vector3.Distance(place.position, rig.garment.Anchor), 1e-5f, "metres from the anchor");
        Assert.Less(Vector3.Distance(place.lossyScale, Vector3.one), 1e-5f, "scale");
        Assert.Less(Vector3.Distance(place.rotation * Vector3.forward, Vector3.forward), 1e-5f, "turn");
    }

    [Test]
    public void NormalsHaveLengthOneAndFacesLookOutside()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(5, 0f, Vector3.zero);
        int[] faces = rig.garment.Mesh.mesh.triangles;
        int outside = 0;
        for (int i = 0; i < faces.Length; i += 3)
        {
            GarmentVertex a = rig.garment.Mesh[faces[i]], b = rig.garment.Mesh[faces[i + 1]], c = rig.garment.Mesh[faces[i + 2]];
            // In left-handed axes this product of a clockwise triangle points to the viewer.
            Vector3 front = Vector3.Cross(b.position - a.position, c.position - a.position);
            if (Vector3.Dot(front, a.normal) > 0f) outside++;
            Assert.AreEqual(1f, a.normal.magnitude, 1e-3f, "length of a normal");
        }
        Assert.Greater(outside, 0.99f * faces.Length / 3, "faces that look where their normals do");
    }
}
