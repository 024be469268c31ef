using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Bytes of a garment's state: the native ones, the anchor and the time since the tick.</summary>
    internal static class GarmentState
    {
        private const int Tail = 3 * 4 + 8;
        // A tick may be early, and most ticks of a frame are dropped: saved times are far within these.
        private const double LeastSeconds = -1.0;
        private const double MostSeconds = 60.0;

        internal static byte[] Join(byte[] native, Vector3 anchor, double sinceTick)
        {
            byte[] state = new byte[native.Length + Tail];
            Buffer.BlockCopy(native, 0, state, 0, native.Length);
            Buffer.BlockCopy(new[] { anchor.x, anchor.y, anchor.z }, 0, state, native.Length, 12);
            Buffer.BlockCopy(new[] { sinceTick }, 0, state, native.Length + 12, 8);
            return state;
        }

        /// <exception cref="UnicException">The bytes are too few, or hold a place or a time that cannot be.</exception>
        internal static byte[] Split(byte[] state, out Vector3 anchor, out double sinceTick)
        {
            if (state == null || state.Length < Tail)
                throw new UnicException("expected a saved state of a garment, found "
                                        + (state == null ? 0 : state.Length) + " bytes");
            byte[] native = new byte[state.Length - Tail];
            float[] place = new float[3];
            double[] time = new double[1];
            Buffer.BlockCopy(state, 0, native, 0, native.Length);
            Buffer.BlockCopy(state, native.Length, place, 0, 12);
            Buffer.BlockCopy(state, native.Length + 12, time, 0, 8);
            anchor = new Vector3(place[0], place[1], place[2]);
            sinceTick = time[0];
            if (!(IsFinite(anchor.x) && IsFinite(anchor.y) && IsFinite(anchor.z)))
                throw new UnicException("anchor of a saved state: expected finite numbers, found " + anchor);
            // Not-a-number is refused too: it would stop all ticks.
            if (!(sinceTick >= LeastSeconds && sinceTick <= MostSeconds))
                throw new UnicException("seconds since the tick of a saved state: expected " + LeastSeconds + " to "
                                        + MostSeconds + ", found " + sinceTick);
            return native;
        }

        private static bool IsFinite(float number)
        {
            return !float.IsNaN(number) && !float.IsInfinity(number);
        }
    }
}
