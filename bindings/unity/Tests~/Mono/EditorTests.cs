// Contract: the importer makes an asset of a .unic file, and says what is wrong with a damaged one;
// the inspectors show the facts of the model and the joints of the rig.

using System;
using System.IO;
using NUnit.Framework;
using Unic;
using Unic.Editor;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

public sealed class EditorTests
{
    private static readonly string Model = Environment.GetEnvironmentVariable("UNIC_TEST_MODEL");

    [Test]
    public void AFileBecomesAnAsset()
    {
        AssetImportContext context = new AssetImportContext { assetPath = Model };
        new UnicModelImporter().OnImportAsset(context);
        Assert.AreEqual(0, context.Errors.Count, "errors");
        UnicModel asset = (UnicModel)context.mainObject;
        Assert.AreEqual("tshirt", asset.name);
        Assert.AreEqual((int)new FileInfo(Model).Length, asset.Size, "bytes");
        Assert.AreEqual(0, asset.Owners, "owners");
    }

    [Test]
    public void ADamagedFileIsAnImportError()
    {
        string path = Path.Combine(Environment.GetEnvironmentVariable("UNIC_TEST_FOLDER"), "damaged.unic");
        byte[] bytes = File.ReadAllBytes(Model);
        bytes[bytes.Length - 5] ^= 8;
        File.WriteAllBytes(path, bytes);
        AssetImportContext context = new AssetImportContext { assetPath = path };
        new UnicModelImporter().OnImportAsset(context);
        Assert.AreEqual(1, context.Errors.Count, "errors");
        StringAssert.Contains("damaged.unic: ", context.Errors[0]);
        StringAssert.Contains("the file is damaged", context.Errors[0]);
    }

    [Test]
    public void TheInspectorOfAModelShowsItsFacts()
    {
        EditorGUILayout.Lines.Clear();
        UnicModelEditor editor = new UnicModelEditor { target = TestModel.Asset() };
        editor.OnInspectorGUI();
        string shown = string.Join("\n", EditorGUILayout.Lines.ToArray());
        foreach (string fact in new[]
                 {
                     "Vertices: 3788", "Triangles: 7420", "Joints: 24", "Ticks a second: 30", "Size: 6.2 MB",
                     "pelvis, L_hip", "Provenance: garment tshirt on character human", "Trained by: unic 0.1.0",
                 }) StringAssert.Contains(fact, shown);
        Assert.AreEqual(0, ((UnicModel)editor.target).Owners, "owners");
        EditorGUILayout.Lines.Clear();
        editor = new UnicModelEditor { target = UnicModel.FromBytes("none", new byte[20]) };
        editor.OnInspectorGUI();
        StringAssert.Contains("Error: ", EditorGUILayout.Lines[0]);
    }

    [Test]
    public void TheCheckOfARigListsItsJoints()
    {
        using (TestRig rig = new TestRig(TestModel.Asset(), 5))
        {
            rig.bones[22].gameObject.name = "other";
            GUILayout.Pressed.Add("Check the rig");
            UnicGarmentEditor editor = new UnicGarmentEditor { target = rig.garment };
            EditorGUILayout.Lines.Clear();
            editor.OnInspectorGUI();
            GUILayout.Pressed.Clear();
            string shown = string.Join("\n", EditorGUILayout.Lines.ToArray());
            StringAssert.Contains("L_hip: rig:L_hip", shown);
            StringAssert.Contains("L_hand: none", shown);
            StringAssert.Contains("23 of 24 joints have a bone", shown);
            StringAssert.Contains("Error: character: expected bones for the 24 joints of tshirt, missing: L_hand", shown);
            rig.bones[22].gameObject.name = "L_hand";
            RigReport whole = RigReport.Of(rig.garment);
            Assert.IsNull(whole.Problem);
            StringAssert.Contains("largest distance at rest: 0.00 mm", whole.summary[1]);
            Assert.AreEqual(0, rig.model.Owners, "owners");
        }
    }

    [Test]
    public void HeadersThatAreNoneAreRefused()
    {
        byte[] bytes = File.ReadAllBytes(Model);
        foreach (int length in new[] { 0, 7, 8, 100, 5000 })
        {
            byte[] cut = new byte[length];
            Array.Copy(bytes, cut, length);
            Assert.Throws<UnicException>(() => new UnicModelFile(cut));
        }
        System.Random random = new System.Random(1);
        for (int i = 0; i < 300; i++)
        {
            byte[] changed = new byte[9000];
            Array.Copy(bytes, changed, changed.Length);
            BitConverter.GetBytes((long)8000).CopyTo(changed, 0);
            changed[8 + random.Next(8000)] = (byte)random.Next(256);
            try { new UnicModelFile(changed); }
            catch (UnicException) { }
        }
        UnicModelFile file = new UnicModelFile(bytes);
        Assert.AreEqual(3 * 3788, file.Floats("garment.vertices").Length, "numbers");
        Assert.Throws<UnicException>(() => file.Floats("garment.faces"));
        Assert.Throws<UnicException>(() => file.Floats("none"));
    }
}
