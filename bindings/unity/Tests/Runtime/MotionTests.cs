using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: teleports, pauses, sleep, distance, saved states and shifts of the origin.</summary>
public sealed class MotionTests
{
    private const float Frame = 1f / 60f;
    private static readonly Vector3 Here = Vector3.zero;
    private static readonly Vector3 There = new Vector3(20f, 0f, -7f);

    private TestRig rig;

    [TearDown]
    public void End()
    {
        if (rig != null) rig.Dispose();
    }

    [Test]
    public void ATeleportBeginsAnewAtTheOtherPlace()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(20, 0f, Here);
        rig.garment.Teleport();
        rig.Walk(1, 0f, There);
        Assert.AreEqual(2, rig.garment.Restarts, "restarts");
        using (TestRig fresh = new TestRig(TestModel.Asset()))
        {
            fresh.Walk(1, 0f, There);
            Assert.AreEqual(0f, TestRig.Largest(rig.Vertices(), fresh.Vertices()), "distance from a new garment");
        }
    }

    [Test]
    public void AJumpOfTheRootIsATeleport()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(20, 0f, Here);
        rig.Walk(5, 20f * Frame, There);
        Assert.AreEqual(2, rig.garment.Restarts, "restarts");
    }

    [Test]
    public void FastMotionIsNotATeleport()
    {
        rig = new TestRig(TestModel.Asset());
        for (int frame = 0; frame < 20; frame++)
        {
            rig.Walk(0f, new Vector3(0f, 0f, 12f * Frame * frame));
            rig.Frame(Frame);
        }
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        rig.garment.teleportSpeed = 0f;
        rig.Walk(0f, There);
        rig.Frame(Frame);
        Assert.AreEqual(1, rig.garment.Restarts, "restarts without detection");
    }

    [Test]
    public void APausedGarmentFollowsTheBody()
    {
        CheckThatAPausedGarmentFollows(DisplayRate.EveryFrame);
    }

    [Test]
    public void APausedGarmentThatIsShownByTicksFollowsTheBody()
    {
        CheckThatAPausedGarmentFollows(DisplayRate.EveryTick);
    }

    private void CheckThatAPausedGarmentFollows(DisplayRate rate)
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.displayRate = rate;
        rig.Walk(21, 0f, Here);
        int ticks = rig.garment.Ticks;
        rig.garment.Pause();
        rig.Walk(20f * Frame, Here);
        rig.Frame(Frame);
        Vector3[] still = rig.Vertices();
        Vector3 step = new Vector3(3f, 0f, 1f);
        rig.Walk(20f * Frame, step);
        rig.Frame(Frame);
        for (int i = 0; i < still.Length; i++) still[i] += step;
        Assert.Less(TestRig.Largest(still, rig.Vertices()), 1e-5f, "metres from the moved shape");
        Assert.AreEqual(ticks, rig.garment.Ticks, "ticks");
        Assert.AreEqual(GarmentActivity.Still, rig.garment.Activity);
    }

    [Test]
    public void APauseInPlaceEndsWithoutARestart()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        rig.garment.Pause();
        for (int frame = 0; frame < 100; frame++) rig.Frame(Frame);
        rig.garment.Resume();
        rig.Walk(9, 21f * Frame, Here);
        Vector3[] paused = rig.Vertices();
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        using (TestRig other = new TestRig(TestModel.Asset()))
        {
            other.Walk(30, 0f, Here);
            Assert.AreEqual(other.garment.Ticks, rig.garment.Ticks, "ticks");
            // The seconds of the poses are rounded in another way.
            Assert.Less(TestRig.Largest(paused, other.Vertices()), 1e-3f, "metres from a garment without a pause");
        }
    }

    [Test]
    public void APauseDuringWhichTheBodyMovesEndsWithARestart()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        rig.garment.Pause();
        rig.Walk(10, 0f, There);
        Assert.AreEqual(1, rig.garment.Restarts, "restarts during the pause");
        rig.garment.Resume();
        rig.Walk(2, 0f, There);
        Assert.AreEqual(2, rig.garment.Restarts, "restarts");
    }

    [Test]
    public void WithoutTimeNothingMoves()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        Vector3[] shape = rig.Vertices();
        int ticks = rig.garment.Ticks;
        for (int frame = 0; frame < 10; frame++) rig.Frame(0f);
        Assert.AreEqual(ticks, rig.garment.Ticks, "ticks");
        Assert.Less(TestRig.Largest(shape, rig.Vertices()), 1e-6f, "metres");
    }

    [Test]
    public void AFarGarmentStandsStill()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.viewer = new GameObject("viewer").transform;
        rig.garment.farDistance = 10f;
        rig.Walk(20, 0f, Here);
        Assert.AreEqual(GarmentActivity.Moving, rig.garment.Activity);
        int ticks = rig.garment.Ticks;
        rig.garment.viewer.position = new Vector3(0f, 0f, 50f);
        rig.Walk(20, 20f * Frame, Here);
        Assert.AreEqual(GarmentActivity.Still, rig.garment.Activity);
        Assert.AreEqual(ticks, rig.garment.Ticks, "ticks");
        UnityEngine.Object.DestroyImmediate(rig.garment.viewer.gameObject);
    }

    [Test]
    public void DetailChangesWithTheDistanceAndGoesOn()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.viewer = new GameObject("viewer").transform;
        rig.garment.details = new[] { new DetailLevel(0f, 1f), new DetailLevel(5f, 0.25f), new DetailLevel(15f, 0.1f, UnicIntersection.Off) };
        rig.Walk(30, 0f, Here);
        Vector3[] before = rig.Vertices();
        foreach (float distance in new[] { 8f, 30f, 0f })
        {
            rig.garment.viewer.position = new Vector3(0f, 0f, distance + 1f);
            rig.Frame(0f);
            int expected = distance < 5f ? 0 : distance < 15f ? 1 : 2;
            Assert.AreEqual(expected, rig.garment.Detail, "level");
            Assert.Less(TestRig.Largest(before, rig.Vertices()), 0.05f, "metres from the other level");
        }
        rig.Walk(10, 30f * Frame, Here);
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        UnityEngine.Object.DestroyImmediate(rig.garment.viewer.gameObject);
    }

    [Test]
    public void DetailIsKeptNearABorder()
    {
        DetailLevel[] levels = { new DetailLevel(0f, 1f), new DetailLevel(10f, 0.5f) };
        Assert.AreEqual(0, DetailLevel.At(levels, 10.2f, 0));
        Assert.AreEqual(1, DetailLevel.At(levels, 10.6f, 0));
        Assert.AreEqual(1, DetailLevel.At(levels, 9.8f, 1));
        Assert.AreEqual(0, DetailLevel.At(levels, 9.4f, 1));
        Assert.AreEqual(0, DetailLevel.At(null, 100f, 0));
    }

    [Test]
    public void ARestoredStateGoesOnWithTheSameVertices()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        byte[] state = rig.garment.SaveState();
        rig.Walk(11, 21f * Frame, Here);
        Vector3[] first = rig.Vertices();
        rig.Walk(20, 2f, There);
        rig.Walk(20f * Frame, Here);
        rig.garment.RestoreState(state);
        rig.Walk(11, 21f * Frame, Here);
        Assert.AreEqual(0f, TestRig.Largest(first, rig.Vertices()), "distance");
        UnicException error = Assert.Throws<UnicException>(() => rig.garment.RestoreState(new byte[100]));
        Assert.Greater(error.Message.Length, 10f, "length of the sentence");
    }

    [Test]
    public void AStateWithoutAPlaceOrATimeIsRefusedAndChangesNothing()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        byte[] state = rig.garment.SaveState();
        Vector3[] expected = rig.Vertices();
        foreach (double seconds in new[] { double.NaN, double.PositiveInfinity, -1e9, 1e9 })
        {
            byte[] wrong = (byte[])state.Clone();
            System.Buffer.BlockCopy(new[] { seconds }, 0, wrong, wrong.Length - 8, 8);
            UnicException error = Assert.Throws<UnicException>(() => rig.garment.RestoreState(wrong));
            StringAssert.Contains("seconds since the tick", error.Message);
        }
        foreach (float metres in new[] { float.NaN, float.NegativeInfinity })
        {
            byte[] wrong = (byte[])state.Clone();
            System.Buffer.BlockCopy(new[] { metres }, 0, wrong, wrong.Length - 16, 4);
            UnicException error = Assert.Throws<UnicException>(() => rig.garment.RestoreState(wrong));
            StringAssert.Contains("anchor", error.Message);
        }
        Assert.AreEqual(0f, TestRig.Largest(expected, rig.Vertices()), "distance");
        rig.garment.RestoreState(state);
        int ticks = rig.garment.Ticks;
        rig.Walk(4, 21f * Frame, Here);
        Assert.AreEqual(ticks + 2, rig.garment.Ticks, "ticks");
    }

    [Test]
    public void ABodyThatIsPlacedAfterARestoredStateIsNoTeleport()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(21, 0f, Here);
        byte[] state = rig.garment.SaveState();
        rig.Walk(11, 21f * Frame, Here);
        Vector3[] expected = rig.Vertices();
        rig.Walk(20, 2f, There);
        int restarts = rig.garment.Restarts;
        rig.garment.RestoreState(state);
        rig.Walk(11, 21f * Frame, Here);
        Assert.AreEqual(restarts, rig.garment.Restarts, "restarts");
        Assert.Less(TestRig.Largest(expected, rig.Vertices()), 1e-4f, "metres");
    }

    [Test]
    public void AShiftOfTheOriginMovesNothing()
    {
        rig = new TestRig(TestModel.Asset());
        Vector3 shift = new Vector3(-512f, 0f, 1024f);
        rig.Walk(21, 0f, Here);
        byte[] state = rig.garment.SaveState();
        rig.Walk(10, 21f * Frame, Here);
        Vector3[] expected = rig.Vertices();
        rig.Walk(20f * Frame, Here);
        rig.garment.RestoreState(state);
        rig.garment.ShiftOrigin(shift);
        rig.Walk(10, 21f * Frame, shift);
        Vector3[] found = rig.Vertices();
        for (int i = 0; i < found.Length; i++) found[i] -= shift;
        Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        Assert.Less(TestRig.Largest(expected, found), 2e-3f, "metres");
    }

    [Test]
    public void FarFromTheOriginTheAnchorKeepsTheDigits()
    {
        rig = new TestRig(TestModel.Asset());
        Vector3 far = new Vector3(6400f, 0f, -12800f);
        rig.Walk(1, 0f, far);
        Vector3[] there = new Vector3[rig.garment.Mesh.Count];
        for (int i = 0; i < there.Length; i++) there[i] = rig.garment.Mesh[i].position;
        Assert.AreEqual(0f, Vector3.Distance(rig.garment.Anchor, far), 0f, "anchor");
        Assert.AreEqual(0f, Vector3.Distance(rig.garment.transform.position, far), 0f, "place of the mesh");
        using (TestRig near = new TestRig(TestModel.Asset()))
        {
            near.Walk(1, 0f, Here);
            Assert.Less(TestRig.Largest(there, near.Vertices()), 3e-3f, "metres, where f32 has steps of 1 mm");
        }
    }

    [Test]
    public void EveryTickIsShownWithoutADisplayBetween()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.displayRate = DisplayRate.EveryTick;
        int shown = 0;
        rig.garment.Shown += garment => shown++;
        rig.Walk(21, 0f, Here);
        Assert.AreEqual(10, rig.garment.Ticks, "ticks");
        Assert.AreEqual(11, shown, "shapes: the first frame and the ticks");
    }
}
