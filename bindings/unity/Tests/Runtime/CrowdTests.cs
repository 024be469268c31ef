using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: a crowd shows what its garments show alone, and keeps to its time.</summary>
public sealed class CrowdTests
{
    private const int Members = 16;

    [Test]
    public void SixteenGarmentsAreThoseThatRunAlone()
    {
        UnicModel model = TestModel.Asset();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.budgetMs = 0f;
        TestRig[] rigs = Rigs(model, crowd);
        TestRig alone = new TestRig(model);
        for (int frame = 0; frame < 20; frame++)
        {
            for (int i = 0; i < Members; i++) rigs[i].Walk(frame / 60f, Place(i));
            crowd.RunFrame(1f / 60f);
            alone.Walk(frame / 60f, Place(5));
            alone.Frame(1f / 60f);
        }
        foreach (TestRig rig in rigs) Assert.AreEqual(9, rig.garment.Ticks, "ticks");
        Assert.AreEqual(0f, TestRig.Largest(rigs[5].Vertices(), alone.Vertices()), "distance from a garment alone");
        Assert.AreEqual(Members, crowd.Count, "members");
        Assert.AreEqual(Members + 1, model.Owners, "owners");
        alone.Dispose();
        End(rigs, crowd);
        Assert.AreEqual(0, crowd.Count, "members");
        Assert.AreEqual(0, model.Owners, "owners");
    }

    [Test]
    public void WithoutTimeEveryGarmentHasItsTurn()
    {
        UnicModel model = TestModel.Asset();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.budgetMs = 1e-6f;
        TestRig[] rigs = Rigs(model, crowd);
        for (int frame = 0; frame < 4 * Members + 2; frame++)
        {
            for (int i = 0; i < Members; i++) rigs[i].Walk(frame / 60f, Place(i));
            crowd.RunFrame(1f / 60f);
            if (frame >= 2) Assert.AreEqual(1, crowd.Ticks, "ticks a frame");
        }
        foreach (TestRig rig in rigs) Assert.AreEqual(4f, rig.garment.Ticks, 1f, "ticks of a garment");
        foreach (TestRig rig in rigs) Assert.AreEqual(1, rig.garment.Restarts, "restarts");
        Assert.Greater(crowd.Waiting, 10f, "garments that wait");
        End(rigs, crowd);
    }

    [Test]
    public void ABrokenMemberDoesNotStopTheOthers()
    {
        UnicModel model = TestModel.Asset();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.budgetMs = 0f;
        TestRig[] rigs = Rigs(model, crowd);
        rigs[3].skin.bones = new Transform[0];
        for (int frame = 0; frame < 4; frame++) crowd.RunFrame(1f / 30f);
        Assert.IsTrue(rigs[3].garment.Problem != null, "a problem");
        Assert.IsNull(rigs[4].garment.Problem);
        Assert.Greater(rigs[4].garment.Ticks, 0f, "ticks");
        End(rigs, crowd);
    }

    [Test]
    public void AnExceptionOfAHandlerDoesNotStopTheOthers()
    {
        UnicModel model = TestModel.Asset();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.budgetMs = 0f;
        TestRig[] rigs = Rigs(model, crowd);
        int shown = 0;
        rigs[3].garment.Shown += garment => { throw new UnicException("on purpose"); };
        rigs[4].garment.Shown += garment => shown++;
        for (int frame = 0; frame < 4; frame++) crowd.RunFrame(1f / 30f);
        Assert.Greater(shown, 3f, "frames of another garment");
        Assert.IsNull(rigs[3].garment.Problem);
        Assert.Greater(rigs[3].garment.Ticks, 2f, "ticks of the garment");
        End(rigs, crowd);
    }

    [Test]
    public void AHandlerThatDisablesMembersLeavesTheOthersTheirFrame()
    {
        UnicModel model = TestModel.Asset();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.budgetMs = 0f;
        TestRig[] rigs = Rigs(model, crowd);
        int[] shown = new int[Members];
        for (int i = 0; i < Members; i++)
        {
            int member = i;
            rigs[i].garment.Shown += garment => shown[member]++;
        }
        // In the first frame, while the others begin: one before it and one after it.
        rigs[3].garment.Shown += garment => rigs[2].garment.enabled = rigs[9].garment.enabled = false;
        crowd.RunFrame(1f / 30f);
        Assert.AreEqual(Members - 2, crowd.Count, "members");
        Assert.AreEqual(0, rigs[9].garment.Ticks + shown[9], "a disabled garment stands still");
        Assert.AreEqual(Members - 2, model.Owners, "owners");
        // In a later one, itself: the next one in the list must not lose its frame.
        rigs[5].garment.Shown += garment => garment.enabled = false;
        int before = shown[6];
        crowd.RunFrame(1f / 30f);
        Assert.AreEqual(before + 1, shown[6], "frames of the next garment");
        Assert.AreEqual(Members - 3, crowd.Count, "members");
        End(rigs, crowd);
    }

    private static TestRig[] Rigs(UnicModel model, UnicCrowd crowd)
    {
        TestRig[] rigs = new TestRig[Members];
        for (int i = 0; i < Members; i++)
        {
            rigs[i] = new TestRig(model);
            rigs[i].garment.Crowd = crowd;
        }
        return rigs;
    }

    private static Vector3 Place(int member)
    {
        return new Vector3(2f * (member % 4), 0f, 2f * (member / 4));
    }

    private static void End(TestRig[] rigs, UnicCrowd crowd)
    {
        foreach (TestRig rig in rigs) rig.Dispose();
        UnityEngine.Object.DestroyImmediate(crowd.gameObject);
    }
}
