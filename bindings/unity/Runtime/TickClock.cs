using System;

namespace Unic
{
    /// <summary>Ticks of the model within frames of the display.</summary>
    public struct TickClock
    {
        // A frame that ends this share of a tick before it counts as ending with it: sums of
        // rounded frame times must not put off a tick by a frame.
        private const double Early = 1e-3;

        private readonly double tick;
        private double sinceTick;
        private double frame;
        private double waited;

        /// <summary>Makes a clock that has just ticked.</summary>
        public TickClock(float fps)
        {
            tick = 1.0 / fps;
            sinceTick = 0.0;
            frame = 0.0;
            waited = 0.0;
        }

        /// <summary>Seconds of a tick.</summary>
        public double Tick => tick;

        /// <summary>Seconds since the last tick.</summary>
        /// <exception cref="ArgumentOutOfRangeException">The number is set to one that is not finite.</exception>
        public double SinceTick
        {
            get { return sinceTick; }
            set
            {
                if (double.IsNaN(value) || double.IsInfinity(value))
                    throw new ArgumentOutOfRangeException("value", value, "expected a finite number of seconds");
                sinceTick = value;
            }
        }

        /// <summary>Begins anew: a tick has just happened.</summary>
        public void Restart()
        {
            sinceTick = 0.0;
            frame = 0.0;
            waited = 0.0;
        }

        /// <summary>Passes the time of a frame, at most mostTicks ticks of it. Time below 0 and NaN pass nothing.</summary>
        public void Advance(double seconds, int mostTicks)
        {
            if (!(seconds > 0.0)) seconds = 0.0;
            double most = mostTicks * tick;
            frame = seconds < most ? seconds : most;
            sinceTick += frame;
            waited += seconds;
            // Ticks that an earlier frame had no time for are dropped, too.
            if (sinceTick > most) sinceTick = most;
        }

        /// <summary>Whether a tick is due.</summary>
        public bool IsDue => sinceTick >= tick * (1.0 - Early);

        /// <summary>Seconds since the last tick, with those that were dropped.</summary>
        public double Waited => waited;

        /// <summary>Takes a tick. The share of the frame, 0 to 1, is the moment of it.</summary>
        public float Take()
        {
            sinceTick -= tick;
            waited = sinceTick;
            if (frame <= 0.0 || sinceTick <= Early * tick) return 1f;
            double share = 1.0 - sinceTick / frame;
            return share <= 0.0 ? 0f : (float)share;
        }

        /// <summary>Way from the last tick to the next one, 0 to 1.</summary>
        public float Share
        {
            get
            {
                double share = sinceTick / tick;
                return share <= 0.0 ? 0f : share >= 1.0 ? 1f : (float)share;
            }
        }
    }
}
