using System.Text.RegularExpressions;
using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: a rig that does not fit gives one sentence, and no garment.</summary>
public sealed class RigTests
{
    private TestRig rig;

    [TearDown]
    public void End()
    {
        if (rig != null) rig.Dispose();
    }

    [Test]
    public void ThePoseThatIsReadIsThePoseThatWasSet()
    {
        CheckPose(0, 1f, 1f);
        CheckPose(7, 1f, 1f);
        CheckPose(8, 100f, 1f);
        CheckPose(9, 0.01f, 1.25f);
    }

    private static void CheckPose(int seed, float meshScale, float scale)
    {
        UnicModel model = TestModel.Asset();
        using (TestRig rig = new TestRig(model, seed, meshScale, scale))
        {
            LoadedModel loaded = model.Acquire();
            UnicRig bones = new UnicRig(loaded, RigMatch.ByName(loaded, rig.skin), MissingJoints.Refuse, 1e-3f);
            Quaternion[] set = new Quaternion[loaded.JointCount];
            for (int joint = 0; joint < set.Length; joint++)
                set[joint] = Quaternion.AngleAxis(170f * Mathf.Sin(joint), new Vector3(1f, joint, 3f));
            Vector3 root = new Vector3(1f, 2f, 3f), shift = new Vector3(4f, 0f, -2f);
            rig.Pose(root, set);
            // The object of the character moves and turns all of it.
            Quaternion turn = Quaternion.AngleAxis(40f, Vector3.up);
            rig.character.transform.SetPositionAndRotation(shift, turn);
            RigPose read = new RigPose(loaded.JointCount);
            bones.Read(read, Vector3.one);
            Assert.AreEqual(scale, bones.scale, 1e-5f, "size");
            Assert.Less(Vector3.Distance(read.root, turn * root + shift - Vector3.one), 5e-6f, "metres of the root");
            for (int joint = 0; joint < set.Length; joint++)
            {
                Quaternion expected = turn * set[joint], found = read.rotations[joint];
                float cosine = expected.x * found.x + expected.y * found.y + expected.z * found.z + expected.w * found.w;
                Assert.Less(1f - Mathf.Abs(cosine), 1e-6f, "difference of a rotation");
                Vector3 there = expected * Vector3.one - found * Vector3.one;
                // Products of a chain of bones are rounded ten times.
                Assert.Less(there.magnitude, 5e-5f, "distance of a turned vector");
            }
            model.Release();
        }
    }

    [Test]
    public void MissingBonesAreNamed()
    {
        rig = new TestRig(TestModel.Asset());
        for (int joint = 0; joint < 9; joint++) rig.bones[joint].gameObject.name = "bone" + joint;
        Refused("character: expected bones for the 24 joints of tshirt, missing: pelvis, L_hip, R_hip, spine1, L_knee "
                + "and 4 more");
    }

    [Test]
    public void ARepairedRigBeginsAfterRebind()
    {
        rig = new TestRig(TestModel.Asset());
        rig.bones[3].gameObject.name = "other";
        Refused("missing: spine1");
        rig.bones[3].gameObject.name = "Spine1";
        rig.garment.Rebind();
        rig.Walk(3, 0f, Vector3.zero);
        Assert.IsNull(rig.garment.Problem);
        Assert.AreEqual(1, rig.garment.Ticks, "ticks");
    }

    [Test]
    public void AMissingHandFollowsTheArm()
    {
        rig = new TestRig(TestModel.Asset(), 4);
        rig.bones[22].gameObject.name = "other";
        rig.garment.missingJoints = MissingJoints.FollowParent;
        rig.Walk(3, 0f, Vector3.zero);
        Assert.IsNull(rig.garment.Problem);
        rig.bones[0].gameObject.name = "another";
        rig.garment.Rebind();
        Refused("missing: pelvis, L_hand");
    }

    [Test]
    public void AnotherRestPoseIsRefused()
    {
        rig = new TestRig(TestModel.Asset());
        Matrix4x4[] poses = rig.skin.sharedMesh.bindposes;
        poses[20] = Matrix4x4.TRS(new Vector3(0f, 0.3f, 0f), Quaternion.identity, Vector3.one) * poses[20];
        rig.skin.sharedMesh.bindposes = poses;
        Refused("expected the rest pose of tshirt to within 0.050 m, found joint L_wrist");
    }

