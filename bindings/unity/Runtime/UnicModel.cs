using System;
using UnityEngine;

namespace Unic
{
    /// <summary>Asset of a .unic file: a trained garment of one character.</summary>
    /// <remarks>
    /// The native model is loaded by the first owner and released by the last one. Garments are
    /// owners while they are enabled.
    /// </remarks>
    public sealed class UnicModel : ScriptableObject
    {
        [SerializeField, HideInInspector] private byte[] bytes = new byte[0];

        [NonSerialized] private LoadedModel loaded;
        [NonSerialized] private int owners;

        /// <summary>Size of the file in bytes.</summary>
        public int Size => bytes.Length;

        /// <summary>Number of owners of the loaded model.</summary>
        public int Owners => owners;

        /// <summary>The bytes of the file. They must not be changed.</summary>
        public byte[] Bytes => bytes;

        /// <summary>Makes an asset of the bytes of a file, without checking them.</summary>
        public static UnicModel FromBytes(string name, byte[] bytes)
        {
            UnicModel model = CreateInstance<UnicModel>();
            model.name = name;
            model.bytes = bytes;
            return model;
        }

        /// <summary>Loads the model, or shares the loaded one. Each call needs one Release.</summary>
        /// <exception cref="UnicException">The bytes are not a model, or the library is missing.</exception>
        public LoadedModel Acquire()
        {
            if (loaded == null) loaded = new LoadedModel(name, bytes);
            owners++;
            return loaded;
        }

        /// <summary>Ends the use by one owner.</summary>
        public void Release()
        {
            if (owners == 0) throw new InvalidOperationException(name + ": released more often than acquired");
            owners--;
            if (owners == 0) Unload();
        }

        private void OnDisable()
        {
            // The asset goes. Instances live on in the native library until their owners end them,
            // and owners still release.
            Unload();
        }

        private void Unload()
        {
            if (loaded != null) loaded.Dispose();
            loaded = null;
        }
    }
}
