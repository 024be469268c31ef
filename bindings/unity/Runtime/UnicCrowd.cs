using System.Collections.Generic;
using System.Diagnostics;
using UnityEngine;

namespace Unic
{
    /// <summary>Runs many garments within a time for each frame.</summary>
    /// <remarks>
    /// Garments whose tick is the longest overdue go first. Those for which no time is left show
    /// their last tick on the moved body, and tick in one of the next frames.
    /// </remarks>
    [AddComponentMenu("Unic/Unic Crowd")]
    [DisallowMultipleComponent]
    [DefaultExecutionOrder(1001)]
    public sealed class UnicCrowd : MonoBehaviour
    {
        /// <summary>Time for the ticks of one frame, milliseconds. 0: no limit. One tick is always made.</summary>
        [Tooltip("Time for the ticks of one frame, milliseconds. 0: no limit. One tick is always made.")]
        public float budgetMs = 8f;

        /// <summary>Threads that the ticks of the garments work on.</summary>
        [Tooltip("Threads that the ticks of the garments work on.")]
        public UnicThreads threads = UnicThreads.Pool;

        private readonly List<UnicGarment> members = new List<UnicGarment>();
        // Members of the frame: a handler of Shown may enable and disable garments meanwhile.
        private readonly List<UnicGarment> inFrame = new List<UnicGarment>();
        private readonly Stopwatch watch = new Stopwatch();

        /// <summary>Number of garments.</summary>
        public int Count => members.Count;

        /// <summary>Ticks of the last frame.</summary>
        public int Ticks { get; private set; }

        /// <summary>Garments of the last frame that wait for a tick.</summary>
        public int Waiting { get; private set; }

        /// <summary>Time of the last frame's ticks, milliseconds.</summary>
        public float TickMs { get; private set; }

        /// <summary>Time of the last frame with poses and displays, milliseconds.</summary>
        public float FrameMs { get; private set; }

        internal void Add(UnicGarment garment)
        {
            if (!members.Contains(garment)) members.Add(garment);
        }

        internal void Remove(UnicGarment garment)
        {
            members.Remove(garment);
        }

        private void LateUpdate()
        {
            RunFrame(Time.deltaTime);
        }

        /// <summary>Runs all garments for a frame of some seconds.</summary>
        internal void RunFrame(float seconds)
        {
            watch.Reset();
            watch.Start();
            inFrame.Clear();
            inFrame.AddRange(members);
            // A garment that a handler has disabled must not begin again.
            for (int i = 0; i < inFrame.Count; i++)
                if (members.Contains(inFrame[i])) inFrame[i].BeginFrame(seconds);
            double start = watch.Elapsed.TotalMilliseconds;
            Ticks = 0;
            UnicGarment next = MostOverdue();
            while (next != null && HasTime(start))
            {
                next.TickOnce();
                Ticks++;
                next = MostOverdue();
            }
            TickMs = (float)(watch.Elapsed.TotalMilliseconds - start);
            Waiting = CountDue();
            for (int i = 0; i < inFrame.Count; i++) inFrame[i].EndFrame();
            inFrame.Clear();
            FrameMs = (float)watch.Elapsed.TotalMilliseconds;
        }

        private bool HasTime(double start)
        {
            return Ticks == 0 || budgetMs <= 0f || watch.Elapsed.TotalMilliseconds - start < budgetMs;
        }

        private UnicGarment MostOverdue()
        {
            UnicGarment most = null;
            for (int i = 0; i < inFrame.Count; i++)
            {
                UnicGarment member = inFrame[i];
                if (member.IsTickDue && (most == null || member.Waited > most.Waited)) most = member;
            }
            return most;
        }

        private int CountDue()
        {
            int count = 0;
            for (int i = 0; i < inFrame.Count; i++)
                if (inFrame[i].IsTickDue) count++;
            return count;
        }
    }
}
