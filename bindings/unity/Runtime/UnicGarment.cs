using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Dresses a character: reads its bones and fills a mesh, at the model's rate.</summary>
    /// <remarks>
    /// The object holds the garment's mesh. The component moves it to the anchor, so it must not be
    /// a parent of the bones.
    /// </remarks>
    [AddComponentMenu("Unic/Unic Garment")]
    [RequireComponent(typeof(MeshFilter), typeof(MeshRenderer))]
    [DisallowMultipleComponent]
    [DefaultExecutionOrder(1000)] // After animation, constraints and the scripts that move bones.
    public sealed partial class UnicGarment : MonoBehaviour
    {
        /// <summary>The trained garment.</summary>
        [Tooltip("The trained garment.")]
        public UnicModel model;

        /// <summary>Skinned mesh of the character. Its bones move the garment.</summary>
        [Tooltip("Skinned mesh of the character. Its bones move the garment.")]
        public SkinnedMeshRenderer skin;

        /// <summary>How bones are found for the model's joints.</summary>
        [Tooltip("How bones are found for the model's joints.")]
        public RigSource rigSource;

        /// <summary>Animator with the humanoid avatar, if bones are found by it.</summary>
        [Tooltip("Animator with the humanoid avatar, if bones are found by it.")]
        public Animator animator;

        /// <summary>Rule for joints that the rig has no bone for.</summary>
        [Tooltip("Rule for joints that the rig has no bone for.")]
        public MissingJoints missingJoints;

        /// <summary>Largest distance of a joint at rest from the model's, metres.</summary>
        [Tooltip("Largest distance of a joint at rest from the model's, metres.")]
        public float mostRestError = 0.05f;

        /// <summary>Native settings. They are read when the garment begins.</summary>
        [Tooltip("Native settings. They are read when the garment begins.")]
        public InstanceSettings settings;

        /// <summary>Ground and props.</summary>
        [Tooltip("Ground and props.")]
        public ColliderSet colliders;

        /// <summary>Velocity of the air, m/s.</summary>
        [Tooltip("Velocity of the air, m/s.")]
        public Vector3 wind;

        /// <summary>Levels of detail, sorted by distance. Empty: the model's own sampling.</summary>
        [Tooltip("Levels of detail, sorted by distance. Empty: the model's own sampling.")]
        public DetailLevel[] details = new DetailLevel[0];

        /// <summary>Distance from which ticks stand still, metres. 0: never.</summary>
        [Tooltip("Distance from which ticks stand still, metres. 0: never.")]
        public float farDistance;

        /// <summary>Whose distance counts. Empty: the main camera.</summary>
        [Tooltip("Whose distance counts. Empty: the main camera.")]
        public Transform viewer;

        /// <summary>Rule for garments that no camera sees.</summary>
        [Tooltip("Rule for garments that no camera sees.")]
        public OutOfSight outOfSight;

        /// <summary>When a new shape is shown.</summary>
        [Tooltip("When a new shape is shown.")]
        public DisplayRate displayRate;

        /// <summary>Most ticks of one frame. Longer frames slow the garment down.</summary>
        [Tooltip("Most ticks of one frame. Longer frames slow the garment down.")]
        [Range(1, 8)] public int mostTicks = 3;

        /// <summary>Speed of the root above which a move is a teleport, m/s. 0: never.</summary>
        [Tooltip("Speed of the root above which a move is a teleport, m/s. 0: never.")]
        public float teleportSpeed = 30f;

        [SerializeField, Tooltip("Crowd that runs this garment. Empty: it runs by itself.")]
        private UnicCrowd crowd;

        internal static bool hasWarned;

        private LoadedModel loaded;
        private UnicModel owned;
        private UnicInstance instance;
        private UnicRig rig;
        private GarmentMesh mesh;
        private MeshRenderer shower;
        private Transform[] givenBones;
        private Matrix4x4[] givenBindposes;
        private bool hasBegun;

        /// <summary>The sentence about what is wrong; null if nothing is.</summary>
        public string Problem { get; private set; }

        /// <summary>Activity in the last frame.</summary>
        public GarmentActivity Activity { get; private set; }

        /// <summary>Index of the level of detail in use.</summary>
        public int Detail { get; private set; }

        /// <summary>Number of ticks since the garment was enabled.</summary>
        public int Ticks { get; private set; }

        /// <summary>Number of restarts: the first one, teleports and awakenings.</summary>
        public int Restarts { get; private set; }

        /// <summary>World position that the mesh's positions are relative to.</summary>
        public Vector3 Anchor { get; private set; }

        /// <summary>Size of the character relative to the model's. 0 before the garment has begun.</summary>
        public float CharacterScale => rig == null ? 0f : rig.scale;

        /// <summary>The mesh and its vertices. Null before the garment has begun.</summary>
        public GarmentMesh Mesh => mesh;

        /// <summary>Called after new vertices are in the mesh, such as for tangents. Exceptions are logged.</summary>
        public event Action<UnicGarment> Shown;

        /// <summary>Crowd that runs this garment; null if it runs by itself.</summary>
        public UnicCrowd Crowd
        {
            get { return crowd; }
            set
            {
                if (crowd == value) return;
                if (crowd != null) crowd.Remove(this);
                crowd = value;
                if (crowd != null && isActiveAndEnabled) crowd.Add(this);
            }
        }

        /// <summary>Uses bones in the model's order, instead of those of a skinned mesh.</summary>
        /// <param name="bones">Bone of each joint; null where there is none.</param>
        /// <param name="bindposes">From the space of the rest pose to the bone's at rest.</param>
        public void Bind(Transform[] bones, Matrix4x4[] bindposes)
        {
            givenBones = bones;
            givenBindposes = bindposes;
            Rebind();
        }

        /// <summary>Begins anew with the present fields, in the next frame.</summary>
        public void Rebind()
        {
            End();
        }

        /// <summary>Matches the joints of the model with the rig of the present fields.</summary>
        /// <exception cref="UnicException">There is no rig, or no humanoid avatar.</exception>
        internal RigMatch Match(LoadedModel names)
        {
            if (givenBones != null) return RigMatch.Given(names, givenBones, givenBindposes);
            if (skin == null) throw new UnicException(name + ": expected a skinned mesh or given bones, found none");
            return rigSource == RigSource.Humanoid
                ? RigMatch.ByAvatar(names, animator, skin)
                : RigMatch.ByName(names, skin);
        }

        private void OnEnable()
        {
            if (crowd != null) crowd.Add(this);
        }

        private void OnDisable()
        {
            if (crowd != null) crowd.Remove(this);
            End();
        }

        private void LateUpdate()
        {
            if (crowd != null) return;
            BeginFrame(Time.deltaTime);
            while (IsTickDue) TickOnce();
            EndFrame();
        }

        // Fields of a component that a script has added are set after OnEnable: the garment begins
        // with its first frame. A garment with a problem waits for Rebind or to be enabled again.
        private bool Begin()
        {
            if (hasBegun) return Problem == null;
            hasBegun = true;
            Problem = null;
            try
            {
                BeginNative();
                return true;
            }
            catch (UnicException error)
            {
                Fail(error.Message);
                return false;
            }
            catch (Exception error)
            {
                // A fault of the package: half-made fields would be a fault in every frame.
                Fail(error.Message);
                throw;
            }
        }

        private void BeginNative()
        {
            if (model == null) throw new UnicException(name + ": expected a model, found none");
            loaded = model.Acquire();
            owned = model;
            rig = new UnicRig(loaded, Match(loaded), missingJoints, mostRestError);
            if (rig.RootBone.IsChildOf(transform))
                throw new UnicException(name + ": expected an object beside the bones, found a parent of "
                                        + rig.RootBone.name);
            Detail = DetailLevel.At(details, Distance(), 0);
            instance = new UnicInstance(loaded, SettingsOf(Detail));
            if (instance.IsSlowerThanF32) WarnOnce(instance.Precision);
            mesh = new GarmentMesh(loaded.name, instance, Unic.Native.UnicMesh.Garment);
            GetComponent<MeshFilter>().sharedMesh = mesh.mesh;
            shower = GetComponent<MeshRenderer>();
            BeginMotion();
        }

        private InstanceSettings SettingsOf(int detail)
        {
            InstanceSettings chosen = settings;
            if (crowd != null) chosen.threads = crowd.threads;
            chosen.characterScale = rig.scale;
            if (details == null || details.Length == 0) return chosen;
            chosen.sampling = details[detail].sampling;
            if (details[detail].intersection != UnicIntersection.Model) chosen.intersection = details[detail].intersection;
            return chosen;
        }

        /// <summary>Warns about a number format that is slower and less exact than F32, once in a process.</summary>
        internal static void WarnOnce(UnicPrecision slow)
        {
            if (hasWarned) return;
            hasWarned = true;
            Debug.LogWarning("unic: " + slow + " is slower than F32 on this processor, and less exact");
        }

        private void Fail(string message)
        {
            EndNative();
            Problem = message;
            Debug.LogError("unic: " + message, this);
        }

        private void End()
        {
            EndNative();
            hasBegun = false;
            Problem = null;
        }

        private void EndNative()
        {
            Activity = GarmentActivity.None;
            if (instance != null) instance.Dispose();
            instance = null;
            rig = null;
            if (mesh != null) mesh.Dispose();
            mesh = null;
            loaded = null;
            if (owned != null) owned.Release();
            owned = null;
        }
    }
}
