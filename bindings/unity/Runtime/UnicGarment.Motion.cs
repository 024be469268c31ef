using System;
using UnityEngine;

namespace Unic
{
    public sealed partial class UnicGarment
    {
        // Positions are f32, relative to an anchor on this grid: near it they are exact to some micrometres.
        private const float AnchorGrid = 64f;
        private const float SecondsUntilSleep = 0.25f;
        // A garment that stood still goes on without a restart if the body is where it was.
        private const float NearMetres = 0.1f;
        private const float NearHalfCosine = 0.99f;
        // A move that is shorter is not a teleport, however short the frame is.
        private const float LeastTeleport = 0.5f;

        private readonly GarmentColliders nativeColliders = new GarmentColliders();
        private RigPose before;
        private RigPose now;
        private RigPose ofTick;
        private TickClock clock;
        private bool isPaused;
        private bool wantsRestart;
        // After a restored state nothing is known of where the body was: that is no teleport.
        private bool isRestored;
        private bool isNewShape;
        private float unseenSeconds;
        private Vector3 centreFromRoot;
        private Camera mainCamera;
        // Delegates that are made once: a method group makes garbage in every frame.
        private Action restart;
        private Action tick;
        private Action show;

        /// <summary>Whether ticks stand still by Pause.</summary>
        public bool IsPaused => isPaused;

        /// <summary>Whether a tick is due in this frame.</summary>
        internal bool IsTickDue => Activity == GarmentActivity.Moving && clock.IsDue;

        /// <summary>Seconds since the last tick: the more, the more urgent is the next one.</summary>
        internal double Waited => clock.Waited;

        // Where ticks stand still, the last shape must follow the body at any rate.
        private bool DisplaysBetween =>
            displayRate == DisplayRate.EveryFrame || Activity == GarmentActivity.Still;

        /// <summary>Stops the ticks. The last shape follows the body.</summary>
        public void Pause()
        {
            isPaused = true;
        }

        /// <summary>Goes on after Pause. The garment restarts if the body has moved meanwhile.</summary>
        public void Resume()
        {
            isPaused = false;
        }

        /// <summary>Restarts the garment at rest in the next frame, after the character was moved.</summary>
        public void Teleport()
        {
            wantsRestart = true;
        }

        /// <summary>Moves the garment with the world, where a game shifts its origin.</summary>
        /// <param name="shift">Added to every world position.</param>
        public void ShiftOrigin(Vector3 shift)
        {
            Anchor += shift;
        }

        /// <summary>Everything that the next frame depends on, to be restored later.</summary>
        /// <exception cref="InvalidOperationException">The garment has not begun.</exception>
        public byte[] SaveState()
        {
            if (instance == null) throw new InvalidOperationException(name + ": the garment has not begun");
            return GarmentState.Join(instance.Save(), Anchor, clock.SinceTick);
        }

        /// <summary>Continues a saved state of the same model, wherever the body is in the next frame.</summary>
        /// <exception cref="InvalidOperationException">The garment has not begun.</exception>
        /// <exception cref="UnicException">The bytes are not a state of this model.</exception>
        public unsafe void RestoreState(byte[] state)
        {
            if (instance == null) throw new InvalidOperationException(name + ": the garment has not begun");
            Vector3 anchor;
            double sinceTick;
            instance.Restore(GarmentState.Split(state, out anchor, out sinceTick));
            Anchor = anchor;
            clock.SinceTick = sinceTick;
            rig.Read(now, Anchor);
            instance.Display(now, clock.Share, mesh.Pointer);
            isNewShape = true;
            isRestored = true;
            wantsRestart = false;
        }

        /// <summary>Reads the pose, and decides what this frame does.</summary>
        internal void BeginFrame(float seconds)
        {
            if (!Begin()) return;
            if (!rig.IsAlive)
            {
                Fail(name + ": expected the bones of the rig, found destroyed ones");
                return;
            }
            Place();
            rig.Read(now, Anchor);
            if (isRestored) before.Set(now);
            isRestored = false;
            GarmentActivity last = Activity;
            Activity = Decide(seconds);
            if (Activity == GarmentActivity.Asleep)
            {
                mesh.SetBounds(new Bounds(now.root + centreFromRoot, mesh.Bounds.size));
                return;
            }
            bool moves = Activity == GarmentActivity.Moving, moved = last == GarmentActivity.Moving;
            bool stood = last == GarmentActivity.Still || last == GarmentActivity.Asleep;
            bool isAway = stood ? !before.IsNear(now, NearMetres, NearHalfCosine) : moved && Jumped(seconds);
            if (wantsRestart || moves && isAway) Guard(restart);
            // The first frame is a restart already, and its time was before the garment.
            else if (moves && (moved || stood)) clock.Advance(seconds, mostTicks);
            if (instance != null) ChooseDetail();
        }

        /// <summary>Makes one tick that is due.</summary>
        internal void TickOnce()
        {
            Guard(tick);
        }

