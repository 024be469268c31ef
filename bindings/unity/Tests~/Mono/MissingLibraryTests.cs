// Contract: without the native library the component and the importer say one sentence each, and the
// project opens. Run without the library on the path: UNIC_TEST_NO_LIBRARY=1.

using System;
using NUnit.Framework;
using Unic;
using Unic.Editor;
using UnityEditor.AssetImporters;
using UnityEngine;

public sealed class MissingLibraryTests
{
    private const string Sentence = "expected the native library unic for this platform, cannot load: ";

    [Test]
    public void AGarmentSaysThatTheLibraryIsMissing()
    {
        IgnoreWithLibrary();
        GameObject cloth = new GameObject("cloth");
        UnicGarment garment = cloth.AddComponent<UnicGarment>();
        garment.model = TestModel.Asset();
        Scene.Frame(1f / 60f);
        StringAssert.Contains(Sentence, garment.Problem);
        Assert.AreEqual(1, Debug.Errors.Count, "errors in the console");
        Assert.AreEqual(0, garment.model.Owners, "owners");
        UnityEngine.Object.DestroyImmediate(cloth);
    }

    [Test]
    public void TheImporterMakesAnAssetAllTheSame()
    {
        IgnoreWithLibrary();
        AssetImportContext context = new AssetImportContext
        {
            assetPath = Environment.GetEnvironmentVariable("UNIC_TEST_MODEL"),
        };
        new UnicModelImporter().OnImportAsset(context);
        Assert.AreEqual(1, context.Errors.Count, "errors");
        StringAssert.Contains(Sentence, context.Errors[0]);
        Assert.IsTrue(context.mainObject is UnicModel, "an asset");
    }

    private static void IgnoreWithLibrary()
    {
        if (Environment.GetEnvironmentVariable("UNIC_TEST_NO_LIBRARY") == null)
            Assert.Ignore("the library is there; run.sh runs these tests a second time without it");
    }
}
