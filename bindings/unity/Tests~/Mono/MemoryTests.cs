// Contract: garments that come and go leave nothing behind: no arrays of the engine, no owners of
// models, no native memory.

using System;
using System.IO;
using NUnit.Framework;
using Unic;
using Unity.Collections;
using UnityEngine;

public sealed class MemoryTests
{
    [Test]
    public void GarmentsThatComeAndGoLeaveNothing()
    {
        UnicModel model = TestModel.Asset();
        LoadedModel kept = model.Acquire();
        int arrays = NativeArray<GarmentVertex>.Alive;
        using (TestRig rig = new TestRig(model))
        {
            Cycle(rig, 10);
            long before = ResidentKib();
            Cycle(rig, 60);
            long grown = ResidentKib() - before;
            Console.WriteLine("         60 garments that came and went: " + grown + " KiB more");
            Assert.Less(grown, 20000f, "KiB; a garment alone has more than 1000");
        }
        Assert.AreEqual(arrays, NativeArray<GarmentVertex>.Alive, "native arrays");
        Assert.AreEqual(1, model.Owners, "owners");
        Assert.IsFalse(kept == null);
        model.Release();
    }

    [Test]
    public void ModelsThatComeAndGoLeaveNothing()
    {
        UnicModel model = TestModel.Asset();
        for (int i = 0; i < 5; i++) Load(model);
        long before = ResidentKib();
        for (int i = 0; i < 20; i++) Load(model);
        long grown = ResidentKib() - before;
        Console.WriteLine("         20 models that came and went: " + grown + " KiB more");
        Assert.Less(grown, 30000f, "KiB; a model alone has more than 6000");
    }

    private static void Load(UnicModel model)
    {
        model.Acquire();
        model.Release();
    }

    private static void Cycle(TestRig rig, int times)
    {
        for (int i = 0; i < times; i++)
        {
            rig.Walk(2, 0f, Vector3.zero);
            rig.garment.enabled = false;
            rig.garment.enabled = true;
        }
        GC.Collect();
        GC.WaitForPendingFinalizers();
    }

    internal static long ResidentKib()
    {
        foreach (string line in File.ReadAllLines("/proc/self/status"))
            if (line.StartsWith("VmRSS:", StringComparison.Ordinal))
                return long.Parse(line.Substring(6).Replace("kB", "").Trim());
        throw new InvalidDataException("no VmRSS");
    }
}