    [Test]
    public void MergedBonesAreExplained()
    {
        rig = new TestRig(TestModel.Asset());
        rig.skin.bones = new Transform[0];
        Refused("switch off Optimize Game Objects");
    }

    [Test]
    public void AGarmentOverTheBonesIsRefused()
    {
        rig = new TestRig(TestModel.Asset());
        rig.bones[0].SetParent(rig.garment.transform, true);
        Refused("expected an object beside the bones, found a parent of rig:pelvis");
    }

    [Test]
    public void NoModelNoSkinAndNoAvatarAreSentences()
    {
        rig = new TestRig(TestModel.Asset());
        rig.garment.rigSource = RigSource.Humanoid;
        Refused("expected an Animator with a humanoid avatar, found none");
        rig.garment.rigSource = RigSource.Names;
        rig.garment.skin = null;
        rig.garment.Rebind();
        Refused("expected a skinned mesh or given bones, found none");
        rig.garment.model = null;
        rig.garment.Rebind();
        Refused("expected a model, found none");
    }

    [Test]
    public void ADamagedModelIsASentence()
    {
        rig = new TestRig(TestModel.Asset());
        byte[] bytes = (byte[])rig.model.Bytes.Clone();
        bytes[bytes.Length / 2] ^= 1;
        rig.garment.model = UnicModel.FromBytes("broken", bytes);
        Refused("damaged");
        rig.garment.model = UnicModel.FromBytes("empty", new byte[0]);
        rig.garment.Rebind();
        Refused("");
    }

    [Test]
    public void DestroyedBonesAreASentence()
    {
        rig = new TestRig(TestModel.Asset());
        rig.Walk(3, 0f, Vector3.zero);
        UnityEngine.Object.DestroyImmediate(rig.bones[20].gameObject);
        Refused("expected the bones of the rig, found destroyed ones");
    }

    [Test]
    public void GivenBonesNeedNoSkin()
    {
        rig = new TestRig(TestModel.Asset(), 9);
        rig.garment.Bind(rig.bones, rig.skin.sharedMesh.bindposes);
        rig.garment.skin = null;
        rig.Walk(3, 0f, Vector3.zero);
        Assert.IsNull(rig.garment.Problem);
        rig.garment.Bind(new Transform[3], new Matrix4x4[3]);
        Refused("expected 24 bones and bind poses, found 3 and 3");
    }

    [Test]
    public void NamesOfHumanoidBonesAreKnown()
    {
        HumanBodyBones[] smpl = HumanoidJoints.Of(new[] { "pelvis", "L_shoulder", "L_collar", "L_foot", "R_hand", "spine3" });
        Assert.AreEqual(HumanBodyBones.Hips, smpl[0]);
        Assert.AreEqual(HumanBodyBones.LeftUpperArm, smpl[1]);
        Assert.AreEqual(HumanBodyBones.LeftShoulder, smpl[2]);
        Assert.AreEqual(HumanBodyBones.LeftToes, smpl[3]);
        Assert.AreEqual(HumanBodyBones.LastBone, smpl[4]);
        Assert.AreEqual(HumanBodyBones.UpperChest, smpl[5]);
        HumanBodyBones[] mixamo = HumanoidJoints.Of(new[] { "mixamorig:Hips", "mixamorig:LeftShoulder", "mixamorig:RightFoot" });
        Assert.AreEqual(HumanBodyBones.Hips, mixamo[0]);
        Assert.AreEqual(HumanBodyBones.LeftShoulder, mixamo[1]);
        Assert.AreEqual(HumanBodyBones.RightFoot, mixamo[2]);
    }

    // One sentence in the component, without line breaks; later frames repeat nothing.
    private void Refused(string part)
    {
        rig.Frame(1f / 60f);
        rig.Frame(1f / 60f);
        StringAssert.Contains(part, rig.garment.Problem);
        Assert.IsFalse(Regex.IsMatch(rig.garment.Problem, @"\n|\. [A-Z]"), "one sentence");
        Assert.AreEqual(GarmentActivity.None, rig.garment.Activity);
        Assert.IsTrue(rig.garment.Mesh == null, "no mesh");
        if (rig.garment.model != null) Assert.AreEqual(0, rig.garment.model.Owners, "owners of the model");
    }
}
