using System.Collections.Generic;
using UnityEngine;

namespace Unic.Samples
{
    /// <summary>Fills a scene with walking, dressed characters. A slider sets their number.</summary>
    [RequireComponent(typeof(UnicCrowd))]
    public sealed class WalkScene : MonoBehaviour
    {
        private const int Most = 64;
        private const float Spacing = 3f;

        [Tooltip("The trained garment. Its own character is the body.")]
        public UnicModel model;

        [Tooltip("Material of the body.")]
        public Material bodyMaterial;

        [Tooltip("Material of the garment.")]
        public Material garmentMaterial;

        [Tooltip("Number of characters at the start.")]
        [Range(1, Most)] public int characters = 1;

        private readonly List<UnicGarment> garments = new List<UnicGarment>();
        private LoadedModel loaded;
        private UnicCrowd crowd;
        // All characters share the body's mesh.
        private Mesh body;

        /// <summary>The garments of the scene.</summary>
        public IList<UnicGarment> Garments => garments;

        private void Start()
        {
            if (model == null)
            {
                Debug.LogError("unic: " + name + ": expected a model, found none", this);
                enabled = false;
                return;
            }
            crowd = GetComponent<UnicCrowd>();
            loaded = model.Acquire();
        }

        private void OnDestroy()
        {
            while (garments.Count > 0) RemoveLast();
            if (body != null) Destroy(body);
            if (loaded != null) model.Release();
            loaded = null;
        }

        private void Update()
        {
            while (garments.Count < characters) Add(garments.Count);
            while (garments.Count > characters) RemoveLast();
        }

        private void OnGUI()
        {
            GUILayout.BeginArea(new Rect(10f, 10f, 320f, 120f));
            GUILayout.Label(characters + " characters, " + crowd.Ticks + " ticks in " + crowd.TickMs.ToString("0.0")
                            + " ms, " + crowd.Waiting + " wait");
            characters = Mathf.RoundToInt(GUILayout.HorizontalSlider(characters, 1f, Most));
            GUILayout.Label("time for ticks: " + crowd.budgetMs.ToString("0") + " ms a frame");
            crowd.budgetMs = GUILayout.HorizontalSlider(crowd.budgetMs, 1f, 33f);
            GUILayout.EndArea();
        }

        private void Add(int number)
        {
            GameObject character = new GameObject("character " + number);
            Transform[] bones = WalkBody.Bones(loaded, character.transform);
            if (body == null) body = WalkBody.Skin(new UnicModelFile(model.Bytes), bones);
            GameObject skinned = new GameObject("body");
            skinned.transform.SetParent(character.transform, false);
            SkinnedMeshRenderer skin = skinned.AddComponent<SkinnedMeshRenderer>();
            skin.sharedMesh = body;
            skin.bones = bones;
            skin.rootBone = bones[loaded.RootJoint];
            skin.sharedMaterial = bodyMaterial;
            skin.updateWhenOffscreen = true;
            Vector3 centre = new Vector3(Spacing * (number % 8), 0f, Spacing * (number / 8));
            character.AddComponent<ProceduralWalk>().Begin(loaded, bones, centre, 1f, 0.37f * number);
            garments.Add(Dress(character, skin));
        }

        private UnicGarment Dress(GameObject character, SkinnedMeshRenderer skin)
        {
            GameObject cloth = new GameObject("garment");
            cloth.transform.SetParent(character.transform, false);
            UnicGarment garment = cloth.AddComponent<UnicGarment>();
            cloth.GetComponent<MeshRenderer>().sharedMaterial = garmentMaterial;
            garment.model = model;
            garment.skin = skin;
            garment.Crowd = crowd;
            return garment;
        }

        private void RemoveLast()
        {
            UnicGarment last = garments[garments.Count - 1];
            garments.RemoveAt(garments.Count - 1);
            // In a scene that ends, the engine may have destroyed it already.
            if (last != null) Destroy(last.transform.parent.gameObject);
        }
    }
}
