using NUnit.Framework;
using Unic;
using UnityEngine;

/// <summary>Contract: the number format is that of the settings; a slow one is said once.</summary>
public sealed class PrecisionTests
{
    [Test]
    public void AFormatThatIsSlowerThanF32IsSaidOnce()
    {
        foreach (UnicPrecision precision in new[] { UnicPrecision.F32, UnicPrecision.Bf16, UnicPrecision.Int16, UnicPrecision.Int8 })
        {
            Forget();
            bool isSlower = false;
            for (int i = 0; i < 2; i++)
                using (TestRig rig = new TestRig(TestModel.Asset()))
                {
                    rig.garment.settings.precision = precision;
                    rig.Walk(1, 0f, Vector3.zero);
                    isSlower = IsSlower(rig.model, precision);
                }
            Assert.AreEqual(isSlower ? 1 : 0, Debug.Warnings.Count, "warnings about " + precision);
        }
    }

    [Test]
    public void AWarningIsOneSentence()
    {
        Forget();
        for (int i = 0; i < 3; i++) UnicGarment.WarnOnce(UnicPrecision.Bf16);
        Assert.AreEqual(1, Debug.Warnings.Count, "warnings");
        StringAssert.Contains("Bf16 is slower than F32", Debug.Warnings[0]);
    }

    [Test]
    public void TheAllowedErrorReachesTheLibrary()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        foreach (float allowed in new[] { -0.5f, 1.5f, float.NaN })
        {
            InstanceSettings settings = new InstanceSettings { precisionError = allowed };
            UnicException error = Assert.Throws<UnicException>(() => new UnicInstance(model, settings));
            StringAssert.Contains("precision_error", error.Message);
        }
        new UnicInstance(model, new InstanceSettings { precisionError = 0.5f }).Dispose();
        asset.Release();
    }

    private static void Forget()
    {
        UnicGarment.hasWarned = false;
        Debug.Warnings.Clear();
    }

    private static bool IsSlower(UnicModel asset, UnicPrecision precision)
    {
        LoadedModel model = asset.Acquire();
        using (UnicInstance instance = new UnicInstance(model, new InstanceSettings { precision = precision }))
        {
            Assert.AreEqual(precision, instance.Precision);
            bool isSlower = instance.IsSlowerThanF32;
            asset.Release();
            return isSlower;
        }
    }
}
