// Contract: instances step on threads of the caller at the same time, with the results of one thread;
// one instance on two threads is an error with a code, and no crash.

using System;
using System.Threading;
using NUnit.Framework;
using Unic;
using Unic.Native;
using UnityEngine;

public sealed class ThreadTests
{
    private const int Threads = 4;
    private const int Ticks = 10;

    [Test]
    public void InstancesOnThreadsGiveTheSameVertices()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        GarmentVertex[][] shapes = new GarmentVertex[Threads + 1][];
        shapes[Threads] = Play(model);
        Thread[] threads = new Thread[Threads];
        for (int i = 0; i < Threads; i++)
        {
            int own = i;
            threads[i] = new Thread(() => shapes[own] = Play(model));
            threads[i].Start();
        }
        foreach (Thread thread in threads) thread.Join();
        for (int i = 0; i < Threads; i++)
            for (int vertex = 0; vertex < shapes[Threads].Length; vertex++)
                Assert.AreEqual(shapes[Threads][vertex], shapes[i][vertex], "vertex");
        asset.Release();
    }

    [Test]
    public void OneInstanceOnTwoThreadsIsAnError()
    {
        UnicModel asset = TestModel.Asset();
        LoadedModel model = asset.Acquire();
        int refused = 0, others = 0;
        using (UnicInstance instance = new UnicInstance(model, InstanceSettings.Default))
        {
            Thread[] threads = new Thread[2];
            for (int i = 0; i < threads.Length; i++)
            {
                threads[i] = new Thread(() =>
                {
                    RigPose pose = new RigPose(model.JointCount);
                    for (int tick = 0; tick < 40; tick++)
                    {
                        try { instance.Step(pose, new Surroundings()); }
                        catch (UnicException error) when (error.Status == UnicStatus.InUse) { Interlocked.Increment(ref refused); }
                        catch (Exception) { Interlocked.Increment(ref others); }
                    }
                });
                threads[i].Start();
            }
            foreach (Thread thread in threads) thread.Join();
        }
        Assert.AreEqual(0, others, "other errors");
        Assert.Greater(refused, 0f, "refused calls");
        asset.Release();
    }

    private static GarmentVertex[] Play(LoadedModel model)
    {
        using (UnicInstance instance = new UnicInstance(model, InstanceSettings.Default))
        {
            RigPose pose = new RigPose(model.JointCount);
            GarmentVertex[] vertices = new GarmentVertex[instance.VertexCount];
            instance.Reset(pose, new Surroundings());
            for (int tick = 0; tick < Ticks; tick++)
            {
                pose.root = new Vector3(0f, 1f, 0.03f * tick);
                pose.rotations[model.RootJoint] = Quaternion.AngleAxis(3f * tick, Vector3.up);
                instance.Step(pose, new Surroundings());
            }
            instance.Display(pose, 0.5f, vertices);
            return vertices;
        }
    }
}