        /// <summary>Shows the garment on the pose of this frame.</summary>
        internal void EndFrame()
        {
            if (Activity == GarmentActivity.None || Activity == GarmentActivity.Asleep) return;
            if (DisplaysBetween || isNewShape) Guard(show);
            // Where ticks stand still, the pose before them is kept for the moment they go on.
            if (Activity == GarmentActivity.Moving) Swap();
        }

        private void BeginMotion()
        {
            restart = Restart;
            tick = Tick;
            show = Show;
            before = new RigPose(loaded.JointCount);
            now = new RigPose(loaded.JointCount);
            ofTick = new RigPose(loaded.JointCount);
            clock = new TickClock(loaded.Fps);
            nativeColliders.Restart();
            Ticks = 0;
            Restarts = 0;
            unseenSeconds = 0f;
            Restart();
            Place();
            Show();
        }

        private void Guard(Action work)
        {
            try
            {
                work();
            }
            catch (UnicException error)
            {
                Fail(name + ": " + error.Message);
            }
        }

        private unsafe void Restart()
        {
            Vector3 root = rig.RootPosition;
            Anchor = new Vector3(OnGrid(root.x), OnGrid(root.y), OnGrid(root.z));
            Place();
            rig.Read(now, Anchor);
            SendColliders();
            instance.Reset(now, Around(), mesh.Pointer);
            before.Set(now);
            clock.Restart();
            wantsRestart = false;
            isNewShape = true;
            Restarts++;
        }

        private unsafe void Tick()
        {
            ofTick.SetBetween(before, now, clock.Take());
            SendColliders();
            // With a display between ticks the vertices of the tick itself are never seen.
            instance.Step(ofTick, Around(), DisplaysBetween ? null : mesh.Pointer);
            isNewShape = true;
            Ticks++;
        }

        private unsafe void Show()
        {
            if (DisplaysBetween) instance.Display(now, clock.Share, mesh.Pointer);
            mesh.Upload();
            centreFromRoot = mesh.Bounds.center - now.root;
            isNewShape = false;
            Announce();
        }

        // A handler is not the garment's: its exception must not stop the frame of a crowd's other members.
        private void Announce()
        {
            if (Shown == null) return;
            try
            {
                Shown(this);
            }
            catch (Exception error)
            {
                Debug.LogException(error, this);
            }
        }

        private void SendColliders()
        {
            nativeColliders.Send(instance, colliders, Anchor);
        }

        private Surroundings Around()
        {
            return new Surroundings { groundHeight = colliders.groundHeight - Anchor.y, wind = wind };
        }

        private GarmentActivity Decide(float seconds)
        {
            unseenSeconds = shower.isVisible ? 0f : unseenSeconds + seconds;
            if (outOfSight == OutOfSight.Sleep && unseenSeconds > SecondsUntilSleep) return GarmentActivity.Asleep;
            bool isFar = farDistance > 0f && Distance() > farDistance;
            return isPaused || isFar ? GarmentActivity.Still : GarmentActivity.Moving;
        }

        private bool Jumped(float seconds)
        {
            if (teleportSpeed <= 0f) return false;
            float most = Mathf.Max(LeastTeleport, teleportSpeed * seconds);
            return (now.root - before.root).sqrMagnitude > most * most;
        }

        private void ChooseDetail()
        {
            if (details == null || details.Length < 2) return;
            int wanted = DetailLevel.At(details, Distance(), Detail);
            if (wanted == Detail) return;
            Detail = wanted;
            Guard(ChangeDetail);
        }

        // The sampling of an instance is fixed: a new one continues the state.
        private void ChangeDetail()
        {
            UnicInstance next = new UnicInstance(loaded, SettingsOf(Detail));
            try
            {
                next.Restore(instance.Save());
            }
            catch
            {
                next.Dispose();
                throw;
            }
            instance.Dispose();
            instance = next;
            nativeColliders.Restart();
        }

        private float Distance()
        {
            Transform from = viewer;
            if (from == null)
            {
                if (mainCamera == null) mainCamera = Camera.main;
                if (mainCamera == null) return 0f;
                from = mainCamera.transform;
            }
            return Vector3.Distance(from.position, rig.RootPosition);
        }

        // Parents move, turn and scale; the mesh is at the anchor, upright, in metres.
        private void Place()
        {
            transform.SetPositionAndRotation(Anchor, Quaternion.identity);
            Vector3 scale = transform.lossyScale;
            // A character that is scaled to nothing has no size to undo.
            if (scale == Vector3.one || scale.x * scale.y * scale.z == 0f) return;
            Vector3 local = transform.localScale;
            transform.localScale = new Vector3(local.x / scale.x, local.y / scale.y, local.z / scale.z);
        }

        private void Swap()
        {
            RigPose last = before;
            before = now;
            now = last;
        }

        private static float OnGrid(float metres)
        {
            return Mathf.Round(metres / AnchorGrid) * AnchorGrid;
        }
    }
}
