// Contract: bones of a humanoid avatar move the garment as named bones do. Avatars are the engine's
// own, so that the stubs stand for one here.

using NUnit.Framework;
using Unic;
using UnityEngine;

public sealed class HumanoidTests
{
    [Test]
    public void AnAvatarWithOtherNamesGivesTheSameVertices()
    {
        UnicModel model = TestModel.Asset();
        using (TestRig named = new TestRig(model, 6), human = new TestRig(model, 6))
        {
            Animator animator = human.character.AddComponent<Animator>();
            LoadedModel loaded = model.Acquire();
            HumanBodyBones[] bones = HumanoidJoints.Of(loaded.jointNames);
            int hands = 0;
            for (int joint = 0; joint < bones.Length; joint++)
            {
                human.bones[joint].gameObject.name = "Bone." + joint;
                if (bones[joint] == HumanBodyBones.LastBone) hands++;
                else animator.Avatar.Add(bones[joint], human.bones[joint]);
            }
            model.Release();
            Assert.AreEqual(2, hands, "joints without a humanoid bone: L_hand, R_hand");
            human.garment.animator = animator;
            human.garment.rigSource = RigSource.Humanoid;
            human.garment.missingJoints = MissingJoints.FollowParent;
            // The body's hands follow the wrists, and do not push the shirt.
            named.bones[22].gameObject.name = named.bones[23].gameObject.name = "none";
            named.garment.missingJoints = MissingJoints.FollowParent;
            named.Walk(20, 0f, Vector3.zero);
            human.Walk(20, 0f, Vector3.zero);
            Assert.IsNull(human.garment.Problem);
            Assert.AreEqual(0f, TestRig.Largest(named.Vertices(), human.Vertices()), "distance");
        }
    }
}
