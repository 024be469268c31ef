// Measures, for the package's README: UNIC_TEST_TIMES=1 Tests~/run.sh Time. Checks nothing.

using System;
using System.IO;
using System.Runtime.InteropServices;
using NUnit.Framework;
using Unic;
using UnityEngine;

public sealed class TimeTests
{
    [Test]
    public void TimeAndMemoryOfACharacter()
    {
        if (Environment.GetEnvironmentVariable("UNIC_TEST_TIMES") == null) Assert.Ignore("UNIC_TEST_TIMES is not set");
        UnicModel asset = TestModel.Asset();
        long before = MemoryTests.ResidentKib();
        asset.Acquire();
        Console.WriteLine("         a model of " + asset.Size / 1024 + " KiB: " + (MemoryTests.ResidentKib() - before)
                          + " KiB more");
        // Memory that was released stays with the process, so that crowds that grow are measured from one start.
        long start = MemoryTests.ResidentKib();
        foreach (int members in new[] { 1, 16, 64 }) Crowd(members, UnicThreads.None, start);
        Crowd(16, UnicThreads.Pool, start);
        foreach (string file in new[] { "tshirt.unic", "skirt.unic" })
            foreach (UnicIntersection rule in new[] { UnicIntersection.Model, UnicIntersection.Off })
                foreach (float sampling in new[] { 1f, 0.25f })
                    One(file, rule, sampling);
    }

    // Processor time of one thread: other programs may be at work.
    private static void One(string file, UnicIntersection rule, float sampling)
    {
        string folder = Path.GetDirectoryName(Environment.GetEnvironmentVariable("UNIC_TEST_MODEL"));
        UnicModel model = UnicModel.FromBytes(file, File.ReadAllBytes(Path.Combine(folder, file)));
        using (TestRig rig = new TestRig(model, 5))
        {
            rig.garment.details = new[] { new DetailLevel(0f, sampling, rule) };
            rig.Walk(20, 0f, Vector3.zero);
            double ticks = 0.0, between = 0.0, start = Processor();
            for (int frame = 20; frame < 420; frame++)
            {
                rig.Walk(frame / 60f, Vector3.zero);
                int before = rig.garment.Ticks;
                start = Processor();
                rig.Frame(1f / 60f);
                if (rig.garment.Ticks > before) ticks += Processor() - start;
                else between += Processor() - start;
            }
            Console.WriteLine("         " + file + ", intersections " + rule + ", sampling " + sampling + ": frame with a tick "
                + (ticks / 200.0).ToString("0.00") + " ms, without one " + (between / 200.0).ToString("0.00") + " ms");
        }
    }

    // Frames of 30 Hz: a tick and a display of every member each.
    private static void Crowd(int members, UnicThreads threads, long before)
    {
        UnicModel model = TestModel.Asset();
        model.Acquire();
        UnicCrowd crowd = new GameObject("crowd").AddComponent<UnicCrowd>();
        crowd.threads = threads;
        crowd.budgetMs = 0f;
        TestRig[] rigs = new TestRig[members];
        for (int i = 0; i < members; i++)
        {
            rigs[i] = new TestRig(model);
            rigs[i].garment.Crowd = crowd;
        }
        double processor = 0.0;
        int ticks = 0;
        for (int frame = 0; frame < 40; frame++)
        {
            foreach (TestRig rig in rigs) rig.Walk(frame / 30f, Vector3.zero);
            double start = Processor();
            crowd.RunFrame(1f / 30f);
            if (frame < 10) continue;
            processor += Processor() - start;
            ticks += crowd.Ticks;
        }
        long grown = MemoryTests.ResidentKib() - before;
        Console.WriteLine("         " + members + " characters, threads " + threads + ": " + (processor / 30.0).ToString("0.0")
            + " ms of processor time a frame with " + ticks / 30 + " ticks, " + grown / 1024 + " MiB more than before");
        foreach (TestRig rig in rigs) rig.Dispose();
        UnityEngine.Object.DestroyImmediate(crowd.gameObject);
    }

    private static double Processor()
    {
        return clock().ToInt64() / 1000.0;
    }

    // Processor time of the process, microseconds on Linux.
    [DllImport("libc")]
    private static extern IntPtr clock();
}
