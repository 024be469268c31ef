using NUnit.Framework;
using Unic;

/// <summary>Contract: a clock ticks at the model's rate, whatever the display's is.</summary>
public sealed class ClockTests
{
    [Test]
    public void TicksFollowTheTimeAtAnyFrameRate()
    {
        foreach (float rate in new[] { 24f, 30f, 59.94f, 60f, 90f, 144f })
        {
            TickClock clock = new TickClock(30f);
            int ticks = 0, frames = (int)(20f * rate);
            for (int frame = 0; frame < frames; frame++)
            {
                clock.Advance(1f / rate, 3);
                while (clock.IsDue)
                {
                    float share = clock.Take();
                    Assert.IsTrue(share >= 0f && share <= 1f, "a moment within the frame");
                    ticks++;
                }
                Assert.IsTrue(clock.Share >= 0f && clock.Share <= 1f, "a share");
            }
            Assert.AreEqual(30f * frames / rate, ticks, 1f, "ticks at " + rate);
        }
    }

    [Test]
    public void ATickAtTheEndOfAFrameTakesThePoseOfTheFrame()
    {
        TickClock clock = new TickClock(30f);
        for (int frame = 1; frame <= 600; frame++)
        {
            clock.Advance(1f / 60f, 3);
            Assert.AreEqual(frame % 2 == 0, clock.IsDue, "a tick in frame " + frame);
            if (clock.IsDue) Assert.AreEqual(1f, clock.Take());
        }
    }

    [Test]
    public void TicksOfOneFrameAreSpreadOverIt()
    {
        TickClock clock = new TickClock(30f);
        clock.Advance(0.1f, 8);
        Assert.AreEqual(1f / 3f, clock.Take(), 1e-4f);
        Assert.AreEqual(2f / 3f, clock.Take(), 1e-4f);
        Assert.AreEqual(1f, clock.Take(), 1e-4f);
        Assert.IsFalse(clock.IsDue);
    }

    [Test]
    public void ALongFrameIsCut()
    {
        TickClock clock = new TickClock(30f);
        clock.Advance(5f, 3);
        int ticks = 0;
        for (; clock.IsDue; ticks++) clock.Take();
        Assert.AreEqual(3, ticks, "ticks");
    }

    [Test]
    public void TimeBelowZeroAndNaNPassNothing()
    {
        TickClock clock = new TickClock(30f);
        foreach (double none in new[] { -1.0, double.NaN, double.NegativeInfinity }) clock.Advance(none, 3);
        Assert.AreEqual(0f, clock.Share);
        clock.Advance(1.0 / 30.0, 3);
        Assert.IsTrue(clock.IsDue, "a tick");
        Assert.AreEqual(1f, clock.Take());
        Assert.IsTrue(clock.Waited <= 0.001, "seconds since the tick");
        Assert.Throws<System.ArgumentOutOfRangeException>(() => clock.SinceTick = double.NaN);
    }

    [Test]
    public void NoTimeGivesNoTicks()
    {
        TickClock clock = new TickClock(30f);
        for (int frame = 0; frame < 10; frame++) clock.Advance(0f, 3);
        Assert.IsFalse(clock.IsDue);
        Assert.AreEqual(0f, clock.Share);
    }
}
