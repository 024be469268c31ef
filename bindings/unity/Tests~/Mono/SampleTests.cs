// Contract: the sample makes a character from a model alone, whose skin is the model's own body, and
// the slider adds and removes characters.

using NUnit.Framework;
using Unic;
using Unic.Samples;
using UnityEngine;

public sealed unsafe class SampleTests
{
    [Test]
    public void TheCrowdWalksAndTheSliderSetsItsNumber()
    {
        UnicModel model = TestModel.Asset();
        GameObject place = new GameObject("scene");
        WalkScene scene = place.AddComponent<WalkScene>();
        scene.model = model;
        scene.characters = 3;
        place.GetComponent<UnicCrowd>().budgetMs = 0f;
        for (int frame = 0; frame < 60; frame++) Scene.Frame(1f / 60f);
        Assert.AreEqual(3, scene.Garments.Count, "characters");
        foreach (UnicGarment garment in scene.Garments)
        {
            Assert.IsNull(garment.Problem);
            Assert.AreEqual(29f, garment.Ticks, 1f, "ticks");
            Assert.AreEqual(1, garment.Restarts, "restarts");
            AssertOnTheBody(garment);
        }
        GUILayout.Slid = 1f;
        Scene.Message(scene, "OnGUI");
        GUILayout.Slid = -1f;
        Scene.Frame(1f / 60f);
        Assert.AreEqual(1, scene.Garments.Count, "characters");
        Assert.AreEqual(2, model.Owners, "owners: a garment and the scene");
        Object.DestroyImmediate(place);
        Assert.AreEqual(0, model.Owners, "owners");
        Scene.Frame(1f / 60f);
    }

    [Test]
    public void TheSkinIsTheModelsBody()
    {
        UnicModel model = TestModel.Asset();
        LoadedModel loaded = model.Acquire();
        GameObject character = new GameObject("character");
        Transform[] bones = WalkBody.Bones(loaded, character.transform);
        SkinnedMeshRenderer skin = character.AddComponent<SkinnedMeshRenderer>();
        skin.sharedMesh = WalkBody.Skin(new UnicModelFile(model.Bytes), bones);
        skin.bones = bones;
        character.AddComponent<ProceduralWalk>().Begin(loaded, bones, Vector3.zero, 1f, 0.4f);
        RigPose pose = new RigPose(loaded.JointCount);
        new UnicRig(loaded, RigMatch.ByName(loaded, skin), MissingJoints.Refuse, 0.01f).Read(pose, Vector3.zero);
        using (UnicInstance instance = new UnicInstance(loaded, InstanceSettings.Default))
        {
            GarmentVertex[] body = new GarmentVertex[instance.BodyVertexCount];
            int[] sources = instance.Sources(Unic.Native.UnicMesh.Body);
            fixed (GarmentVertex* to = body)
            {
                instance.Reset(pose, new Surroundings(), null);
                instance.Body(to);
            }
            float largest = 0f;
            for (int i = 0; i < body.Length; i++)
                largest = Mathf.Max(largest, Vector3.Distance(body[i].position, Skinned(skin, sources[i])));
            System.Console.WriteLine("         largest distance of the skin from the native body: "
                                     + (1e3f * largest).ToString("0.0000") + " mm");
            Assert.Less(largest, 1e-4f, "metres");
        }
        Object.DestroyImmediate(character);
        model.Release();
    }

    private static Vector3 Skinned(SkinnedMeshRenderer skin, int vertex)
    {
        Mesh mesh = skin.sharedMesh;
        BoneWeight w = mesh.boneWeights[vertex];
        Vector3 at = mesh.vertices[vertex];
        return Moved(skin, w.boneIndex0, at) * w.weight0 + Moved(skin, w.boneIndex1, at) * w.weight1
            + Moved(skin, w.boneIndex2, at) * w.weight2 + Moved(skin, w.boneIndex3, at) * w.weight3;
    }

    private static Vector3 Moved(SkinnedMeshRenderer skin, int bone, Vector3 at)
    {
        return (skin.bones[bone].localToWorldMatrix * skin.sharedMesh.bindposes[bone]).MultiplyPoint3x4(at);
    }

    // The shirt is around the chest, and nowhere else.
    private static void AssertOnTheBody(UnicGarment garment)
    {
        Vector3 chest = garment.skin.bones[9].position - garment.Anchor, middle = garment.Mesh.Bounds.center;
        Assert.Less(Vector3.Distance(chest, middle), 0.25f, "metres of the shirt's middle from the chest");
        Assert.Less(garment.Mesh.Bounds.size.magnitude, 2f, "metres of the shirt's size");
    }
}
